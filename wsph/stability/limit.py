"""The limit of a body's time step, recomputed as the body deforms."""

# pyright: strict

from collections.abc import Callable

import numpy as np

from wsph.protocols import Limited

SLACK = 1e-6
"""A Courant number may exceed its limit by this part of it: rounding."""

RECOMPUTED = 0.05
"""Logarithm of the distortion after which the limit of a body is recomputed."""


Ask = Callable[[], tuple[float | None, str]]
"""Gives a limit, None where there is none to be known, and where it comes from."""


class StepLimit:
    """The largest stable Courant number of a body, recomputed where deformation has changed its stiffness or its pairs.

    `value` is None where the integrator declares none, `reason` says where it comes from, `distortion` is that of the state
    it was computed for, `share` the part of the limit that the run began with, and `swing`, where something that the limit
    counts in acts between the body and others, gives the Courant number up to which leapfrog holds its fastest wave.
    """

    def __init__(self, ask: Ask, system: Limited, measured: bool, courant_follows: bool):
        """`ask` gives limit and reason for the system's current state. `measured`: that answer follows the state;
        `courant_follows`: so does a particle's own Courant number."""
        self._ask, self._system = ask, system
        self._measured, self._courant_follows = measured, courant_follows
        self._pushed = 0.0
        self.swing: Callable[[], float] | None = None
        self.distortion = self.share = 1.0
        self.value, self.reason = ask()

    def push(self, frequency: float) -> None:
        """Lower the limit for interactions with the body: `frequency` bounds the frequency that they add, nondimensional."""
        self._pushed = frequency
        self.measure()

    @property
    def pushed(self) -> bool:
        """Whether something from outside adds to its frequencies."""
        return self._pushed > 0.0 or self.swing is not None

    def measure(self) -> None:
        """Find the limit of the state as it is. Squares of frequencies add."""
        self.value, self.reason = self._ask()
        if self.value is not None and self._pushed > 0.0 and self._system.frequency > 0.0:
            self.value /= float(np.sqrt(1.0 + (self._pushed / self._system.frequency) ** 2))
            self.reason += ", and its contacts"

    @property
    def adapts(self) -> bool:
        """Whether deformation can bring the Courant number beyond it."""
        return bool(self.value) and (self._courant_follows or self._measured)

    def follow(self, distortion: float) -> None:
        """Recompute the limit once the body has stretched by exp(RECOMPUTED); earlier where it runs close to the limit."""
        since = RECOMPUTED * float(np.clip(5.0 * (1.0 - self.share), 0.1, 1.0))
        if self.value is not None and self._measured and abs(np.log(distortion / self.distortion)) > since:
            self.distortion = distortion
            self._system.forget_motions()
            self.measure()

    def kept(self) -> list[float | None]:
        """The numbers that a checkpoint holds of the limit."""
        return [self.value, self.distortion]

    def restore(self, value: float | None, distortion: float) -> None:
        """Put back what `kept` gave."""
        self.value, self.distortion = value, distortion
