"""Right-hand sides of one set in the current configuration: pairs, weights and gradients of where the particles are.

A particle i sees j with r = x_j - x_i and w = |W'(r)|/r, h as at the start:

    M_i = (sum w r (x) r)^-1,   L_i = sum w (v_j - v_i) (x) r M_i,   dF/dt = L F,   rho = rho_0/J
    f_i = sum_j w (V_i sigma_i M_i + V_j sigma_j M_j) r,   V = J V_0

The force is the dual of the gradient: linear and angular momentum are kept to rounding, and the forces do the work of the
stresses. J from F is the equation of continuity. Under tension such a kernel clumps (tensile instability, from a stretch of
about 1.2), which artificial stress delays; the Lagrangian kernels (`wsph.formulations.lagrangian`) do not. Use it for
bodies that lose their reference configuration; for solids that hold together the Lagrangian forms are more accurate,
faster and stable.

Pairs are kept with a skin. They are found again when a particle has moved by half of the skin, or can have by the end of the
step: on the host before a step, so that steps are captured one by one. Pairs in the skin have the weight zero and rows
ascend, so that the step at which pairs are rebuilt does not change the sums.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.errors import Refused
from wsph.formulations.lagrangian.flow import drift_kernel, flow_kernel
from wsph.formulations.lagrangian.forces import force_between_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Setup
from wsph.formulations.updated.gradient import velocity_gradient_ahead
from wsph.formulations.updated.moments import moments_kernel
from wsph.parts.body_force import BodyForceKinds
from wsph.parts.part import Attached
from wsph.parts.terms import answers_struct, points_struct
from wsph.plugins.blame import blame
from wsph.sph.averages import visible
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.rows import rows_of
from wsph.sph.skin import Skin

SKIN = 0.3
"""Thickness of the skin around a support, in spacings."""


class UpdatedKernels:
    """The kernels of a composition: `moments` finds what forces take of every particle, `force` the accelerations, `drift`
    and `flow` the rates of the rest."""

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form):
        self.moments = moments_kernel(space, laws, layout, form)
        self.force = force_between_kernel(space, layout, parts, form)
        self.drift = drift_kernel(space, layout)
        self.flow = flow_kernel(space, laws, layout, form, velocity_gradient_ahead(space, layout, form))


@cache
def _kernels(space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form) -> UpdatedKernels:
    return UpdatedKernels(space, laws, layout, parts, form)


class UpdatedRates:
    """The right-hand sides of one body, every particle its own stress point, seen where it is."""

    seen = None
    """Parts of the body get no neighbourhood here: its pairs follow the motion."""

    def __init__(self, made: RateSetup, state: State):
        host, placement, space = made.host, made.placement, made.host.space
        if host.correction == "paper":
            raise Refused('run.correction = "paper" is of the total-lagrangian form')
        step = host.lattice.frame.step
        if step.max() > 1.001 * step.min():
            text = "an updated kernel is as wide in every direction: give one spacing"
            raise Refused(f"body {host.name!r}: {text}, not {step.tolist()}")
        self._space, self._clock, self._state, self._lattice = space, made.setup.clock, state, host.lattice
        self._constitutive, self._loads, self._force = host.constitutive, made.loads, made.force
        self._count, self._at_nodes = placement.count, placement.at_nodes
        self._arrays = made.arrays.part("rates")
        self.form = made.form(loaded=made.loads.count > 0)
        self._coefficients = made.coefficients(self.form)
        with blame(host.constitutive.who):
            self.kernels = _kernels(space, host.constitutive.laws, made.layout, made.force.parts, self.form)
        # About an origin of its own: far from the scene's, single precision would lose what lies between particles.
        length = host.scales.length
        self._place = (placement.position - placement.position.mean(0)) / length
        self._reach = 2.0 * float(self._coefficients.h) + SKIN * host.lattice.spacing / length
        self._thickness = SKIN * host.lattice.spacing / length
        self._allocate(placement.volume)
        self.skin = Skin(space, self._count, self._clock)
        self._arrays.part("skin").adopt(self.skin, {"found": self.skin.found})
        self._find()
        self.refresh(state)
        made.refuse_isolated(self._rank.numpy())

    def _allocate(self, volume: np.ndarray) -> None:
        """The arrays of the n particles, nondimensional; `volume` (n,) at the start. Moments, shares and corrected stresses
        are those of the current configuration, `holding` (n,) vec the forces per mass that hold spurious modes, and `_rank`
        (n,) int32 the number of directions that the neighbours span."""
        space, arrays, n, real = self._space, self._arrays, self._count, self._space.scalar
        points = points_struct(space)()
        points.node = points.centre = arrays.of("node", self._place, space.vec)
        points.moment = arrays.zeros("moment", n, space.mat)
        points.volume = arrays.of("volume", volume, real)
        points.share = arrays.zeros("share", n if self.form.shares else 1, real)
        self._points = points
        answers = answers_struct(space)()
        answers.mean = arrays.zeros("mean", 1, space.vec)
        answers.corrected = arrays.zeros("corrected", n, space.mat)
        answers.extra = arrays.zeros("extra", n if self.form.stress_term is not None else 1, space.mat)
        self._answers = answers
        self.holding = arrays.zeros("holding", n if self.form.holds else 1, space.vec)
        self._rank = arrays.zeros("rank", n, wp.int32)

    def _find(self, displacement: np.ndarray | None = None) -> None:
        """Pairs of where the particles are, or were at `displacement`, the skin included."""
        if displacement is None:
            displacement = self._state.read("displacement")
        place, lattice = self._place + displacement, self._lattice
        if not np.isfinite(place).all():
            return  # the finite check says so
        pairs = find_pairs(place, place, self._reach, self._clock.device, same=True)
        if lattice.cracks:
            nodes, cells = lattice.off_cracks
            off_cracks = nodes if self._at_nodes else cells
            pairs = visible(pairs, lattice, off_cracks, off_cracks)
        self.neighbours: Pairs = pairs
        self._rows = rows_of(self._space, pairs)
        for name in ("offsets", "indices", "reach"):
            self._arrays.take(f"pairs.{name}", getattr(pairs, name))
        self.skin.found.assign(displacement.astype(self._space.numpy))

    def attach(self, parts: list[Attached]) -> None:
        """No part has anything on the device here."""

    def follow(self) -> bool:
        """Before a step: find the pairs again where a particle may leave its skin by the step's end."""
        state = self._state.struct
        if self.skin.has_left(state.displacement, state.velocity, self._thickness):
            self._find()
            return True
        return False

    def restored(self) -> None:
        """Find the pairs as they were found before the checkpoint."""
        self._find(self.skin.found.numpy().astype(float))

    @property
    def pairs(self) -> int:
        """Directed pairs, those in the skin included."""
        return self.neighbours.count

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes places and velocities alone."""
        if part != "rest":
            self.refresh(state)
            self._loads.follow(state)
            inputs = [self._force.struct, self._coefficients, self._rows, self._points, self._answers]
            inputs += [self._loads.vectors, self._loads.following, state.struct, state.struct]
            self._clock.launch(self.kernels.force, self._count, inputs, [self.holding, out.struct])
        if part != "velocity":
            self._clock.launch(self.kernels.drift, self._count, [state.struct], [out.struct])
            inputs = [self._clock.time, self._space.scalar(ahead), self._constitutive.params, self._coefficients]
            inputs += [self._rows, self._points, state.struct, state.struct]
            self._clock.launch(self.kernels.flow, self._count, inputs, [out.struct])

    def refresh(self, state: State) -> None:
        """Moments and, of a total law, stress of a state (a launch)."""
        inputs = [self._constitutive.params, self._coefficients, self._rows]
        outputs = [state.struct, self._points, self._answers, self._rank]
        self._clock.launch(self.kernels.moments, self._count, inputs, outputs)

    def held_energy(self, state: State) -> float:
        """None: whatever holds modes here is a force, whose work is counted."""
        return 0.0


def build(setup: Setup) -> OneSetSystem:
    """A body in the current configuration."""
    return OneSetSystem(setup, UpdatedRates)
