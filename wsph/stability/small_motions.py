"""The small motions of a one-set body about its current state, found when they are first asked for: what integrators take
their limits from."""

# pyright: strict

from functools import cached_property

import numpy as np

from wsph.stability.krylov import Moving, spectrum
from wsph.stability.spectrum import Spectrum


class SmallMotions:
    """Frequencies, damping and growth of a body's small motions, nondimensional, about the state in which they were first
    asked for since `forget`."""

    def __init__(self, system: Moving):
        self._system = system

    @cached_property
    def _spectrum(self) -> Spectrum:
        return spectrum(self._system)

    @property
    def _shares(self) -> tuple[float, ...]:
        """Shares of the drag that may act at once. Several where it is switched by the motion or does not see all of it: a
        time step has to suit each."""
        shares = self._spectrum.approach() if self._system.one_sided else (1.0,)
        # Dashpots act all the time.
        shares = (*shares, 1.0) if self._system.one_sided and self._system.resisted else shares
        # Gradients of points with places of their own do not see all motion.
        return (0.0, *shares) if self._system.points and self._system.drags else shares

    @property
    def frequency(self) -> float:
        """The largest frequency."""
        return self._spectrum.frequency

    @property
    def growth(self) -> float:
        """The largest growth rate of a mode that does not oscillate. Where pairs follow the motion it is that of particles
        that clump together under tension."""
        return self._spectrum.growth

    @property
    def modes(self) -> np.ndarray:
        """lambda of the motions exp(lambda t), (k,) complex: the outermost of them and some tens of others, without those of
        the rigid body."""
        return self._spectrum.modes(self._shares)

    def largest(self, dt: float, factor: float) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D, stiffness and damping, an upper estimate; `dt` nondimensional."""
        return self._spectrum.largest(dt, factor, self._shares)

    def forget(self) -> None:
        """The next question finds the spectrum of the current state."""
        self.__dict__.pop("_spectrum", None)
