"""The fastest waves and the strongest damping of a one-set body, from its own right-hand sides: what limits its time step.

Small motions are M u'' + D u' + K u = 0, and a step of any method multiplies each of their modes, exp(lambda t), by a number
of its own. Neither the largest frequency nor the largest damping rate says where that leaves 1 first: a wave that is damped
is held further than one that is not, and a method that amplifies waves stops at the one that is damped least for its
frequency. So K and D are projected on what a few dozen right-hand sides span, and the modes of the projection stand for the
body's. Its outermost modes are within a few per cent of those of the whole (tests/integrators/test_beam.py holds limits to
runs).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

LANCZOS = 20
"""Products of Lanczos' method for the largest frequency of a body without damping."""
DAMPED = (10, 14)
"""Of one with viscosity: products of Lanczos' method, then vectors of the second-order Krylov space of both, two products
each and one for each of the former: 49 right-hand sides."""
DAMPED_RATES = (7, 8)
"""The same where a product takes two right-hand sides, because stress is integrated."""
APPROACH = (0.5, 0.03, 0.2, 0.59)
"""Viscosity of what approaches acts on half of the pairs of a wave, but motion that it overdamps lasts longer in the half of
the time in which it is not damped, and in a front more than half of the pairs close: its damping is taken as .5 less .03
times the largest damping rate over the largest frequency, not below .2, and as .59 times the one on all pairs, whichever is
the worse. The numbers are from runs of the magnesium bar (`wsph validate --full bar-stability`), whose limits lie 0 to 20 %
above what they give."""
STILL = 1e-4
"""A mode slower than this part of the fastest is a motion of the rigid body."""


@dataclass(frozen=True)
class Spectrum:
    """What is known of the small motions of a body, nondimensional.

    `frequency` is the largest of the undamped body, an upper estimate, `growth` the largest rate of a mode that grows
    without oscillating, zero where none is sure. `stiffness` and `damping`, (m, m), are those of the body on m orthonormal,
    mass-weighted vectors; the damping is that of all pairs, whatever the kind of its viscosity. `rate` is that of the
    damping in proportion to mass.
    """

    frequency: float
    growth: float
    stiffness: np.ndarray
    damping: np.ndarray
    rate: float

    def pencils(self, shares: tuple[float, ...]) -> list[tuple[np.ndarray, np.ndarray]]:
        """Stiffness and whole damping where only a share of the viscosity acts, for every share."""
        one = np.eye(len(self.stiffness))
        return [(self.stiffness, share * self.damping + self.rate * one) for share in shares]

    @cached_property
    def viscous_rate(self) -> float:
        """The largest damping rate of the viscosity."""
        return float(np.linalg.eigvalsh(0.5 * (self.damping + self.damping.T))[-1]) if self.damping.any() else 0.0

    def approach(self) -> tuple[float, float]:
        """The least and the most of the viscosity that acts where it acts on approaching pairs alone."""
        start, slope, floor, most = APPROACH
        over = self.viscous_rate / self.frequency if self.frequency > 0.0 else 0.0
        return max(start - slope * over, floor), most


def modes(stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """lambda of lambda^2 + D lambda + K, (2 m,): without those of the rigid body and of what grows by itself."""
    m = len(stiffness)
    values = np.linalg.eigvals(np.block([[np.zeros((m, m)), np.eye(m)], [-stiffness, -damping]]))
    values = values[np.abs(values) > STILL * np.abs(values).max()] if m else values
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
        self.system.rate(self.system.state, self._change, "velocity")
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
    """Orthonormal vectors and their products."""

    def __init__(self, products: Products, damped: bool):
        self._p, self._damped = products, damped
        self.vectors: list[np.ndarray] = []
        self._k: list[np.ndarray] = []
        self._d: list[np.ndarray] = []

    def add(self, x: np.ndarray) -> np.ndarray | None:
        """Take what is new of x; its coefficients on the vectors, None where nothing is new."""
        size = float(np.linalg.norm(x))
        if not np.isfinite(size) or size == 0.0:
            return None
        coefficients, left = np.zeros(len(self.vectors) + 1), x / size
        for _ in range(2):
            for n, b in enumerate(self.vectors):
                c = b @ left
                coefficients[n] += c
                left = left - c * b
        coefficients[-1] = np.linalg.norm(left)
        if coefficients[-1] < 1e-8:
            return None
        self.vectors.append(left / coefficients[-1])
        self._k.append(self._p.stiffness(self.vectors[-1]))
        if self._damped:
            self._d.append(self._p.damping(self.vectors[-1]))
        return size * coefficients

    def stiffness(self, c: np.ndarray) -> np.ndarray:
        """K times the vector with coefficients c."""
        return c @ np.array(self._k[: len(c)])

    def damping(self, c: np.ndarray) -> np.ndarray:
        """D times the vector with coefficients c."""
        return c @ np.array(self._d[: len(c)])

    def projected(self) -> tuple[np.ndarray, np.ndarray]:
        """K and D on the vectors."""
        W, m = np.array(self.vectors), len(self.vectors)
        return W @ np.array(self._k).T, W @ np.array(self._d).T if self._damped else np.zeros((m, m))


def spectrum(system: Any) -> Spectrum:
    """The spectrum of a body about its current state, in at most 50 right-hand sides.

    A start vector at random in both signs has its share of every mode. Lanczos' method on K finds the largest frequency: the
    outermost Ritz values and their residuals. With viscosity the vectors r_(j+1) = -(D r_j + K r_(j-1)) of Bai & Su's
    second-order Krylov space (SIAM J. Matrix Anal. Appl. 26, 2005) follow, in which the modes of both are found.
    """
    rate = float(system.force.struct.damping)
    if not system.free_components.any():
        return Spectrum(0.0, 0.0, np.zeros((0, 0)), np.zeros((0, 0)), rate)
    products = Products(system)
    span = _Span(products, system.viscous)
    count, more = (DAMPED_RATES if products.evolved else DAMPED) if system.viscous else (LANCZOS, 0)
    start = np.random.default_rng(0).standard_normal(len(products.free)) * products.free
    span.add(start / np.linalg.norm(start))
    left = 0.0
    for k in range(1, count + 1):
        w = span.stiffness(np.eye(k)[k - 1])
        if not np.isfinite(w).all():
            products.restore()
            return Spectrum(np.inf, 0.0, *2 * [np.zeros((0, 0))], rate)
        if k == count:
            for b in span.vectors:
                w = w - (w @ b) * b
            left = float(np.linalg.norm(w))
        elif span.add(w) is None:
            break
    n = len(span.vectors)
    ritz = span.projected()[0]
    values, vectors = np.linalg.eigh(0.5 * (ritz + ritz.T))
    residuals = left * np.abs(vectors[-1])
    before, last = np.zeros(n), np.eye(n)[0]
    for _ in range(more):
        new = -(span.damping(last) + span.stiffness(before))
        size = float(np.linalg.norm(new))
        coefficients = span.add(new)
        if coefficients is None:
            break
        before, last = np.append(last, np.zeros(len(coefficients) - len(last))) / size, coefficients / size
    products.restore()
    fastest = float(np.sqrt(max(values[-1] + residuals[-1], 0.0)))
    growth = float(np.sqrt(max(-values[0] - residuals[0], 0.0)))
    return Spectrum(fastest, growth, *span.projected(), rate)
