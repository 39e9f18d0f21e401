"""Total-Lagrangian systems: one displacement field, its gradient at the points where the stress lives, forces that are its
transpose.

Nodes carry velocity and displacement, points carry the stress. A point p sees nodes j with scalar weights w_pj, which hold
no volumes, and with r_j = X_j - Xbar_p, y_j = u_j - ubar_p about the weighted means:

    M_p = (sum w r (x) r)^-1,   H_p = (sum w y (x) r) M_p,   F = I + H,   P = J stress F^-T
    f_j = -sum_p w_pj [V_p P_p M_p r + kappa_p (y_j - H_p r)]

The force is minus the gradient of the energy sum V_p psi(F_p) + sum kappa_p/2 w |y - H r|^2: momentum is kept to rounding,
and angular momentum and energy to the integrator. The second term, the residual, is what a linear field leaves of y; it
holds the modes that a gradient alone does not see.

Two forms of it:
- `stress-points`: nodes on the lattice and on the faces, points at the cell centres, the two sets of Taylor-SPH. By far the
  most accurate: a cantilever of twelve rows vibrates within .1 % where the usual form is 3-5 % slow.
- `total-lagrangian`: one set, every particle is its own point (Xbar_p = X_p, w = |W'|/r), the form of total-Lagrangian SPH
  with each side's own correction (sigma_i L_i^-1 + sigma_j L_j^-1). `run.correction = "paper"` puts L_i on both (He & Seaid
  2016, eq 13 with eq 3), which keeps no momentum at boundaries; it is there to compare with.

H follows from the displacements in every evaluation: nothing drifts, and single precision keeps the digits of small strains.
"""

from functools import cached_property
from itertools import pairwise

import numpy as np
import warp as wp

from wsph.body_force import BodyForce
from wsph.conditions import Conditions, layer_conditions, node_conditions, nonzero
from wsph.constitutive import Constitutive, blame
from wsph.errors import Refused
from wsph.lagrangian_kernels import BLOCK, Form, combine_kernel, kernels, set_up_kernel
from wsph.neighbours import find_pairs
from wsph.operators import Weights, average, outward_weights, spanning_weights, unparted
from wsph.particles import Lattice
from wsph.prescribed import BoundaryValues
from wsph.program import Clock
from wsph.scene import Body, Scene
from wsph.smoothing import SUPPORT
from wsph.space import Space
from wsph.state import State, layout_of
from wsph.system import System
from wsph.units import Scales
from wsph.work import ConstraintWork, LoadWork


class LagrangianSystem(System):
    """A body as one-set integrators see it: `rate`, `combine`, `impose`, `accept` over one flat state."""

    points = False
    default_support = 2.6
    default_residual = 1.0

    def __init__(self, scene: Scene, body: Body, lattice: Lattice, space: Space, constitutive: Constitutive,
                 scales: Scales, clock: Clock, device: str, displacement: bool):  # fmt: skip
        super().__init__(lattice, space, constitutive, scales, clock, device)
        laws, material = constitutive.laws, constitutive.material
        if laws.total is None and not hasattr(material, "rate"):
            raise Refused(f"{constitutive.who} has no law that the {self.formulation} form can use")
        unit = scales.length**space.dim
        nodes, cells = lattice.centred
        at_nodes = self.points or body.placement == "nodes"
        places, self.position = (nodes, lattice.nodes) if at_nodes else (cells, lattice.cells)
        self.volume = (lattice.node_volume if at_nodes else lattice.cell_volume) / unit
        self._cells = lattice.cell_volume / unit
        points = cells if self.points else places
        self._at_nodes = at_nodes
        self._set_up(scene, body, places, points)
        usual = self.default_residual if self.points or not at_nodes else 0.3
        residual = usual if body.residual is None else body.residual
        residual = getattr(residual, "coefficient", residual) or 0.0
        bulk, shear = material.moduli()
        youngs = 9.0 * bulk * shear / (3.0 * bulk + shear)
        self._stiffness = space.scalar(residual * youngs / scales.stress)
        viscosity = body.viscosity
        if viscosity is not None and self.points:
            raise Refused(
                f"body {body.name!r}: viscosity is a part of the total-lagrangian form, not of {self.formulation!r}"
            )
        # The paper's own c, not the one of the stress state: sqrt(E/rho).
        self._speed = space.scalar(np.sqrt(youngs / material.density) / scales.velocity)
        self._alpha, self._beta = (
            space.scalar(v) for v in ((viscosity.alpha, viscosity.beta) if viscosity else (0.0, 0.0))
        )
        self.viscous = viscosity is not None
        conditions = node_conditions if at_nodes else layer_conditions
        self.conditions: Conditions = conditions(scene, body.name, lattice)
        self.state = self.new()
        self.boundary = BoundaryValues(
            space, self.conditions, self.state, self.position, {"velocity": scales.velocity}, scales.time, device
        )
        self._loads = State(space, self.count, (("load", space.dim**2),), device)
        unit_force = scales.stress * scales.length ** (space.dim - 1)
        self.loads = BoundaryValues(
            space, self.conditions.loads, self._loads, self.position, {"load": unit_force}, scales.time, device
        )
        self._load_vectors = wp.array(
            ptr=self._loads.buffer.ptr, dtype=space.vec, shape=self.count * space.dim, device=device, copy=False
        )
        self.force = BodyForce(scene, body, space, scales, self.density, self.volume, device)
        if scene.run.correction == "paper" and self.loads.count:
            raise Refused(
                f'body {body.name!r}: with run.correction = "paper" a face feels half of its load, because L_i on both sides keeps no'
                " momentum at a boundary; use the symmetric correction"
            )
        form = Form(self.points, laws.total is not None, residual > 0.0, self.loads.count > 0,
                    scene.run.correction == "paper" and not self.points, viscosity.kind if viscosity else "")  # fmt: skip
        self.form = form
        with blame(constitutive.who):
            self.kernels = kernels(space, laws, self.state.layout, self.force.parts, form)
        m = len(self.point_volume)
        self._mean = wp.zeros(m if form.residual and form.points else 1, dtype=space.vec, device=device)
        self._corrected = wp.zeros(m, dtype=space.mat, device=device)
        self._drag = wp.zeros(self.count if self.viscous else 1, dtype=space.vec, device=device)
        self._point_volume = wp.array(self.point_volume, dtype=space.scalar, device=device)
        self._volume = wp.array(self.volume, dtype=space.scalar, device=device)
        self.work = _Works(
            ConstraintWork(space, self.boundary, self.density * self.volume, device),
            LoadWork(space, self.loads, self.state, self._loads, self._drag if self.viscous else None,
                     self.density * self.volume, device),
        )  # fmt: skip

    def _set_up(self, scene: Scene, body: Body, nodes: np.ndarray, points: np.ndarray) -> None:
        """Pairs, weights, means and moments, in double precision whatever the run's."""
        lattice, space, device = self.lattice, self.space, self.device
        self._support = scene.run.support or self.default_support
        reach = np.full(len(points), self._support)
        frame = lattice.frame
        factor = frame.step / self.scales.length
        position = nodes * np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor) @ frame.axes.T
        sided_nodes, sided_cells = lattice.sided if lattice.cracks else (nodes, points)
        sided = (
            sided_cells if self.points or not self._at_nodes else sided_nodes,
            sided_nodes if self._at_nodes else sided_cells,
        )
        double = Space(space.dim)
        while True:
            pairs = unparted(find_pairs(points, nodes, reach, device, same=not self.points), lattice, *sided)
            weight = wp.zeros(pairs.count, dtype=wp.float64, device=device)
            centre = wp.zeros(len(points), dtype=double.vec, device=device)
            moment = wp.zeros(len(points), dtype=double.mat, device=device)
            spread = wp.zeros(len(points), dtype=wp.float64, device=device)
            rank = wp.zeros(len(points), dtype=wp.int32, device=device)
            inputs = [wp.float64(self._support / SUPPORT), pairs.offsets, pairs.indices]
            inputs += [wp.array(a, dtype=double.vec, device=device) for a in (points, nodes, position)]
            kernel = set_up_kernel(double, scene.run.kernel, self.points)
            wp.launch(kernel, len(points), device=device, inputs=inputs, outputs=[weight, centre, moment, spread, rank])
            lonely = np.flatnonzero(rank.numpy() < space.dim)
            # A point of a shape's odd corner may need to see further.
            if not len(lonely) or not self.points or reach.max() > 2.0 * self._support:
                break
            reach[lonely] *= 1.5
        if len(lonely):
            raise Refused(
                f"{len(lonely)} particles of body {body.name!r}, the first at {self.position[lonely[0]].tolist()} m, see too few"
                f" neighbours for a gradient: raise run.support (now {self._support:g} spacings)"
            )
        self._pairs = pairs
        self._x = wp.array(position, dtype=space.vec, device=device)
        self._centre = wp.array(centre.numpy(), dtype=space.vec, device=device)
        self._weight = wp.array(weight.numpy(), dtype=space.scalar, device=device)
        self._moment = wp.array(moment.numpy(), dtype=space.mat, device=device)
        self._spread = wp.array(spread.numpy(), dtype=space.scalar, device=device)
        self._h = space.scalar(0.5 * self._support * lattice.spacing / self.scales.length)
        if self.points:
            self._back, order = pairs.transposed()
            self._back_weight = wp.array(weight.numpy()[order], dtype=space.scalar, device=device)

    @property
    def pairs(self) -> int:
        """Directed pairs, from points to nodes and back."""
        return self._pairs.count * (2 if self.points else 1)

    @property
    def point_volume(self) -> np.ndarray:
        return self._cells if self.points else self.volume

    @property
    def drag_energy(self) -> float:
        return self.work.loads.viscous

    def new(self) -> State:
        """A state, zero but for the internals' initial values."""
        m = len(self.point_volume)
        layout = layout_of(self.space, self.constitutive, True, True)
        counts = {name: m for name, _ in layout if name in ("stress", "internals", "deformation")}
        return self._make(self.count, layout, counts)

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivative of `state`: of its velocity, of the rest, or of all.

        The rate of the "rest" takes the deformation that the last rate of the velocity of the same `state` found. `ahead` =
        .5 evaluates a law that depends on stress half a step further (by its own rate), for methods that take the rest's
        rate at the middle of the step once.
        """
        if part != "rest":
            self._forces(state, out)
        if part != "velocity":
            self.clock.launch(self.kernels.drift, self.count, [state.struct], [out.struct])
            if not self.form.total:
                inputs = [self.clock.time, self.space.scalar(ahead), self.constitutive.params, *self._rows]
                inputs += [self._x, self._centre, self._moment, state.struct]
                self.clock.launch(self.kernels.flow, len(self.point_volume), inputs, [out.struct])

    @property
    def _rows(self) -> list[wp.array]:
        return [self._pairs.offsets, self._pairs.indices, self._weight]

    def refresh(self, state: State) -> None:
        """Deformation and, of a total law, stress of a state from its displacement (a launch)."""
        inputs = [
            self.constitutive.params,
            *self._rows,
            self._x,
            self._centre,
            self._moment,
            self._point_volume,
            state.struct,
        ]
        self.clock.launch(self.kernels.strain, len(self.point_volume), inputs, [self._mean, self._corrected])

    def _forces(self, state: State, out: State) -> None:
        self.refresh(state)
        if self.points:
            back = [self._back.offsets, self._back.indices, self._back_weight]
            inputs = [
                self.force.struct,
                self._stiffness,
                *back,
                self._x,
                self._centre,
                self._spread,
                self._point_volume,
            ]
            inputs += [self._mean, self._corrected, self._load_vectors, self._volume, state.struct]
            self.clock.launch(self.kernels.force, self.count, inputs, [out.struct])
            return
        inputs = [
            self.force.struct,
            self._stiffness,
            self._speed,
            self._h,
            self._alpha,
            self._beta,
            *self._rows,
            self._x,
        ]
        inputs += [self._moment, self._spread, self._volume, self._corrected, self._load_vectors, state.struct]
        self.clock.launch(self.kernels.force, self.count, inputs, [self._drag, out.struct])

    def combine(self, out: State, plain: list[tuple[float, State]], timed: list[tuple[float, State]] | None = None,
                squared: list[tuple[float, State]] | None = None, part: str = "all") -> None:  # fmt: skip
        """`out` = sum of c x over `plain` + dt times the sum of c k over `timed` + dt^2 c k of `squared`.

        Up to three states and rates, with one `squared` up to two rates; `out` may be one of them. `part` leaves the
        velocity ("rest") or all but it ("velocity") of `out` as it is.
        """
        timed, squared = timed or [], squared or []
        if not 1 <= len(plain) <= 3 or len(timed) + len(squared) > 3 or len(squared) > 1:
            counts = f"not {len(plain)}, {len(timed)} and {len(squared)}"
            raise ValueError(f"combine takes one to three states and up to three rates, one of them squared, {counts}")
        coefficients = [0.0] * 7
        for k, (c, _) in enumerate(plain):
            coefficients[k] = c
        for k, (c, _) in enumerate(timed):
            coefficients[3 + k] = c
        states = [x.buffer for _, x in plain] + [plain[0][1].buffer] * (3 - len(plain))
        rates = [x.buffer for _, x in timed] + [plain[0][1].buffer] * (3 - len(timed))
        if squared:
            coefficients[6], rates[2] = squared[0][0], squared[0][1].buffer
        split = self.count * self.space.dim
        start, end = {"all": (0, len(out.buffer)), "velocity": (0, split), "rest": (split, len(out.buffer))}[part]
        kernel = combine_kernel(self.space, len(plain), len(timed), len(squared))
        inputs = [self.clock.time, start, self.space.vector(7)(*coefficients), *states, *rates]
        self.clock.launch(kernel, end - start, inputs, [out.buffer])

    def impose(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed velocities of a state, and the loads for the rates to come, at t + c dt."""
        self.boundary.impose(state, self.clock, c)
        self.loads.impose(self._loads, self.clock, c)

    def constrain(self, state: State, c: float) -> None:
        """`impose` on the state that goes on from there, in the middle of a step: the work of it is counted too."""
        self.work.constraints.before(state, self.clock)
        self.impose(state, c)
        self.work.constraints.after(state, self.clock)

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt, the work of the constraints, loads, body forces and viscosity."""
        self.constrain(state, 1.0)
        self.work.loads.add(state, self.clock)
        self.force.add(state, self.clock)

    @property
    def _free(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        free = np.ones(self.count * self.space.dim)
        for (_, component), values in self.conditions.entries.items():
            free[[self.state.index("velocity", particle, component) for particle in values]] = 0.0
        return free

    @cached_property
    def frequency(self) -> float:
        """The largest frequency omega of the undamped body about its current state, nondimensional; an upper estimate.

        Lanczos on K w = -(a(u + eps w) - a(u))/eps, mass-weighted, prescribed components held: LANCZOS products, the
        largest Ritz value and its residual.
        """
        base, moved, change = self.state, self.new(), self.new()
        mass = np.sqrt(np.repeat(self.volume, self.space.dim))
        free = self._free
        split, eps = len(free), 1e-6 if self.space.precision == "f64" else 1e-2
        start = base.buffer.numpy().copy()
        place = base.start["displacement"]

        def accelerations(w: np.ndarray) -> np.ndarray:
            """a(u + eps w) with the velocities at rest."""
            shifted = start.astype(np.float64)
            if not self.form.total:
                # A rate law's stress follows the strain that the shift makes.
                moved.buffer.assign(np.concatenate([eps * w, start[split:]]).astype(self.space.numpy))
                self.rate(base, change, "velocity")
                wp.copy(moved.struct.deformation, base.struct.deformation)
                self.rate(moved, change, "rest")
                increment = change.buffer.numpy()
                a = base.start["stress"]
                b = a + base.counts["stress"] * base.widths["stress"]
                shifted[a:b] += increment[a:b] - resting[a:b]
            shifted[:split] = 0.0
            shifted[place : place + split] += eps * w
            moved.buffer.assign(shifted.astype(self.space.numpy))
            self.rate(moved, change, "velocity")
            return change.buffer.numpy()[:split].astype(np.float64)

        resting = np.zeros(len(start))
        if not self.form.total:
            moved.buffer.assign(np.concatenate([np.zeros(split), start[split:]]).astype(self.space.numpy))
            self.rate(moved, change, "velocity")
            self.rate(moved, change, "rest")
            resting = change.buffer.numpy().astype(np.float64)
        rest = accelerations(np.zeros(split))
        x = np.random.default_rng(0).standard_normal(split) * free
        basis, diagonal, beside = [x / np.linalg.norm(x)], [], []
        for _ in range(LANCZOS):
            w = -(accelerations(basis[-1] / mass) - rest) / eps * mass * free
            diagonal.append(float(w @ basis[-1]))
            for _ in range(2):
                for b in basis:
                    w -= (w @ b) * b
            beside.append(float(np.linalg.norm(w)))
            if not np.isfinite(beside[-1]):
                return np.inf
            if beside[-1] < 1e-12 * max(abs(diagonal[0]), 1e-300):
                break
            basis.append(w / beside[-1])
        n = len(diagonal)
        ritz = np.diag(diagonal) + np.diag(beside[: n - 1], 1) + np.diag(beside[: n - 1], -1)
        values, vectors = np.linalg.eigh(ritz)
        residual = beside[n - 1] * abs(vectors[-1, -1]) if n == LANCZOS else 0.0
        base.buffer.assign(start)
        return float(np.sqrt(max(values[-1] + residual, 0.0)))

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed anywhere."""
        return any(nonzero(value) for values in self.conditions.entries.values() for value in values.values())

    @property
    def bar_time(self) -> float:
        """The spacing over sqrt(E/rho), nondimensional: the time of the paper's Courant number."""
        return self.spacing / self.scales.length / float(self._speed)

    @cached_property
    def damping(self) -> float:
        """The largest damping rate nu of the viscosity about the current state, nondimensional.

        Power iteration on the drag of small velocities, switched as it is: 10 products, and 2 % for what they miss.
        """
        if not self.viscous:
            return 0.0
        moved, change = self.new(), self.new()
        start = self.state.buffer.numpy().copy()
        free = self._free
        split, growth = len(free), 0.0
        # Alternating from particle to particle: the mode that pairs damp most; the switch passes half of its pairs.
        at = self.lattice.index if self._at_nodes else self.lattice.index[self.lattice.corners].mean(1) - 0.5
        index = np.rint(at).sum(1)
        x = np.repeat((-1.0) ** index, self.space.dim) * free
        for _ in range(10):
            x /= np.linalg.norm(x)
            state = start.astype(np.float64)
            state[:split] = 1e-9 * x
            moved.buffer.assign(state.astype(self.space.numpy))
            self.rate(moved, change, "velocity")
            x = -self._drag.numpy().reshape(-1)[:split].astype(np.float64) / 1e-9 * free
            growth = float(np.linalg.norm(x))
            if growth == 0.0:
                return 0.0
        self.state.buffer.assign(start)
        return 1.02 * growth

    def courant(self, product: float) -> float:
        """The Courant number at which omega dt = `product` for the fastest mode."""
        if self.frequency == 0.0:
            return np.inf
        dt = product / self.frequency
        return dt * self.scales.time * self.constitutive.wave_speed / self.spacing

    def spectral_radius(self) -> float:
        """Largest frequency times the spacing over the wave speed: a Courant number C is omega dt = C times this."""
        return self.frequency * self.spacing / (self.constitutive.wave_speed * self.scales.time)

    def hourglass_energy(self) -> float:
        """Energy of the residual, nondimensional (two launches and a copy)."""
        if not self.form.residual:
            return 0.0
        self.refresh(self.state)
        sums = wp.zeros(-(-len(self.point_volume) // BLOCK), dtype=wp.float64, device=self.device)
        inputs = [
            len(self.point_volume),
            self._stiffness,
            *self._rows,
            self._x,
            self._centre,
            self._spread,
            self._point_volume,
        ]
        wp.launch(
            self.kernels.residual,
            len(sums),
            inputs=[*inputs, self._mean, self.state.struct],
            outputs=[sums],
            device=self.device,
        )
        return float(sums.numpy().sum())

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, at the nodes, (n, width), nondimensional."""
        values = self.state.read(name)
        return average(self._outwards, values) if self.points and self.state.counts[name] != self.count else values

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional."""
        F = np.eye(self.space.dim) + self.filtered("deformation").reshape(-1, self.space.dim, self.space.dim)
        return self.density / np.linalg.det(F)

    @cached_property
    def _outwards(self) -> Weights:
        return outward_weights(self.lattice, 1.2)

    def sample(self, points: np.ndarray, name: str = "velocity") -> list[tuple[np.ndarray, np.ndarray]]:
        """How to read a field at `points` (m, dim) [m]: its places and weights per point, linear-exact."""
        at_nodes = self._at_nodes and self.state.counts.get(name, self.count) == self.count
        index = self.lattice.index
        sources = index if at_nodes else index[self.lattice.corners].mean(1)
        grid = self.lattice.frame.coordinates(points)
        weights = spanning_weights(self.lattice, 1.6, (grid, sources), (grid, sources), np.ones(len(sources)))
        offsets, indices, values = (a.numpy() for a in (weights.pairs.offsets, weights.pairs.indices, weights.values))
        rows = [(indices[a:b], values[a:b]) for a, b in pairwise(offsets)]
        # A point that is a particle reads that particle.
        for n, (there, _) in enumerate(rows):
            on = there[np.linalg.norm(sources[there] - grid[n], axis=1) < 1e-6]
            if len(on):
                rows[n] = (on[:1], np.ones(1))
        return rows

    @property
    def nbytes(self) -> int:
        """Device memory of the body [bytes]: pairs, weights and all states, the integrator's too."""
        own = [self._weight, self._moment, self._spread, self._x, self._corrected, self._mean, self._volume, self._drag]
        if self.points:
            own += [self._centre, self._back.offsets, self._back.indices, self._back_weight, self._point_volume]
        return self._pairs.nbytes + sum(a.capacity for a in own) + self.state_bytes


LANCZOS = 20
"""Products of Lanczos' method for the largest frequency."""


class OneSetSystem(LagrangianSystem):
    """Every particle its own stress point: total-Lagrangian SPH."""

    formulation = "total-lagrangian"


class StressPointSystem(LagrangianSystem):
    """Nodes on the lattice and its faces, stresses at the cell centres."""

    formulation = "stress-points"
    points = True
    splits = True
    default_support = 1.8
    default_residual = 0.6


class _Works:
    """External work of a Lagrangian body: constraints and loads."""

    def __init__(self, constraints: ConstraintWork, loads: LoadWork):
        self.constraints, self.loads = constraints, loads

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        self.constraints.start(state, clock)
        self.loads.start(state, clock)

    @property
    def total(self) -> float:
        """Work of constraints and loads so far, nondimensional."""
        return self.constraints.total + self.loads.total
