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
  2016, eq 13 with eq 3) and surrounds a bar with ghosts (`wsph.formulations.lagrangian.ghosts`), as the paper does; it is
  there to compare with.

H follows from the displacements in every evaluation: nothing drifts, and single precision keeps the digits of small strains.
Forces between pairs beside the stress (`wsph.parts.pair_forces`) are parts of the one-set form; hourglass control takes the
residual's place there unless both are named. Viscosity is a stress at stress points, added to P above.
"""

from functools import cached_property
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.errors import Refused
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.ghosts import Ghosts, ghost_kernels, ghosts
from wsph.formulations.lagrangian.held_energy import BLOCK
from wsph.formulations.lagrangian.kernels import kernels
from wsph.formulations.lagrangian.weights import QUANTA, set_up_kernel
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.setup import Setup, Traits
from wsph.geometry.selection import select
from wsph.parts.links import LinkDamage, stretch_of_energy
from wsph.parts.phase_field.field import PhaseDamage, Sight
from wsph.plugins.blame import blame
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.sph.averages import average, outward_weights, unparted
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.smoothing import SUPPORT
from wsph.sph.weights import Weights


class LagrangianSystem(OneSetSystem):
    """A body whose pairs and weights are those of the reference configuration."""

    def __init__(self, setup: Setup):
        super().__init__(setup)
        scene, body, lattice = setup.scene, setup.body, setup.lattice
        space, constitutive, device = setup.space, setup.constitutive, setup.device
        laws = constitutive.laws
        nodes, cells = lattice.centred
        places = nodes if self.at_nodes else cells
        self._set_up(scene, places, cells if self.points else places)
        # Ghosts hand a load on.
        loaded = self.loads.count > 0 and self._ghosts is None
        self._stiffness = space.scalar(self.residual)
        paper = scene.run.correction == "paper"
        self.form = Form(
            self.points,
            laws.total is not None,
            self.residual > 0.0,
            loaded,
            paper,
            self.parts,
            damage=self.damage_model,
        )
        with blame(constitutive.who):
            self.kernels = kernels(space, laws, self.state.layout, self.force.parts, self.form, scene.run.kernel)
        m = len(self.point_volume)
        averaged = self.points and (self.form.residual or bool(self.damage_model))
        self._mean = wp.zeros(m if averaged else 1, dtype=space.vec, device=device)
        seen = len(self._x)  # particles, and ghosts
        self._corrected = wp.zeros(m if self._ghosts is None else seen, dtype=space.mat, device=device)
        self._opposing = wp.zeros(m if self.parts.artificial else 1, dtype=space.mat, device=device)
        self._dragging = wp.zeros(m if self.points and self.viscous else 1, dtype=space.mat, device=device)
        self._volume = wp.array(self.volume, dtype=space.scalar, device=device)
        self._point_volume = self._volume
        if self.points:
            self._point_volume = wp.array(self.point_volume, dtype=space.scalar, device=device)
        # Volume over the spread of the neighbours: what residual, viscosity and hourglass control of a pair are measured by.
        shared = self.form.residual or self.viscous or self.parts.hourglass or self.damage_model
        share = self.point_volume / self._spread if shared else np.zeros(1)
        self._share = wp.array(share, dtype=space.scalar, device=device)
        self._set_up_damage(body)
        if self._ghosts is not None:
            self._set_up_ghosts(self._ghosts)

    def _coefficients(self, scene: Scene, body: Body) -> None:
        if not self.points and self.at_nodes:
            self.default_residual = 0.3
        if self.damage_model:
            # Enough to hold spurious modes; more is stiffness that a crack has to release beside the material's.
            self.default_residual = 0.1
        if self.constitutive.laws.dissipates:
            # It stays elastic where the material flows: a plastic hinge would spring back.
            self.default_residual = 0.03
        super()._coefficients(scene, body)

    def _set_up(self, scene: Scene, nodes: np.ndarray, points: np.ndarray) -> None:
        """Pairs, weights, means and moments, in double precision whatever the run's."""
        lattice, space, device = self.lattice, self.space, self.device
        reach = np.full(len(points), self._support)
        self._ghosts: Ghosts | None = None
        if scene.run.correction == "paper":
            self._refuse_for_paper()
            if space.dim == 1:
                self._ghosts = ghosts(lattice, self.conditions, self._support)
                nodes = np.concatenate([nodes, self._ghosts.place])
        frame = lattice.frame
        factor = frame.step / self.scales.length
        position = nodes * np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor) @ frame.axes.T
        if lattice.mapped:
            position = (self.position - self.position.mean(0)) / self.scales.length
        # In cells of the lattice, so that moments of cells of any aspect can be inverted; then in the body's own lengths.
        stretch = frame.axes * np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor)
        grid = position if lattice.mapped else nodes
        sided_nodes, sided_cells = lattice.sided if lattice.cracks else (nodes, points)
        sided = (
            sided_cells if self.points or not self.at_nodes else sided_nodes,
            sided_nodes if self.at_nodes else sided_cells,
        )
        double = Space(space.dim)
        while True:
            pairs = unparted(find_pairs(points, nodes, reach, device, same=not self.points), lattice, *sided)
            weight = wp.zeros(pairs.count, dtype=wp.float64, device=device)
            centre = wp.zeros(len(points), dtype=double.vec, device=device)
            moment = wp.zeros(len(points), dtype=double.mat, device=device)
            spread = wp.zeros(len(points), dtype=wp.float64, device=device)
            rank = wp.zeros(len(points), dtype=wp.int32, device=device)
            quantum = QUANTA["f64" if self.irregular else space.precision]
            inputs = [wp.float64(self._support / SUPPORT), wp.float64(quantum), pairs.offsets, pairs.indices]
            inputs += [wp.array(a, dtype=double.vec, device=device) for a in (points, nodes, grid)]
            kernel = set_up_kernel(double, scene.run.kernel, self.points)
            wp.launch(kernel, len(points), device=device, inputs=inputs, outputs=[weight, centre, moment, spread, rank])
            lonely = np.flatnonzero(rank.numpy() < space.dim)
            # A point of a shape's odd corner may need to see further.
            if not len(lonely) or not self.points or reach.max() > 2.0 * self._support:
                break
            reach[lonely] *= 1.5
        alone = rank.numpy() < space.dim
        if self.damage_model != "links":
            self.refuse_lonely(rank.numpy())
        moments, spreads, centres = moment.numpy(), spread.numpy(), centre.numpy()
        if not lattice.mapped:
            back = np.linalg.inv(stretch)
            if not (stretch == frame.axes).all():
                whole = np.linalg.inv(np.where(alone[:, None, None], np.eye(space.dim), moments))
                spreads = np.einsum("ki,nij,kj->n", stretch, whole, stretch)
            moments, centres = back.T @ moments @ back, centres @ stretch.T
            moments = 0.5 * (moments + moments.transpose(0, 2, 1))
        self._pairs = pairs
        self._x = wp.array(position, dtype=space.vec, device=device)
        self._centre = wp.array(centres, dtype=space.vec, device=device) if self.points else self._x
        self._weight = wp.array(weight.numpy(), dtype=space.scalar, device=device)
        # With links, what has too few from the start (a corner of a turned lattice) is free from the start.
        moments[alone] = 0.0
        spreads[alone] = np.inf
        self._moment = wp.array(moments, dtype=space.mat, device=device)
        self._spread = spreads
        if self.points:
            self._back, order = pairs.transposed()
            self._back_weight = wp.array(weight.numpy()[order], dtype=space.scalar, device=device)

    def _refuse_for_paper(self) -> None:
        """What the paper's form is not made for."""
        residual = self.residual > 0.0 or self.parts.hourglass or self.parts.artificial
        if self.points or self.at_nodes or residual:
            text = 'run.correction = "paper" is of the total-lagrangian form with particles in the cells, without residual,'
            raise Refused(f"body {self.name!r}: {text} hourglass and artificial_stress")
        if self.space.dim > 1 and self.loads.count:
            raise Refused(
                f'body {self.name!r}: with run.correction = "paper" a face feels half of its load, because L_i on both sides keeps no'
                " momentum at a boundary, and only bars have ghosts that hand it on; use the symmetric correction"
            )
        if self.moved and self.space.dim == 1:
            raise Refused(
                f'body {self.name!r}: run.correction = "paper" takes ends that are loaded or held: the work of ghosts beyond an end'
                " that is moved is on no ledger; use the symmetric correction"
            )
        if self.lattice.mapped:
            raise Refused(f'body {self.name!r}: run.correction = "paper" needs a regular lattice, without `map`')
        if self.lattice.cracks and self.space.dim == 1:
            raise Refused(
                f'body {self.name!r}: run.correction = "paper" surrounds a bar with ghosts; it cannot be cracked'
            )

    def _set_up_damage(self, body: Body) -> None:
        space, scales, device, state = self.space, self.scales, self.device, self.state
        if body.phase_field is not None:
            back = (self._back, self._back_weight) if self.points else ()
            sight = Sight(self._pairs, self._weight, self._spread, self._x, self._centre, self._mean, *back)
            self.damage = PhaseDamage(body.phase_field, space, scales, sight, self._share, self.point_volume, state,
                                      self.residual, device)  # fmt: skip
            self._phase = self.damage.struct
        if body.links is not None:
            part, spacing = body.links, self.spacing
            may = np.ones(self.count, bool) if part.where is None else select(part.where, self.position, spacing)
            if part.fracture_energy is not None:
                threshold = stretch_of_energy(part.fracture_energy, self.youngs, spacing)
            else:
                threshold = part.limit / (scales.stress if part.criterion == "principal-stress" else 1.0)
            self.damage = LinkDamage(part, space, self.constitutive.laws, self.constitutive.params, state, self._pairs,
                                     self._weight, self._moment, self._share, self._x, self.volume, may, threshold, self.residual, device)  # fmt: skip

    def _set_up_ghosts(self, g: Ghosts) -> None:
        """What ghosts have of their sources: moments, spreads, volumes; and the kernels that move them."""
        space, device = self.space, self.device
        everyone = np.concatenate([np.arange(self.count), g.source])
        for name in ("_moment", "_volume", *(["_share"] if self.viscous else [])):
            array = getattr(self, name)
            setattr(self, name, wp.array(array.numpy()[everyone], dtype=array.dtype, device=device))
        self._images = [wp.array(a, dtype=wp.int32, device=device) for a in (g.source, g.face, g.held)]
        self._sign = wp.array(g.sign, dtype=wp.int32, device=device)
        self._step = space.scalar(self.spacing / self.scales.length)
        counts = {name: 1 for name in self.state.widths if name not in ("velocity", "displacement")}
        self._everyone = State(space, len(everyone), self.state.layout, device, counts)
        self._move, self._mirror = ghost_kernels(space, self.state.layout)

    def _others(self, state: State) -> Any:
        """What particles see of each other: the state, or that of particles and ghosts (a launch)."""
        if self._ghosts is None:
            return state.struct
        inputs = [self.count, *self._images, state.struct]
        self.clock.launch(self._move, self._everyone.n, inputs, [self._everyone.struct])
        return self._everyone.struct

    @property
    def pairs(self) -> int:
        """Directed pairs, from points to nodes and back."""
        return self._pairs.count * (2 if self.points else 1)

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes the deformation."""
        if part != "rest":
            self._forces(state, out)
        if part != "velocity":
            self.clock.launch(self.kernels.drift, self.count, [state.struct], [out.struct])
            if not self.form.total:
                inputs = [self.clock.time, self.space.scalar(ahead), self.constitutive.params, self.pair, *self._rows]
                inputs += [self._x, self._centre, self._moment, state.struct, self._others(state)]
                self.clock.launch(self.kernels.flow, len(self.point_volume), inputs, [out.struct])

    @property
    def neighbours(self) -> Pairs:
        return self._joined if self.points else self._pairs

    @cached_property
    def _joined(self) -> Pairs:
        """The nodes that a point sees together."""
        there, nodes = self._pairs.offsets.numpy(), self._pairs.indices.numpy()
        many = np.diff(there)[self._back.indices.numpy()]
        first = np.repeat(self._back.rows(), many)
        within = np.arange(len(first)) - np.repeat(np.cumsum(many) - many, many)
        second = nodes[np.repeat(there[self._back.indices.numpy()], many) + within]
        keys = np.unique(first.astype(np.int64)[first != second] * self.count + second[first != second])
        offsets = np.concatenate([[0], np.cumsum(np.bincount(keys // self.count, minlength=self.count))])
        arrays = (wp.array(a, dtype=wp.int32, device=self.device) for a in (offsets, keys % self.count))
        return Pairs(*arrays, self.count, self.count, self._back.reach)

    @property
    def _acting_share(self) -> wp.array:
        """Shares, of broken particles what is left of them."""
        return self.damage.struct.share if isinstance(self.damage, PhaseDamage) else self._share

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
            self._share,
            self._stiffness,
            self.space.scalar(self.density),
            self.pair,
            self._phase,
            state.struct,
            self._others(state),
        ]
        outputs = [self._mean, self._corrected, self._opposing, self._dragging]
        self.clock.launch(self.kernels.strain, len(self.point_volume), inputs, outputs)
        if self._ghosts is not None:
            inputs = [self.count, *self._images, self._sign, self._step, self._load_vectors]
            self.clock.launch(self._mirror, len(self._ghosts.source), inputs, [self._corrected])

    def _forces(self, state: State, out: State) -> None:
        self.refresh(state)
        if self.points:
            inputs = [
                self.force.struct,
                self._back.offsets,
                self._back.indices,
                self._back_weight,
                self._x,
                self._centre,
            ]
            inputs += [
                self._acting_share,
                self._stiffness,
                self._mean,
                self._corrected,
                self._dragging,
                self._load_vectors,
                self._volume,
                state.struct,
            ]
            self.clock.launch(self.kernels.force, self.count, inputs, [out.struct])
            return
        others = state.struct if self._ghosts is None else self._everyone.struct
        inputs = [self.force.struct, self.pair, *self._rows, self._x, self._moment, self._acting_share, self._volume]
        inputs += [self._stiffness, self._corrected, self._opposing, self._load_vectors, state.struct, others]
        self.clock.launch(self.kernels.force, self.count, inputs, [self._hold, out.struct])

    def hourglass_energy(self) -> float:
        """Energy of the residual, of a state that is up to date, and work against the other holding forces, nondimensional
        (a launch and a copy)."""
        held = super().hourglass_energy()
        if not self.form.residual:
            return held
        sums = wp.zeros(-(-len(self.point_volume) // BLOCK), dtype=wp.float64, device=self.device)
        inputs = [
            len(self.point_volume),
            *self._rows,
            self._x,
            self._centre,
            self._acting_share,
            self._stiffness,
            self._mean,
            self.state.struct,
        ]
        wp.launch(self.kernels.residual, len(sums), inputs=inputs, outputs=[sums], device=self.device)
        return held + float(sums.numpy().sum())

    @property
    def fracture_energy(self) -> float:
        """Elastic energy that damage has set free so far, nondimensional."""
        return self.damage.released if self.damage is not None else 0.0

    def fracture(self) -> dict[str, float]:
        return self.damage.found() if self.damage is not None else {}

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, at the nodes, (n, width), nondimensional."""
        values = self.state.read(name)
        return average(self._outwards, values) if self.points and self.state.counts[name] != self.count else values

    @cached_property
    def _outwards(self) -> Weights:
        return outward_weights(self.lattice, 1.2)

    @property
    def nbytes(self) -> int:
        """Device memory of the body [bytes]: pairs, weights and all states, the integrator's too."""
        own = [self._weight, self._moment, self._share, self._x, self._corrected, self._mean, self._volume]
        own += [self._hold, self.work.loads.before, self._opposing, self._dragging]
        if self.points:
            own += [self._centre, self._back.offsets, self._back.indices, self._back_weight, self._point_volume]
        damage = self.damage.nbytes if self.damage is not None else 0
        return self._pairs.nbytes + sum(a.capacity for a in own) + damage + self.state_bytes


class TotalLagrangianSystem(LagrangianSystem):
    """Every particle its own stress point: total-Lagrangian SPH."""

    formulation = "total-lagrangian"
    traits = Traits(
        takes=("viscosity", "residual", "hourglass", "artificial_stress", "phase_field", "links"),
        maps=True,
        measures=True,
        pushable=True,
    )


class StressPointSystem(LagrangianSystem):
    """Nodes on the lattice and its faces, stresses at the cell centres."""

    formulation = "stress-points"
    traits = Traits(
        takes=("viscosity", "residual", "phase_field"), maps=True, splits_cracks=True, measures=True, pushable=True
    )
    points = True
    default_support = 1.8
    default_residual = 0.6
