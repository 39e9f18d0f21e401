"""The fastest waves and the strongest damping of a one-set body, from its own right-hand sides: what limits its time step.

Small motions are M u'' + D u' + K u = 0, and a step of any method multiplies each of their modes, exp(lambda t), by a number
of its own. Neither the largest frequency nor the largest damping rate says where that leaves 1 first: a wave that is damped
is held further than one that is not, and a method that amplifies waves stops at the one that is damped least for its
frequency. So K and D are projected on what a few dozen right-hand sides span, and the modes of the projection stand for the
body's (tests/integrators/test_guard.py holds limits to runs and to whole spectra).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

VECTORS = 20
"""Vectors, with a product each, for a body without damping: Lanczos' method."""
DAMPED_VECTORS = (6, 24)
"""Of one with viscosity, with two products each: Lanczos' vectors, then up to so many by the second-order Krylov space."""
LARGE = 1_000_000
"""Numbers in a vector from which on vectors are kept in single precision: a limit needs two digits."""
APPROACH = (0.5, 0.022, 0.2, 0.59)
"""Viscosity of what approaches acts on half of the pairs of a wave, but motion that it overdamps lasts longer in the half of
the time in which it is not damped, and in a front more than half of the pairs close: its damping is taken as .5 less .022
times the largest damping rate over the largest frequency, not below .2, and as .59 times the one on all pairs, whichever is
the worse. The numbers are from runs of the magnesium bar (`wsph validate --full bar-stability`), whose limits lie 0 to 20 %
above what they give."""
STILL = {"f64": 1e-4, "f32": 1e-2}
"""A mode slower than this part of the fastest is a motion of the rigid body, by the run's precision."""


def _top(matrix: np.ndarray, square: np.ndarray, end: int = -1) -> tuple[float, float]:
    """The outermost eigenvalue of an operator projected on orthonormal vectors, and how far it may be from one of the whole
    operator's: the norm of what the operator leaves beside it. `square` is the operator's square, projected."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    y = vectors[:, end]
    return float(values[end]), float(np.sqrt(max(y @ square @ y - values[end] ** 2, 0.0)))


@dataclass(frozen=True)
class Spectrum:
    """What is known of the small motions of a body, nondimensional, from the products of its stiffness K and its damping D
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
        return float(np.sqrt(max(sum(_top(self.stiffness, self.squares[0])), 0.0))) if len(self.stiffness) else 0.0

    @cached_property
    def growth(self) -> float:
        """The largest rate of a mode that grows without oscillating, zero where none is sure."""
        if not self.finite or not len(self.stiffness):
            return 0.0
        value, gap = _top(self.stiffness, self.squares[0], 0)
        return float(np.sqrt(max(-value - gap, 0.0)))

    @cached_property
    def viscous_rate(self) -> float:
        """The largest damping rate of the viscosity, an upper estimate."""
        return sum(_top(self.damping, self.squares[2])) if self.damping.any() else 0.0

    def approach(self) -> tuple[float, float]:
        """The least and the most of the viscosity that acts where it acts on approaching pairs alone."""
        start, slope, floor, most = APPROACH
        over = self.viscous_rate / self.frequency if self.frequency > 0.0 else 0.0
        return max(start - slope * over, floor), most

    def largest(self, dt: float, factor: float, shares: tuple[float, ...]) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D, an upper estimate, for the worst of the shares of the
        viscosity."""
        found, one = [], np.eye(len(self.stiffness))
        kk, kd, dd = self.squares
        for share in shares:
            a, b, c = dt**2, factor * dt * share, factor * dt * self.rate
            part = a * self.stiffness + b * self.damping
            square = a * a * kk + a * b * (kd + kd.T) + b * b * dd + c * (part + part.T) + c * c * one
            found.append(sum(_top(part + c * one, square)))
        return max(found, default=0.0)

    def modes(self, shares: tuple[float, ...]) -> np.ndarray:
        """lambda of the motions exp(lambda t) on the vectors, for every share of the viscosity: frequencies and overdamped
        rates by as much higher as the highest of all may be."""
        found, one = [np.zeros(0, complex)], np.eye(len(self.stiffness))
        known = _top(self.stiffness, self.squares[0])[0] if self.finite and len(self.stiffness) else 0.0
        if not known > 0.0:
            return found[0]
        higher = self.frequency**2 / known
        stronger = self.viscous_rate / _top(self.damping, self.squares[2])[0] if self.viscous_rate > 0.0 else 1.0
        for share in shares:
            each = modes(higher * self.stiffness, share * self.damping + self.rate * one, self.still)
            found.append(np.where(np.abs(each) > self.frequency, stronger * each, each))
        return np.concatenate(found)


def modes(stiffness: np.ndarray, damping: np.ndarray, still: float = STILL["f64"]) -> np.ndarray:
    """lambda of lambda^2 + D lambda + K, up to (2 m,): without those of the rigid body and of what grows by itself."""
    m = len(stiffness)
    values = np.linalg.eigvals(np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]]))
    values = values[np.abs(values) > still * np.abs(values).max()] if m else values
    return np.minimum(values.real, 0.0) + 1j * values.imag


class Products:
    """K and D of a body about its current state times mass-weighted vectors, prescribed components held."""

    def __init__(self, system: Any):
        self.system = system
        self.free = system.free_components
        self.mass = np.sqrt(np.repeat(system.volume, system.space.dim))
        self._moved, self._change = system.temporary(), system.temporary()
        self._start = system.state.buffer.numpy().copy()
        self._n = len(self.free)
        self._eps = 1e-6 if system.space.precision == "f64" else 1e-2
        self.evolved = not system.form.total or system.form.moving
        self._resting = self._changes(np.zeros(self._n)) if self.evolved else None
        self._rest = self._accelerations(np.zeros(self._n))
        self._closing: np.ndarray | None = None
        if system.viscous and system.parts.viscosity == "approach":
            # All pairs approach each other, so fast that a vector changes nothing in that.
            a = system.state.start["displacement"]
            place = system.position / system.scales.length + self._start[a : a + self._n].reshape(system.position.shape)
            self._closing = -20.0 * (place - place.mean(0)).ravel() * system.scales.length / system.spacing
        self._idle = self._drag(np.zeros(self._n)) if self._closing is not None else 0.0

    def restore(self) -> None:
        """Put the body back into the state that it was in."""
        self.system.state.buffer.assign(self._start)
        self.system.refresh(self.system.state)

    def _assign(self, values: np.ndarray) -> None:
        self._moved.buffer.assign(values.astype(self.system.space.numpy))

    def _changes(self, w: np.ndarray) -> np.ndarray:
        """How what is integrated follows the strain of velocities eps w, and whatever it does at rest."""
        self._assign(np.concatenate([self._eps * w, self._start[self._n :]]))
        self.system.refresh(self.system.state)
        self.system.rate(self._moved, self._change, "rest")
        return self._change.buffer.numpy().astype(np.float64)

    def _accelerations(self, w: np.ndarray) -> np.ndarray:
        """a(u + eps w) with the velocities at rest."""
        shifted, base = self._start.astype(np.float64), self.system.state
        if self._resting is not None:
            increment = self._changes(w) - self._resting
            for name in (name for name in ("stress", "deformation") if name in base.start):
                a = base.start[name]
                b = a + base.counts[name] * base.widths[name]
                shifted[a:b] += increment[a:b]
        shifted[: self._n] = 0.0
        place = base.start["displacement"]
        shifted[place : place + self._n] += self._eps * w
        self._assign(shifted)
        self.system.rate(self._moved, self._change, "velocity")
        return self._change.buffer.numpy()[: self._n].astype(np.float64)

    def stiffness(self, x: np.ndarray) -> np.ndarray:
        """K x."""
        return -(self._accelerations(x / self.mass) - self._rest) / self._eps * self.mass * self.free

    def _drag(self, w: np.ndarray) -> np.ndarray:
        state = self._start.astype(np.float64)
        state[: self._n] = 1e-9 * (w if self._closing is None else w + self._closing)
        self._assign(state)
        self.system.rate(self._moved, self._change, "velocity")
        return -self._change.flat("drag").numpy().astype(np.float64) / 1e-9

    def damping(self, x: np.ndarray) -> np.ndarray:
        """D x, of all pairs."""
        size = float(np.abs(x / self.mass).max())
        return (self._drag(x / self.mass / size) - self._idle) * size * self.mass * self.free


class _Span:
    """Up to `most` orthonormal vectors and their products."""

    def __init__(self, products: Products, most: int, damped: bool):
        self._p, n = products, len(products.free)
        kind = np.float32 if n > LARGE else np.float64
        self._least = 1e-5 if n > LARGE else 1e-8
        self.count, self.most = 0, most
        self._w, self._k = np.empty((most, n), kind), np.empty((most, n), kind)
        self._d = np.empty((most if damped else 0, n), kind)

    def add(self, x: np.ndarray) -> np.ndarray:
        """Take what is new of x; its coefficients on the vectors (count,), NaN where x is zero or not finite."""
        size, held = float(np.linalg.norm(x)), self._w[: self.count]
        if not np.isfinite(size) or size == 0.0:
            return np.full(self.count, np.nan)
        coefficients, left = np.zeros(self.count + 1), x / size
        for _ in range(2):
            part = held @ left
            coefficients[:-1] += part
            left = left - part @ held
        new = float(np.linalg.norm(left))
        if new < self._least or self.count == self.most:
            return size * coefficients[:-1]
        coefficients[-1] = new
        self._w[self.count] = left / new
        vector = self._w[self.count].astype(np.float64)
        self._k[self.count] = self._p.stiffness(vector)
        if len(self._d):
            self._d[self.count] = self._p.damping(vector)
        self.count += 1
        return size * coefficients

    def last_stiffness(self) -> np.ndarray:
        """K times the last vector."""
        return self._k[self.count - 1].astype(np.float64)

    def next(self, last: np.ndarray, before: np.ndarray) -> np.ndarray:
        """-(D r_j + K r_(j-1)) of two vectors given by their coefficients."""
        return -(last @ self._d[: len(last)] + before @ self._k[: len(before)]).astype(np.float64)

    def spectrum(self, rate: float, still: float) -> Spectrum:
        """What the products say."""
        m = self.count
        w, k, d = self._w[:m], self._k[:m], self._d[:m]
        none = np.zeros((m, m))
        damping, kd, dd = (w @ d.T, k @ d.T, d @ d.T) if len(self._d) else (none, none, none)
        arrays = [np.asarray(a, np.float64) for a in (w @ k.T, damping, k @ k.T, kd, dd)]
        return Spectrum(arrays[0], arrays[1], (arrays[2], arrays[3], arrays[4]), rate, still)


def spectrum(system: Any) -> Spectrum:
    """The spectrum of a body about its current state, in at most 50 right-hand sides.

    A start vector at random in both signs has its share of every mode. Lanczos' method on K finds the outermost of the
    undamped modes. With viscosity the vectors r_(j+1) = -(D r_j + K r_(j-1)) of Bai & Su's second-order Krylov space (SIAM
    J. Matrix Anal. Appl. 26, 2005) follow, in which the modes of both are found; those that lie in the span already (all of
    them at first where D is as K) cost nothing and are gone through.
    """
    rate, still = float(system.force.struct.damping), STILL[system.space.precision]
    if not system.free_components.any():
        none = np.zeros((0, 0))
        return Spectrum(none, none, (none, none, none), rate, still)
    products = Products(system)
    lanczos, most = DAMPED_VECTORS if system.viscous else (VECTORS, VECTORS)
    span = _Span(products, most, system.viscous)
    start = np.random.default_rng(0).standard_normal(len(products.free)) * products.free
    span.add(start)
    while span.count < lanczos:
        known = span.count
        span.add(span.last_stiffness())
        if span.count == known:  # nothing new, or nothing finite
            break
    before, last = np.zeros(1), np.eye(1)[0]
    for _ in range(3 * most if system.viscous else 0):
        if span.count == most:
            break
        coefficients = span.add(span.next(last, before))
        size = float(np.linalg.norm(coefficients))
        if not size > 0.0:
            break
        before, last = last / size, coefficients / size
    products.restore()
    return span.spectrum(rate, still)
