"""The fastest waves and the strongest damping of a one-set body, from its own right-hand sides: they limit its time step.

Small motions are M u'' + D u' + K u = 0, and a step of any method multiplies each of their modes, exp(lambda t), by a number
of its own. Neither the largest frequency nor the largest damping rate says where that leaves 1 first: a wave that is damped
is held further than one that is not, and a method that amplifies waves stops at the one that is damped least for its
frequency. So K and D are projected on what a few dozen right-hand sides span, and the modes of the projection stand for the
body's (tests/stability/test_guard.py holds limits to runs and to whole spectra).
"""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsph.stability.margins import APPROACH, STILL


def outermost(matrix: np.ndarray, square: np.ndarray, end: int = -1) -> tuple[float, float]:
    """The outermost eigenvalue of an operator projected on orthonormal vectors, and a bound of its distance from one of the
    whole operator: the norm of the product less the projected one. `square` is the projected square of the operator."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    y = vectors[:, end]
    return float(values[end]), float(np.sqrt(max(y @ square @ y - values[end] ** 2, 0.0)))


@dataclass(frozen=True)
class Spectrum:
    """The small motions of a body, nondimensional, as known from the products of its stiffness K and its damping D
    with m orthonormal, mass-weighted vectors.

    `stiffness` and `damping`, (m, m), are K and D projected on them, the damping that of all pairs, whatever the kind of its
    viscosity; `squares` K K, K D and D D. `rate` is that of the damping in proportion to mass, `still` of `STILL`.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    squares: tuple[np.ndarray, np.ndarray, np.ndarray]
    rate: float
    still: float

    @cached_property
    def finite(self) -> bool:
        """Whether the body could be moved at all without leaving the numbers."""
        return bool(np.isfinite(self.stiffness).all())

    @cached_property
    def frequency(self) -> float:
        """The largest frequency of the undamped body, an upper estimate."""
        if not self.finite:
            return np.inf
        return float(np.sqrt(max(sum(outermost(self.stiffness, self.squares[0])), 0.0))) if len(self.stiffness) else 0.0

    @cached_property
    def growth(self) -> float:
        """The largest rate of a mode that grows without oscillating, zero where none is sure."""
        if not self.finite or not len(self.stiffness):
            return 0.0
        value, gap = outermost(self.stiffness, self.squares[0], 0)
        return float(np.sqrt(max(-value - gap, 0.0)))

    @cached_property
    def drag_rate(self) -> float:
        """The largest damping rate of the viscosity, an upper estimate."""
        return sum(outermost(self.damping, self.squares[2])) if self.damping.any() else 0.0

    def approach(self) -> tuple[float, float]:
        """The lowest and the highest share of the viscosity that acts, where it acts on approaching pairs alone."""
        start, slope, floor, most = APPROACH
        over = self.drag_rate / self.frequency if self.frequency > 0.0 else 0.0
        return max(start - slope * over, floor), most

    def largest(self, dt: float, factor: float, shares: tuple[float, ...]) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D, an upper estimate, for the worst of the shares of the
        viscosity."""
        found: list[float] = []
        one = np.eye(len(self.stiffness))
        kk, kd, dd = self.squares
        for share in shares:
            a, b, c = dt**2, factor * dt * share, factor * dt * self.rate
            part = a * self.stiffness + b * self.damping
            square = a * a * kk + a * b * (kd + kd.T) + b * b * dd + c * (part + part.T) + c * c * one
            found.append(sum(outermost(part + c * one, square)))
        return max(found, default=0.0)

    def modes(self, shares: tuple[float, ...]) -> np.ndarray:
        """lambda of the motions exp(lambda t) on the vectors, for every share of the viscosity: frequencies and overdamped
        rates by as much higher as the highest of all may be."""
        found, one = [np.zeros(0, complex)], np.eye(len(self.stiffness))
        known = outermost(self.stiffness, self.squares[0])[0] if self.finite and len(self.stiffness) else 0.0
        if not known > 0.0:
            return found[0]
        higher = self.frequency**2 / known
        stronger = self.drag_rate / outermost(self.damping, self.squares[2])[0] if self.drag_rate > 0.0 else 1.0
        for share in shares:
            each = modes(higher * self.stiffness, share * self.damping + self.rate * one, self.still)
            found.append(np.where(np.abs(each) > self.frequency, stronger * each, each))
        return np.concatenate(found)


def modes(stiffness: np.ndarray, damping: np.ndarray, still: float = STILL["f64"]) -> np.ndarray:
    """lambda of lambda^2 + D lambda + K, up to (2 m,): without rigid motions and modes that grow by themselves."""
    m = len(stiffness)
    values = np.linalg.eigvals(np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]]))
    values = values[np.abs(values) > still * np.abs(values).max()] if m else values
    return np.minimum(values.real, 0.0) + 1j * values.imag
