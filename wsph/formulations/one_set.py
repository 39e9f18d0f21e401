"""What one-set integrators see of a body: `rate`, `combine`, `drift`, `impose`, `constrain`, `accept` over one flat state.

The forms that give the rates are in `wsph.formulations.lagrangian` and `wsph.formulations.updated`. Time steps are limited
by what `wsph.stability.krylov` finds of the right-hand sides.
"""

from functools import cached_property
from itertools import pairwise

import numpy as np
import warp as wp

from wsph.backend.algebra import combine
from wsph.backend.clock import Clock
from wsph.backend.state import Derived, State
from wsph.boundary.conditions import Conditions, nonzero
from wsph.boundary.natural import layer_conditions, node_conditions
from wsph.boundary.values import BoundaryValues
from wsph.boundary.work import ConstraintWork, LoadWork
from wsph.errors import Refused
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.layout import layout_of
from wsph.formulations.setup import Setup
from wsph.formulations.system import System
from wsph.parts.body_force import BodyForce
from wsph.parts.links import SUPPORT as NEAREST
from wsph.parts.links import LinkDamage
from wsph.parts.pair_forces import pair_struct, parts_of
from wsph.parts.phase_field.field import PhaseDamage
from wsph.parts.phase_field.response import phase_struct
from wsph.scene.scene import Scene
from wsph.scene.tables import Body, damage_model
from wsph.sph.averages import spanning_weights
from wsph.sph.pairs import Pairs
from wsph.sph.smoothing import SMOOTHING, SUPPORT
from wsph.stability.krylov import spectrum
from wsph.stability.spectrum import Spectrum

FRACTURE = ("damage", "damaged_stress")


class OneSetSystem(System):
    """A body as one-set integrators see it. A formulation sets up its pairs and gives `rate` and `refresh`."""

    points = False
    """Whether stresses live at places of their own, apart from the particles."""
    derived: tuple[str, ...] = ("deformation",)
    """Fields, beside the stress of a total law, that a rate of the velocity finds from the others: of the state that it was
    last asked of."""
    default_support = 2.6
    default_residual = 1.0
    form: Form
    damage: PhaseDamage | LinkDamage | None = None
    _pairs: Pairs

    def __init__(self, setup: Setup):
        super().__init__(setup)
        scene, body, lattice = setup.scene, setup.body, setup.lattice
        space, scales, device = setup.space, setup.scales, setup.device
        self.name = body.name
        self._derived: Derived | None = None
        unit = scales.length**space.dim
        self.at_nodes = self.points or body.placement == "nodes"
        self.position = lattice.nodes if self.at_nodes else lattice.cells
        self.volume = (lattice.node_volume if self.at_nodes else lattice.cell_volume) / unit
        self._cells = lattice.cell_volume / unit
        self._support = scene.run.support or (self.default_support if body.links is None else NEAREST)
        self.damage_model = damage_model(body)
        self._coefficients(scene, body)
        conditions = node_conditions if self.at_nodes else layer_conditions
        self.conditions: Conditions = conditions(scene, body.name, lattice)
        self.state = self.new()
        units = {"velocity": scales.velocity}
        self.boundary = BoundaryValues(space, self.conditions, self.state, self.position, units, scales.time, device)
        # Ghosts ask every face for its load.
        loaded = scene.run.correction == "paper" or (
            self.conditions.loads is not None and bool(self.conditions.loads.entries)
        )
        self._phase = phase_struct(space)()
        self._loads = State(space, self.count if loaded else 1, (("load", space.dim**2),), device)
        unit_force = scales.stress * scales.length ** (space.dim - 1)
        self.loads = BoundaryValues(
            space, self.conditions.loads, self._loads, self.position, {"load": unit_force}, scales.time, device
        )
        self._load_vectors = wp.array(
            ptr=self._loads.buffer.ptr, dtype=space.vec, shape=self._loads.n * space.dim, device=device, copy=False
        )
        self.force = BodyForce(scene.gravity, body.damping, space, scales, self.density, self.volume, device)
        self._hold = self._vectors(self.parts.holding)
        mass = self.density * self.volume
        self.work = _Works(
            ConstraintWork(space, self.boundary, mass, device),
            LoadWork(space, self.loads, self.state, self._loads, self._hold if self.parts.holding else None, mass, device),
        )  # fmt: skip

    def _vectors(self, used: bool) -> wp.array:
        return wp.zeros(self.count if used else 1, dtype=self.space.vec, device=self.device)

    def _coefficients(self, scene: Scene, body: Body) -> None:
        """What acts between pairs, and the stiffness of the residual, nondimensional."""
        real, scales, material = self.space.scalar, self.scales, self.constitutive.material
        bulk, shear = material.moduli()
        self.youngs = 9.0 * bulk * shear / (3.0 * bulk + shear)
        self.parts = parts_of(body, scene.run.correction)
        if self.parts.own and self.points and scene.run.correction != "paper":
            raise Refused(
                f'body {body.name!r}: viscosity.correction = "paper" is of pairs of particles; stress points have viscosity as a'
                " stress: leave it out"
            )
        self.viscous = bool(self.parts.viscosity)
        self.pair = pair_struct(self.space)()
        # The paper's own c, not the one of the stress state: sqrt(E/rho).
        self.pair.speed = real(np.sqrt(self.youngs / material.density) / scales.velocity)
        self.pair.h = real(self._support / SUPPORT * self.spacing / scales.length)
        if body.viscosity is not None:
            self.pair.alpha, self.pair.beta = real(body.viscosity.alpha), real(body.viscosity.beta)
        if body.hourglass is not None:
            self.pair.spring = real(0.25 * body.hourglass.coefficient * self.youngs / scales.stress)
        if body.artificial_stress is not None:
            self.pair.epsilon = real(body.artificial_stress.epsilon)
            self.pair.exponent = real(body.artificial_stress.exponent)
            value = SMOOTHING[scene.run.kernel](self.space)[0]
            self.pair.at_spacing = real(value(real(SUPPORT / self._support)))
        bare = body.hourglass is not None or scene.run.correction == "paper"
        usual = 0.0 if bare else self.default_residual
        residual = usual if body.residual is None else body.residual.coefficient
        self.residual = residual * self.youngs / scales.stress

    def new(self) -> State:
        """A state, zero but for the internals' initial values."""
        state = self.temporary()
        self._states.append(state)
        return state

    def temporary(self) -> State:
        """A state that lives as long as who asks for it, not as long as the body."""
        m = len(self.point_volume)
        layout = layout_of(self.space, self.constitutive, True, True, damage=self.damage_model, drag=self.viscous)
        counts = {name: m for name, _ in layout if name in ("stress", "internals", "deformation", *FRACTURE)}
        if self._derived is None:
            names = (*self.derived, *FRACTURE) + (("stress",) if self.constitutive.laws.total is not None else ())
            shared = tuple((name, width) for name, width in layout if name in names)
            self._derived = Derived(self.space, shared, m, self.device)
        state = State(self.space, self.count, layout, self.device, counts, self._derived)
        self._initial_internals(state)
        return state

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivative of `state`: of its velocity, of the rest, or of all.

        The rate of the "rest" takes what the last rate of the velocity of the same `state` found. `ahead` = .5 evaluates a
        law that depends on stress half a step further (by its own rate), for methods that take the rest's rate at the
        middle of the step once.
        """
        raise NotImplementedError

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
        span = {"all": (0, len(out.buffer)), "velocity": (0, out.split), "rest": (out.split, len(out.buffer))}[part]
        terms = [[(c, x.buffer) for c, x in each] for each in (plain, timed, squared)]
        combine(self.space, self.clock, *terms, span, out.buffer)

    def drift(self, state: State, k: State, c: float, ahead: float = 0.0) -> None:
        """All of `state` but its velocity goes on by c dt: `rate` and `combine`, `ahead` as there, in one launch where only
        displacements do. What `k` holds of the rest after it is undefined."""
        if state.start.keys() - {"drag"} != {"velocity", "displacement"}:
            self.rate(state, k, "rest", ahead)
            self.combine(state, plain=[(1.0, state)], timed=[(c, k)], part="rest")
            return
        u, v = state.flat("displacement"), state.flat("velocity")
        combine(self.space, self.clock, [(1.0, u)], [(c, v)], [], (0, len(u)), u)

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
        """Close the step: the stresses that the law allows, the prescribed values at t + dt, the work of the constraints,
        loads, body forces and viscosity."""
        self.project(state)
        self.constrain(state, 1.0)
        self.work.loads.add(state, self.clock)
        self.force.add(state, self.clock)
        if self.damage is not None:
            self.damage.advance(self.clock)

    def kept(self) -> dict[str, wp.array]:
        damage = self.damage.kept() if self.damage is not None else {}
        return super().kept() | {"imposed loads": self._loads.buffer} | damage

    def clear_scratch(self) -> None:
        super().clear_scratch()
        if self.damage is not None:
            self.damage.clear()

    def restored(self) -> None:
        if isinstance(self.damage, PhaseDamage):
            self.damage.restored(self.clock)
        self.refresh(self.state)

    @property
    def neighbours(self) -> Pairs:
        """The particles that each is joined to."""
        return self._pairs

    @property
    def _rows(self) -> list[wp.array]:
        """Offsets, indices and weights of the pairs, as kernels take them."""
        raise NotImplementedError

    @property
    def link_weights(self) -> wp.array:
        """Weights of the `neighbours`, zero where a link has broken; without links nobody asks."""
        return self._rows[2]

    @property
    def point_volume(self) -> np.ndarray:
        return self._cells if self.points else self.volume

    @property
    def drag_energy(self) -> float:
        return self.work.loads.viscous

    def hourglass_energy(self) -> float:
        """Work done against hourglass control and artificial stress so far, nondimensional."""
        return self.work.loads.held

    @property
    def free_components(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        free = np.ones(self.count * self.space.dim)
        for (_, component), values in self.conditions.entries.items():
            free[[self.state.index("velocity", particle, component) for particle in values]] = 0.0
        return free

    @property
    def grid_index(self) -> np.ndarray:
        """Where the particles stand in the grid, in cells, (n, dim)."""
        index = self.lattice.index
        return index if self.at_nodes else index[self.lattice.corners].mean(1) - 0.5

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed anywhere."""
        return any(nonzero(value) for values in self.conditions.entries.values() for value in values.values())

    @property
    def irregular(self) -> bool:
        """Whether its cells differ in size: by jitter or a map."""
        index = self.lattice.index
        return self.lattice.mapped or bool((index != np.rint(index)).any())

    @property
    def bar_time(self) -> float:
        """The spacing over sqrt(E/rho), nondimensional: the time of the paper's Courant number."""
        return self.spacing / self.scales.length / float(self.pair.speed)

    @cached_property
    def _spectrum(self) -> Spectrum:
        return spectrum(self)

    @property
    def frequency(self) -> float:
        """The largest frequency about the state in which it was first asked for since `measure_anew`, nondimensional."""
        return self._spectrum.frequency

    @property
    def growth(self) -> float:
        """The largest growth rate of a mode that does not oscillate, about the same state, nondimensional. Where pairs
        follow the motion it is that of particles that clump together under tension."""
        return self._spectrum.growth

    @property
    def damped(self) -> bool:
        """Whether small motions are damped: by viscosity, or in proportion to mass."""
        return self.viscous or self.force.parts.damped

    @property
    def _shares(self) -> tuple[float, ...]:
        """Shares of the viscosity that may act at once. Several where it is switched by the motion or does not see all of
        it: a time step has to suit each."""
        shares = self._spectrum.approach() if self.parts.viscosity == "approach" else (1.0,)
        return (0.0, *shares) if self.points and self.viscous else shares  # gradients of points do not see all

    @property
    def modes(self) -> np.ndarray:
        """lambda of the small motions exp(lambda t) about the same state, (k,) complex, nondimensional: the outermost of
        them and some tens of others, without those of the rigid body."""
        return self._spectrum.modes(self._shares)

    def largest(self, dt: float, factor: float) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D, stiffness and damping of the small motions about the same state,
        an upper estimate; `dt` nondimensional."""
        return self._spectrum.largest(dt, factor, self._shares)

    def measure_anew(self) -> None:
        """Forget the spectrum: the next question finds that of the current state."""
        self.__dict__.pop("_spectrum", None)

    def courant(self, product: float) -> float:
        """The Courant number at which omega dt = `product` for the fastest mode."""
        if self.frequency == 0.0:
            return np.inf
        dt = product / self.frequency
        return dt * self.scales.time * self.constitutive.wave_speed / self.spacing

    def spectral_radius(self) -> float:
        """Largest frequency times the spacing over the wave speed: a Courant number C is omega dt = C times this."""
        return self.frequency * self.spacing / (self.constitutive.wave_speed * self.scales.time)

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional."""
        F = np.eye(self.space.dim) + self.filtered("deformation").reshape(-1, self.space.dim, self.space.dim)
        return self.density / np.linalg.det(F)

    def sample(self, points: np.ndarray, name: str = "velocity") -> list[tuple[np.ndarray, np.ndarray]]:
        """How to read a field at `points` (m, dim) [m]: its places and weights per point, linear-exact."""
        at_nodes = self.at_nodes and self.state.counts.get(name, self.count) == self.count
        lattice = self.lattice
        grid, sources = lattice.comparable(points, lattice.nodes if at_nodes else lattice.cells)
        weights = spanning_weights(self.lattice, 1.6, (grid, sources), (grid, sources), np.ones(len(sources)))
        offsets, indices, values = (a.numpy() for a in (weights.pairs.offsets, weights.pairs.indices, weights.values))
        rows = [(indices[a:b], values[a:b]) for a, b in pairwise(offsets)]
        # A point that is a particle reads that particle.
        for n, (there, _) in enumerate(rows):
            on = there[np.linalg.norm(sources[there] - grid[n], axis=1) < 1e-6]
            if len(on):
                rows[n] = (on[:1], np.ones(1))
        return rows

    def refuse_lonely(self, rank: np.ndarray) -> None:
        """Refuse particles whose neighbours, spanning `rank` (m,) directions, give no gradient."""
        lonely = np.flatnonzero(rank < self.space.dim)
        if len(lonely):
            raise Refused(
                f"{len(lonely)} particles of body {self.name!r}, the first at {self.position[lonely[0]].tolist()} m, see too few"
                f" neighbours for a gradient: raise run.support (now {self._support:g} spacings)"
            )


class _Works:
    """External work of a one-set body: constraints and loads."""

    def __init__(self, constraints: ConstraintWork, loads: LoadWork):
        self.constraints, self.loads = constraints, loads

    def kept(self) -> dict[str, wp.array]:
        """What a checkpoint holds of them."""
        parts = {"constraints": self.constraints.kept(), "loads": self.loads.kept()}
        return {f"{part}.{name}": array for part, arrays in parts.items() for name, array in arrays.items()}

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        self.constraints.start(state, clock)
        self.loads.start(state, clock)

    @property
    def total(self) -> float:
        """Work of constraints and loads so far, nondimensional."""
        return self.constraints.total + self.loads.total
