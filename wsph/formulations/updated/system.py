"""The updated-Lagrangian system of one set: pairs, weights and gradients of where the particles are.

A particle i sees j with r = x_j - x_i and w = |W'(r)|/r, h as at the start:

    M_i = (sum w r (x) r)^-1,   L_i = sum w (v_j - v_i) (x) r M_i,   dF/dt = L F,   rho = rho_0/J
    f_i = sum_j w (V_i sigma_i M_i + V_j sigma_j M_j) r,   V = J V_0

The force is the dual of the gradient: linear and angular momentum are kept to rounding, and the forces do the work of the
stresses. J from F is the equation of continuity. Under tension such a kernel
clumps (tensile instability, from a stretch of about 1.2), which artificial stress delays; the Lagrangian kernels
(`wsph.formulations.lagrangian`) do not. Use it for what has no reference configuration any more; for solids that hold
together the Lagrangian forms are more accurate, faster and stable.

Pairs are kept with a skin and found anew when a particle has moved, or can have moved by the end of the step, half of it:
found on the host before a step, so that steps are captured one by one. Pairs in the skin have the weight zero and rows
ascend, so that when they are found changes no bit of the sums.
"""

import numpy as np
import warp as wp

from wsph.backend.state import State
from wsph.errors import Refused
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.kernels import Kernels, kernels
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.setup import Setup, Traits
from wsph.plugins.blame import blame
from wsph.sph.averages import unparted
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.skin import Skin

SKIN = 0.3
"""Thickness of the skin around a support, in spacings."""


class UpdatedLagrangianSystem(OneSetSystem):
    """Every particle its own stress point, seen where it is."""

    formulation = "updated-lagrangian"
    traits = Traits(
        takes=("viscosity", "artificial_stress"), pairs_follow=True, measures=True, clumps=True, pushable=True
    )
    derived = ()

    def __init__(self, setup: Setup):
        super().__init__(setup)
        scene, body, lattice = setup.scene, setup.body, setup.lattice
        space, constitutive, scales, device = setup.space, setup.constitutive, setup.scales, setup.device
        if scene.run.correction == "paper":
            raise Refused('run.correction = "paper" is of the total-lagrangian form')
        step = lattice.frame.step
        if step.max() > 1.001 * step.min():
            text = "an updated kernel is as wide in every direction: give one spacing"
            raise Refused(f"body {body.name!r}: {text}, not {step.tolist()}")
        laws = constitutive.laws
        self._moment = wp.zeros(self.count, dtype=space.mat, device=device)
        self._corrected = wp.zeros_like(self._moment)
        self._opposing = wp.zeros(self.count if self.parts.artificial else 1, dtype=space.mat, device=device)
        # About an origin of its own: far from the scene's, single precision would lose what lies between particles.
        self._place = (self.position - self.position.mean(0)) / scales.length
        self._x = wp.array(self._place, dtype=space.vec, device=device)
        self._volume = wp.array(self.volume, dtype=space.scalar, device=device)
        self._share = wp.zeros(self.count if self.viscous else 1, dtype=space.scalar, device=device)
        self._rank = wp.zeros(self.count, dtype=wp.int32, device=device)
        self._unused = wp.zeros(1, dtype=space.scalar, device=device)
        self.form = Form(False, laws.total is not None, False, self.loads.count > 0, False, self.parts, moving=True)
        with blame(constitutive.who):
            self.kernels: Kernels = kernels(
                space, laws, self.state.layout, self.force.parts, self.form, scene.run.kernel
            )
        self._skin = Skin(space, self.count, setup.clock)
        self._find()
        self.refresh(self.state)
        self.refuse_lonely(self._rank.numpy())

    def _find(self, displacement: np.ndarray | None = None) -> None:
        """Pairs of where the particles are, or were at `displacement`, the skin included."""
        if displacement is None:
            displacement = self.state.read("displacement")
        place = self._place + displacement
        if not np.isfinite(place).all():
            return  # the finite check says so
        reach = 2.0 * float(self.pair.h) + SKIN * self.spacing / self.scales.length
        lattice = self.lattice
        pairs = find_pairs(place, place, reach, self.device, same=True)
        if lattice.cracks:
            nodes, cells = lattice.sided
            sided = nodes if self.at_nodes else cells
            pairs = unparted(pairs, lattice, sided, sided)
        self._pairs: Pairs = pairs
        self._skin.found.assign(displacement.astype(self.space.numpy))

    def follow(self) -> bool:
        """Before a step: find the pairs anew where a particle may leave its skin by the step's end."""
        state = self.state.struct
        if self._skin.left(state.displacement, state.velocity, SKIN * self.spacing / self.scales.length):
            self._find()
            return True
        return False

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | {"found": self._skin.found}

    def restored(self) -> None:
        self._find(self._skin.found.numpy().astype(float))
        super().restored()

    @property
    def pairs(self) -> int:
        """Directed pairs, those in the skin included."""
        return self._pairs.count

    @property
    def _rows(self) -> list[wp.array]:
        return [self._pairs.offsets, self._pairs.indices, self._unused]

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes places and velocities alone."""
        if part != "rest":
            self.refresh(state)
            inputs = [self.force.struct, self.pair, *self._rows, self._x, self._moment, self._share, self._volume]
            inputs += [
                self.space.scalar(0.0),
                self._corrected,
                self._opposing,
                self._load_vectors,
                state.struct,
                state.struct,
            ]
            self.clock.launch(self.kernels.force, self.count, inputs, [self._hold, out.struct])
        if part != "velocity":
            self.clock.launch(self.kernels.drift, self.count, [state.struct], [out.struct])
            inputs = [self.clock.time, self.space.scalar(ahead), self.constitutive.params, self.pair]
            inputs += self._rows
            inputs += [self._x, self._x, self._moment, state.struct, state.struct]
            self.clock.launch(self.kernels.flow, self.count, inputs, [out.struct])

    def refresh(self, state: State) -> None:
        """Moments and, of a total law, stress of a state (a launch)."""
        inputs = [self.constitutive.params, self.pair, *self._rows, self._x, self._volume, state.struct]
        outputs = [self._moment, self._share, self._corrected, self._opposing, self._rank]
        self.clock.launch(self.kernels.moments, self.count, inputs, outputs)

    @property
    def nbytes(self) -> int:
        """Device memory of the body [bytes]: pairs and all states, the integrator's too."""
        own = [self._moment, self._corrected, self._opposing, self._x, self._volume, self._rank]
        own += [self._hold, self.work.loads.before, self._skin.found]
        return self._pairs.nbytes + sum(a.capacity for a in own) + self.state_bytes
