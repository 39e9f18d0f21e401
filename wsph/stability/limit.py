"""The limit of a body's time step, followed as the body deforms.

A limit is measured from right-hand sides (`wsph.stability.krylov`), at the start of a run. From then on it is estimated: it
falls as the fastest frequency grows by the estimate of `wsph.stability.stiffening`, and by UNSURE of what the body has been
distorted since the measurement; where no law could have stiffened enough (STEEPEST), there is not even an estimate. It is
measured again where the estimate leaves a run no room, and now and then where the body has deformed, for what estimates do
not see; but what that takes has to be affordable: OFTEN of a run's right-hand sides so far, DOUBTED where there is no room.
A step that adapts follows the estimate until then. With a fixed step the first measurement in doubt is made whatever it
costs; later ones wait for their turn, unless the estimate is beyond all doubt: then the limit is taken as exceeded.
"""

# pyright: strict

from collections.abc import Callable

import numpy as np

from wsph.protocols import Limited
from wsph.stability.margins import VECTORS

SLACK = 1e-6
"""A Courant number may exceed its limit by this part of it: rounding."""

RECOMPUTED = 0.05
"""Logarithm of the distortion after which the limit of a body is measured again, where that is affordable."""

OFTEN, DOUBTED = 0.01, 0.05
"""Parts of a run's right-hand sides that measurements may take: those without doubt, and all. A measurement takes several
times as long as as many right-hand sides of steps: its vectors are combined on the host."""

STEEPEST = 4.0
"""Logarithm of frequency per logarithm of distortion that no law exceeds: a nearly incompressible one that is squeezed from
all sides reaches 2.5."""

UNSURE, MOST_UNSURE = 0.2, 0.1
"""Logarithm of the limit that an estimate may be off per logarithm of distortion since the last measurement, and at most:
tests/stability/test_following.py."""

LEEWAY = 1.01
"""Part of an estimated limit up to which a step is left: half of what limits leave by themselves."""

SURELY = 1.25
"""A fixed step that exceeds an estimated limit by this is beyond the limit, measured or not."""

APART = 100
"""Steps after which the estimate is looked at again, however little the largest distortion has changed."""


Ask = Callable[[], tuple[float | None, str]]
"""Gives a limit, None where there is none to be known, and where it comes from."""

Known = tuple[float | None, float, float, float, float, int, int]
"""The numbers that a checkpoint holds of a limit: its value, the distortion that it is of, what is known from the last
measurement (the limit times the growth of the frequency, the distortion, and the rate of what grows by itself), the step of
the last estimate, right-hand sides spent."""


class StepLimit:
    """The largest stable Courant number of a body, followed where deformation changes its stiffness or its pairs.

    `value` is None where the integrator declares none, `reason` says where it comes from, `distortion` is that of the state
    that it is of, `share` the part of the limit that the run began with, `measured` whether it is, `sure` whether a fixed
    step beyond it is to be stopped, `spent` the right-hand sides that measurements have taken since the start, and `swing`,
    where something that the limit counts in acts between the body and others, gives the Courant number up to which leapfrog
    holds its fastest wave.
    """

    def __init__(
        self,
        ask: Ask,
        system: Limited,
        courant_follows: bool,
        stiffened: Callable[[], float] | None = None,
        clumps: bool = False,
    ):
        """`ask` gives limit and reason for the system's current state; `courant_follows`: a particle's own Courant number
        follows it. `stiffened`: the growth of its largest frequency, of a body whose limit follows its state; `clumps`: its
        slowest motions matter too, which no estimate knows."""
        self._ask, self._system = ask, system
        self._courant_follows, self._stiffened, self._clumps = courant_follows, stiffened, clumps
        self._pushed = 0.0
        self.swing: Callable[[], float] | None = None
        self.distortion = self.share = 1.0
        self.spent, self.measured, self.sure = 0, True, True
        before = system.evaluations
        self.value, self.reason = ask()
        self._cost = system.evaluations - before or VECTORS + 1
        self._known, self._looked = (self.value or 0.0, 1.0, system.growth if clumps else 0.0), 0

    def push(self, frequency: float) -> None:
        """Lower the limit for interactions with the body: `frequency` bounds the frequency that they add, nondimensional."""
        self._pushed = frequency
        self.measure()

    @property
    def pushed(self) -> bool:
        """Whether something from outside adds to its frequencies."""
        return self._pushed > 0.0 or self.swing is not None

    def measure(self, growth: float = 1.0) -> None:
        """Find the limit of the state as it is, whose largest frequency has grown by an estimated `growth`. Squares of
        frequencies add."""
        self.value, self.reason = self._ask()
        if self.value is not None and self._pushed > 0.0 and self._system.frequency > 0.0:
            self.value /= float(np.sqrt(1.0 + (self._pushed / self._system.frequency) ** 2))
            self.reason += ", and its contacts"
        growing = self._system.growth if self._clumps else 0.0
        self._known = (self.value or 0.0) * growth, self.distortion, growing
        self.measured = self.sure = True

    @property
    def adapts(self) -> bool:
        """Whether deformation can bring the Courant number beyond it."""
        return bool(self.value) and (self._courant_follows or self._stiffened is not None)

    def follow(self, distortion: float, enough: float, step: int, work: int, *, fixed: bool) -> None:
        """Find the limit of the state at `step`, of a largest `distortion`, as far as it matters: whether it is `enough`.
        `work`: right-hand sides a step; `fixed`: the time step does not follow."""
        if self.value is None or self._stiffened is None or not np.isfinite(distortion):
            return
        known, at, _ = self._known
        least = known * distortion**-STEEPEST
        away = abs(float(np.log(distortion / at)))
        moved = away > RECOMPUTED * float(np.clip(5.0 * (1.0 - self.share), 0.1, 1.0))
        if not (self._clumps and moved):
            if least >= enough:
                self.value, self.distortion = least, distortion
                self.measured, self.sure = False, True
                return
            change = abs(float(np.log(distortion / self.distortion)))
            if self.value * np.exp(-STEEPEST * change) >= enough and step < self._looked + APART:
                return
        growth = self.estimate()
        self.value = known / growth * float(np.exp(-min(UNSURE * away, MOST_UNSURE)))
        self.distortion, self._looked = distortion, step
        doubt = self.value < enough
        self.measured, self.sure = False, self.value * SURELY < enough
        part = DOUBTED if doubt or self._clumps else OFTEN
        free = self.spent == 0 and ((doubt and fixed) or self._clumps)
        if (doubt or moved) and (free or self.spent + self._cost <= part * step * work):
            before = self._system.evaluations
            self._system.forget_motions()
            self.measure(growth)
            self._cost = self._system.evaluations - before
            self.spent += self._cost

    @property
    def leeway(self) -> float:
        """Part of the limit up to which a step is within it."""
        return (1.0 + SLACK) * (1.0 if self.measured else LEEWAY)

    def estimate(self) -> float:
        """The growth of the largest frequency since the body was undeformed, as its points have it; one where it is not
        known."""
        return self._stiffened() if self._stiffened is not None else 1.0

    @property
    def growth(self) -> float:
        """The rate of the mode that grows fastest without oscillating, nondimensional, of a body that clumps: tension drives
        it, and its square has grown with the strain since it was measured."""
        _, at, growing = self._known
        return growing * float(np.sqrt(np.log(self.distortion) / np.log(at))) if growing > 0.0 and at > 1.0 else growing

    def kept(self) -> Known:
        """The numbers that a checkpoint holds of the limit."""
        return self.value, self.distortion, *self._known, self._looked, self.spent

    def restore(self, known: Known) -> None:
        """Put back what `kept` gave."""
        self.value, self.distortion, product, at, growing, self._looked, self.spent = known
        self._known = product, at, growing
        self.measured = self.distortion == at
