"""Right-hand sides of one set in the current configuration: pairs, weights and gradients of where the particles are.

A particle i sees j with r = x_j - x_i and w = |W'(r)|/r, h as at the start:

    M_i = (sum w r (x) r)^-1,   L_i = sum w (v_j - v_i) (x) r M_i,   dF/dt = L F,   rho = rho_0/J
    f_i = sum_j w (V_i sigma_i M_i + V_j sigma_j M_j) r,   V = J V_0

The force is the dual of the gradient: linear and angular momentum are kept to rounding, and the forces do the work of the
stresses. J from F is the equation of continuity. What the gradient does not see is remembered
(`wsph.formulations.updated.memory`). Under tension such a kernel clumps (tensile instability, from a stretch of about 1.3),
which artificial stress delays; the Lagrangian kernels (`wsph.formulations.lagrangian`) do not. Use it for bodies that lose
their reference configuration; for solids that hold together the Lagrangian forms are more accurate, faster and stable.

Pairs are kept with a skin. They are found again when a particle has moved by half of the skin, or can have by the end of the
step: on the host before a step, so that steps are captured one by one. Pairs in the skin have the weight zero and rows
ascend, so that the step at which pairs are rebuilt does not change the sums.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.domain import any_of
from wsph.backend.reduce import blocks, total
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.errors import Refused
from wsph.formulations.lagrangian.flow import drift_kernel, flow_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.updated.cutting import Cut
from wsph.formulations.updated.forces import force_now_kernel
from wsph.formulations.updated.gradient import velocity_gradient_ahead
from wsph.formulations.updated.images import find_images, kinds_of, shifts_of
from wsph.formulations.updated.memory import memory_struct, remembered_energy_kernel
from wsph.formulations.updated.moments import moments_kernel
from wsph.formulations.updated.sharing.beyond import Beyond
from wsph.formulations.updated.sharing.evenness import Evenness
from wsph.formulations.updated.sharing.near import Near, Sights
from wsph.formulations.updated.walls import PLACE, drift_walls_kernel, place_images_kernel, walls_of
from wsph.geometry.lattice import Lattice
from wsph.parts.body_force import BodyForceKinds, weightless
from wsph.parts.part import Attached
from wsph.parts.terms import answers_struct, points_struct
from wsph.plugins.blame import blame
from wsph.sph.averages import visible
from wsph.sph.images import images_struct
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.rows import rows_of
from wsph.sph.skin import Skin

SKIN = 0.3
"""Thickness of the skin around a support, in spacings."""


class UpdatedKernels:
    """The kernels of a composition: `moments` finds what forces take of every particle, `force` the accelerations, `drift`
    and `flow` the rates of the rest, `held` the energy of what is remembered, where that is."""

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form):
        self.moments = moments_kernel(space, laws, layout, form)
        self.force = force_now_kernel(space, layout, parts, form)
        self.drift = drift_kernel(space, layout)
        self.flow = flow_kernel(space, laws, layout, form, velocity_gradient_ahead(space, layout, form))
        if form.remembers:
            self.held = remembered_energy_kernel(space, layout)


@cache
def _kernels(space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form) -> UpdatedKernels:
    return UpdatedKernels(space, laws, layout, parts, form)


class UpdatedRates:
    """The right-hand sides of one body, every particle its own stress point, seen where it is."""

    _driven = 0
    """Driven walls."""
    _cut: Cut | None = None
    _unloaded: tuple[object, Array] | None = None
    """Inertia and loads for the forces of the body alone, once they are asked for."""
    seen = None
    """Parts of the body get no neighbourhood here: its pairs follow the motion."""
    bring: Callable[[], None] | None = None
    """Brings what other processes own up to date."""
    sights: Sights = ()
    """Pairs of particles, and with images."""

    def __init__(self, made: RateSetup, state: State):
        host, placement, space = made.host, made.placement, made.host.space
        if host.correction == "paper":
            raise Refused('run.correction = "paper" is of the total-lagrangian form')
        body = host.geometry
        step = body.frame.step if isinstance(body, Lattice) else np.array([body.spacing])
        if step.max() > 1.001 * step.min():
            text = "an updated kernel is as wide in every direction: give one spacing"
            raise Refused(f"body {host.name!r}: {text}, not {step.tolist()}")
        self._space, self._clock, self._state, self._body = space, made.setup.clock, state, body
        self._constitutive, self._loads, self._force = host.constitutive, made.loads, made.force
        self._count, self._at_nodes, self._domain = placement.count, placement.at_nodes, made.domain
        split, share = body.split, placement.share
        layer, at = (body.node_layer, 0) if placement.at_nodes else (body.point_layer, 1)
        beyond, even = Beyond(host.name, split, share, layer, self._clock.device), None
        if body.cutting is not None:
            even = Evenness(host.name, body.cutting, split.nodes.low, layer[share.own], made.domain)
        self.near = Near(share, None if split.right is None else split.right[at], beyond, even)
        self._arrays = made.arrays.part("rates")
        self.form = made.form(loaded=made.loads.count > 0)
        self._coefficients = made.coefficients(self.form)
        with blame(host.constitutive.who):
            self.kernels = _kernels(space, host.constitutive.laws, made.layout, made.force.parts, self.form)
        # About an origin of its own: far from the scene's, single precision would lose what lies between particles.
        length = host.scales.length
        self._place = (placement.position - body.middle) / length
        self._reach = 2.0 * float(self._coefficients.h) + SKIN * body.spacing / length
        self._thickness = SKIN * body.spacing / length
        self._walls, self._kinds = list(made.walls), kinds_of(list(made.walls), made.domain)
        self._shift = shifts_of(self._kinds, self._walls, body.middle) / length
        self._allocate(placement.volume, made.stabilisation * (length / body.spacing) ** 2)
        self._make_images()
        self.skin = Skin(space, self._count, self._clock, made.domain, self.near.own)
        self._arrays.part("skin").adopt(self.skin, {"found": self.skin.found})
        self._find()
        self.refresh(state)
        known = placement.share.owns(np.arange(self._count))
        made.refuse_isolated(np.where(known, self._rank.numpy(), space.dim))

    def _allocate(self, volume: np.ndarray, spring: float) -> None:
        """The arrays of the n particles, nondimensional; `volume` (n,) at the start, `spring` the stiffness per volume
        against deviations from the linear field of the neighbours. Moments, shares and corrected stresses
        are those of the current configuration, `holding` (n,) vec the forces per mass that hold spurious modes, and `_rank`
        (n,) int32 the number of directions that the neighbours span."""
        space, arrays, n, real = self._space, self._arrays, self._count, self._space.scalar
        points = points_struct(space)()
        points.node = points.centre = arrays.of("node", self._place, space.vec)
        points.moment = arrays.zeros("moment", n, space.mat)
        points.volume = arrays.of("volume", volume, real)
        points.share = arrays.zeros("share", n if self.form.shares else 1, real)
        points.stabilisation = real(spring)
        self._points = points
        answers = answers_struct(space)()
        answers.mean = arrays.zeros("mean", 1, space.vec)
        answers.corrected = arrays.zeros("corrected", n, space.mat)
        answers.extra = arrays.zeros("extra", n if self.form.stress_term is not None else 1, space.mat)
        self._answers = answers
        self._memory = memory_struct(space)()
        self._memory.pull = arrays.zeros("pull", n if self.form.remembers else 1, space.vec)
        self.holding = arrays.zeros("holding", n if self.form.holds else 1, space.vec)
        self._rank = arrays.zeros("rank", n, wp.int32)

    def _make_images(self) -> None:
        """The kinds of images on the device."""
        if not self._kinds:
            return
        space, arrays, kinds = self._space, self._arrays.part("images"), self._kinds
        images = images_struct(space)()
        images.turn = arrays.of("turn", np.stack([kind.turn for kind in kinds]), space.mat)
        images.flip = arrays.of("flip", np.stack([kind.flip for kind in kinds]), space.mat)
        images.shift = arrays.of("shift", self._shift, space.vec)
        images.going = arrays.zeros("going", len(kinds), space.vec)
        images.drive = arrays.zeros("drive", len(kinds), space.vec)
        self._coefficients.images = images
        self._driven = sum(wall.driven for wall in self._walls)
        self._wall_facts = walls_of(space, kinds, self._walls, self._shift, self._arrays.part("walls"))

    def _where_images(self) -> np.ndarray:
        """Where images of every kind stand now, (kinds, dim), as in `images_struct`."""
        shift = self._shift.copy()
        if self._driven:
            driven = [wall for wall in self._walls if wall.driven]
            moved = dict(zip(map(id, driven), self._state.read(PLACE), strict=True))
            for row, kind in enumerate(self._kinds):
                for wall in (self._walls[k] for k in kind.walls if self._walls[k].driven):
                    shift[row] += 2.0 * (moved[id(wall)] @ wall.normal) * wall.normal
        return shift

    def _look(self, place: np.ndarray, wanted: np.ndarray | None) -> Sights:
        """What particles at `place` (n, dim), nondimensional, or those `wanted` (n,) bool, see: each other, and images.
        Walls move too, for which there is more skin."""
        device, body = self._clock.device, self._body
        pairs = find_pairs(place, place, self._reach, device, same=True, wanted=wanted)
        if body.cracks:
            nodes, cells = body.off_cracks
            off_cracks = nodes if self._at_nodes else cells
            pairs = visible(pairs, body, off_cracks, off_cracks)
        if not self._kinds:
            return [(pairs, None)]
        reach = self._reach + self._thickness
        images, parent, kind = find_images(self._kinds, self._where_images(), place, reach, device, wanted)
        self._number = kind
        return [(pairs, None), (images, parent)]

    def _take_images(self, pairs: Pairs, parent: np.ndarray, kind: np.ndarray) -> None:
        """Pairs of particles and images, and the particle and the kind of every image."""
        images, device = self._coefficients.images, self._clock.device
        images.offsets, images.indices = pairs.offsets, pairs.indices
        images.parent = wp.array(parent, dtype=wp.int32, device=device)
        images.kind = wp.array(kind, dtype=wp.int32, device=device)
        self._coefficients.images = images
        for name in ("offsets", "indices", "parent", "kind"):
            self._arrays.take(f"images.{name}", getattr(images, name))

    def _place_images(self, state: State) -> None:
        """Put the images where the driven walls of a state have them (a launch, where there are any)."""
        if self._driven:
            made = place_images_kernel(self._space, state.layout)
            inputs = [self._wall_facts, state.struct]
            self._clock.launch(made, len(self._kinds), inputs, [self._coefficients.images])

    def wall_inputs(self) -> list[object]:
        """What the power of walls is computed from, of the last state that was refreshed."""
        return [self._coefficients, self._points, self._answers, self._memory]

    def _find(self, displacement: np.ndarray | None = None) -> None:
        """Pairs of where the particles are, or were at `displacement`, the skin included."""
        if displacement is None:
            if self.bring is not None:
                self.bring()
            displacement = self._state.read("displacement")
        place = self._place + displacement
        if any_of(self._domain, not np.isfinite(place).all()):
            return  # the finite check says so
        walled = self._thickness if self._kinds else 0.0
        self.sights = self.near.find(partial(self._look, place), place, self._reach + walled)
        pairs = self.sights[0][0]
        self.neighbours: Pairs = pairs
        for images, parent in self.sights[1:]:
            assert parent is not None
            self._take_images(images, parent, self._number)
        self._rows = rows_of(self._space, pairs)
        for name in ("offsets", "indices", "reach"):
            self._arrays.take(f"pairs.{name}", getattr(pairs, name))
        self.skin.found.assign(displacement.astype(self._space.numpy))

    def attach(self, parts: list[Attached]) -> None:
        """No part has anything on the device here."""

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """Its stabilisation has nothing of its own on the device."""
        return {}

    def follow(self) -> bool:
        """Before a step: find the pairs again where a particle may leave its skin by the step's end."""
        state = self._state.struct
        if self.skin.has_left(state.displacement, state.velocity, self._thickness):
            self._find()
            self.near.refuse_uneven()
            return True
        return False

    def placed(self) -> None:
        """Find the pairs of where the particles have been put."""
        self._find()

    def restored(self) -> None:
        """Find the pairs as they were found before the checkpoint."""
        self._find(self.skin.found.numpy().astype(float))

    @property
    def pairs(self) -> int:
        """Directed pairs, those in the skin included, of its own particles."""
        return self.neighbours.within(self.near.own)

    def _launch(self, kernel: wp.Kernel, rows: slice, inputs: Sequence[object], outputs: Sequence[object]) -> None:
        self._clock.launch(kernel, rows.stop - rows.start, inputs, outputs, rows.start)

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes places and velocities alone."""
        if part != "rest":
            self.refresh(state)
            self._loads.follow(state)
            inputs = [self._force.struct, self._coefficients, self._rows, self._points, self._answers, self._memory]
            inputs += [self._loads.vectors, self._loads.following, state.struct]
            self._launch(self.kernels.force, self.near.own, inputs, [self.holding, out.struct])
        if part != "velocity":
            self._place_images(state)
            if self._driven:
                self._clock.launch(
                    drift_walls_kernel(self._space, state.layout), self._driven, [state.struct], [out.struct]
                )
            self._launch(self.kernels.drift, self.near.move, [state.struct], [out.struct])
            inputs = [self._clock.time, self._space.scalar(ahead), self._constitutive.params, self._coefficients]
            inputs += [self._rows, self._points, self._answers.corrected, self._points.share, state.struct]
            inputs += [state.struct]
            self._launch(self.kernels.flow, self.near.stress, inputs, [out.struct])

    def internal(self, state: State, side: Array, out: State) -> None:
        """The accelerations of `out` by the forces between the body's particles in a state, without loads, gravity, damping
        and images, as a plane feels them between the particles of its sides, `side` (n,) int32 (launches)."""
        if self._unloaded is None:
            none = self._arrays.zeros("unloaded", 2 * self._count, self._space.vec)
            self._unloaded = weightless(self._force.struct, self._space), none
            if self._kinds:
                self._cut = Cut(self._space, self.form, self._count, self._clock, self._arrays.part("cut"))
        self.refresh(state)
        body, none = self._unloaded
        found = [self._coefficients, self._rows, self._points, self._answers, self._memory]
        if self._cut is not None:
            alone, rows = self._cut.coefficients(self._coefficients), self._rows
            both = self._cut.answers(rows, side, self._answers, self._memory, self.near.stress)
            found = [alone, rows, self._points, *both]
        inputs = [body, *found, none, none, state.struct]
        self._launch(self.kernels.force, self.near.own, inputs, [self.holding, out.struct])

    def refresh(self, state: State) -> None:
        """Moments and, of a total law, stress of a state (a launch)."""
        self._place_images(state)
        inputs = [self._constitutive.params, self._coefficients, self._rows]
        outputs = [state.struct, self._points, self._answers, self._memory, self._rank]
        self._launch(self.kernels.moments, self.near.stress, inputs, outputs)

    def held_energy(self, state: State) -> float:
        """Energy of what is remembered, of a state, nondimensional (a launch and a copy)."""
        if not self.form.remembers:
            return 0.0
        own = self.near.own
        sums: Array = wp.zeros(blocks(own.stop - own.start), dtype=wp.float64, device=self._clock.device)
        inputs = [own.start, own.stop, self._points, state.struct]
        wp.launch(self.kernels.held, len(sums), inputs=inputs, outputs=[sums], device=self._clock.device)
        return total(sums, self._domain)
