"""Stiffness and damping of a body projected on what a few dozen of its right-hand sides span."""

# pyright: strict

import math
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from wsph.backend.arrays import host, put
from wsph.backend.domain import Domain, Share, any_of
from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.ranks.blocks import Dots, own_mean
from wsph.stability.margins import DAMPED_VECTORS, STILL, VECTORS
from wsph.stability.spectrum import Spectrum
from wsph.units import Scales

NOTHING = 1e-12
"""A next vector of Lanczos' method below this part of the largest eigenvalue is rounding: those so far span all."""

LARGE = 1_000_000
"""Numbers in a vector from which on vectors are kept in single precision: a limit needs two digits."""

ROWS = 2**14
"""Particles whose numbers are computed at once."""

FOLLOWING = ("stress", "deformation", "deviation")
"""Fields that follow from the displacements, and are integrated where a law or a form evolves them."""


class Moving(Protocol):
    """A one-set body, as its spectrum is found from it."""

    space: Space
    scales: Scales
    domain: Domain
    share: Share
    position: np.ndarray
    volume: np.ndarray
    spacing: float
    state: State
    points: bool
    one_sided: bool
    """Whether drag acts on approach alone."""
    drags: bool
    """Whether there are forces that depend on velocities."""
    resisted: bool
    """Whether some of those are of loads, which act whatever the motion is."""
    evolves: bool
    """Whether stress or deformation is integrated, and does not follow from the displacements."""
    symmetric: bool
    """Whether its stiffness is that of an energy: no load follows it, and its stress is a function of its deformation."""
    damping_rate: float
    """Rate of the damping in proportion to mass, nondimensional."""

    @property
    def free_components(self) -> np.ndarray: ...

    def project_free(self, velocity: np.ndarray) -> np.ndarray:
        """Its array of velocities, (n dim,), with what is prescribed taken out; that array, or another."""
        ...

    def spares(self, count: int) -> list[State]:
        """So many states, zero or to be thrown away."""
        ...

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None: ...

    def refresh(self, state: State) -> None: ...


class Products:
    """K and D of a body about its current state times mass-weighted vectors, prescribed components held.

    Of a large body a vector is as much as its state. So they are in the run's own precision, of which a limit needs two
    digits, what is put into the body is written where it takes it, some rows at a time, and a product stands where the body
    left it, until the next is asked for. Of a body that processes share each has the numbers of what it holds, and all ask
    for the same products together.
    """

    def __init__(self, system: Moving):
        self.system = system
        self.kind = system.space.numpy
        self._eps = 1e-6 if system.space.precision == "f64" else 1e-2
        self._root = np.sqrt(system.volume).astype(self.kind)[:, None]
        self._start = host(system.state.buffer)
        # Forces that follow from where particles are may stand where their velocities do, which are zero.
        self._states = system.spares(2 if system.evolves or system.drags else 1)
        self._moved, self._change = self._states[0], self._states[-1]
        self._numbers = host(self._moved.buffer)
        self._there = np.shares_memory(self._numbers, host(self._moved.buffer))
        self._numbers[:] = self._start
        self._spans = {name: system.state.span(name) for name in FOLLOWING if name in system.state.start}
        self.count = len(self._root) * system.space.dim
        none = np.broadcast_to(np.zeros(1), self.count)
        self._resting = self._changes(none, kept=True) if system.evolves else None
        self._rest = self._accelerations(none).copy()
        self._closing: np.ndarray | None = None
        if system.one_sided:
            # All pairs approach each other, so fast that a vector changes nothing in that.
            place = system.position / system.scales.length + self._field(self._start, "displacement")
            middle = own_mean(place, system.share, system.domain)
            self._closing = -20.0 * (place - middle) * system.scales.length / system.spacing
        self._halo = system.domain.halo(system.share)
        self._idle = self._drag(none) if self._closing is not None else 0.0

    def restore(self) -> None:
        """Leave the body in the state that it was in; there are no products after."""
        for state in self._states:
            state.buffer.zero_()
        self.system.refresh(self.system.state)

    def _field(self, numbers: np.ndarray, name: str) -> np.ndarray:
        """Vectors of the particles among those of a state, (n, dim), a view."""
        return self._rows(numbers[self.system.state.span(name)])

    def _rows(self, x: np.ndarray) -> np.ndarray:
        return x.reshape(-1, self.system.space.dim)

    def _pieces(self) -> Iterator[slice]:
        """Rows of particles, some at a time."""
        return (slice(first, first + ROWS) for first in range(0, len(self._root), ROWS))

    def _put(self) -> None:
        """Have the body take the numbers, which on the CPU stand where it does."""
        if not self._there:
            put(self._moved.buffer, self._numbers)

    def _changes(self, x: np.ndarray, *, kept: bool = False) -> dict[str, np.ndarray]:
        """The rates of stress or deformation under velocities eps M^(-1/2) x; copies, or views until the next."""
        self._numbers[:] = self._start
        velocity, x = self._field(self._numbers, "velocity"), self._rows(x)
        for rows in self._pieces():
            velocity[rows] = self._eps * (x[rows] / self._root[rows])
        self._put()
        self.system.refresh(self._moved)
        self.system.rate(self._moved, self._change, "rest")
        found = host(self._change.buffer)
        return {name: found[span].copy() if kept else found[span] for name, span in self._spans.items()}

    def _accelerations(self, x: np.ndarray) -> np.ndarray:
        """a(u + eps M^(-1/2) x) with the velocities at rest, (n, dim)."""
        if self._resting is not None:
            for name, change in self._changes(x).items():
                resting, moved = self._resting[name], self._numbers[self._spans[name]]
                for first in range(0, len(moved), ROWS):
                    some = slice(first, first + ROWS)
                    moved[some] += change[some].astype(np.float64) - resting[some]
        self._field(self._numbers, "velocity")[:] = 0.0
        start, moved = (self._field(each, "displacement") for each in (self._start, self._numbers))
        x = self._rows(x)
        for rows in self._pieces():
            moved[rows] = start[rows] + self._eps * (x[rows] / self._root[rows])
        self._put()
        self.system.rate(self._moved, self._change, "velocity")
        return self._field(host(self._change.buffer), "velocity")

    def stiffness(self, x: np.ndarray) -> np.ndarray:
        """K x, (n dim,), which the next product overwrites."""
        change = self._accelerations(x)
        for rows in self._pieces():
            change[rows] -= self._rest[rows]
            change[rows] *= self._root[rows]
            change[rows] *= -1.0 / self._eps
        return self.system.project_free(change.reshape(-1))

    def _drag(self, x: np.ndarray, size: float = 1.0) -> np.ndarray:
        """Minus the drag of velocities M^(-1/2) x/size, (n, dim), in double precision."""
        self._numbers[:] = self._start
        velocity, x = self._field(self._numbers, "velocity"), self._rows(x)
        for rows in self._pieces():
            w = x[rows] / self._root[rows] / size
            velocity[rows] = 1e-9 * (w if self._closing is None else w + self._closing[rows])
        self._put()
        self.system.rate(self._moved, self._change, "velocity")
        drag = -self._rows(host(self._change.flat("drag"))).astype(np.float64) / 1e-9
        self._halo.fill(drag)
        return drag

    def damping(self, x: np.ndarray) -> np.ndarray:
        """D x, (n dim,), of all pairs."""
        own = self.system.share.own
        parts = (slice(first, min(first + ROWS, own.stop)) for first in range(own.start, own.stop, ROWS))
        size = float(max(np.abs(self._rows(x)[rows] / self._root[rows]).max() for rows in parts))
        size = float(self.system.domain.max(np.array(size)))
        drag = self._drag(x, size)
        drag -= self._idle
        drag *= size
        drag *= self._root
        return self.system.project_free(drag.reshape(-1))


class _Span:
    """Up to `most` orthonormal vectors and their products."""

    def __init__(self, products: Products, dots: Dots, most: int, damped: bool):
        self._p, self._dots, n = products, dots, products.count
        large = dots.whole > LARGE
        kind = np.float32 if large else np.float64
        self._least = 1e-5 if large else 1e-8
        self.count, self.most = 0, most
        self._w, self._k = np.empty((most, n), kind), np.empty((most, n), kind)
        self._d = np.empty((most if damped else 0, n), kind)

    def add(self, x: np.ndarray) -> np.ndarray:
        """Take what is new of x; its coefficients on the vectors (count,), NaN where x is zero or not finite."""
        size, held = math.sqrt(self._dots.one(x, x)), self._w[: self.count]
        if not np.isfinite(size) or size == 0.0:
            return np.full(self.count, np.nan)
        coefficients, left = np.zeros(self.count + 1), x / size
        for _ in range(2):
            part = self._dots.every(left, held)
            coefficients[:-1] += part
            left -= _combined(part, held)
        new = math.sqrt(self._dots.one(left, left))
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
        return -(_combined(last, self._d) + _combined(before, self._k))

    def spectrum(self, rate: float, still: float) -> Spectrum:
        """The spectrum that follows from the products."""
        m = self.count
        w, k, d = self._w[:m], self._k[:m], self._d[:m]
        none = np.zeros((m, m))
        of = self._dots.products
        damping, kd, dd = (of(a, d) for a in (w, k, d)) if len(self._d) else (none, none, none)
        return Spectrum(of(w, k), damping, (of(k, k), kd, dd), rate, still)


def _combined(factors: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """The sum of some `vectors` (m, n) times `factors` (k,), element by element, in double precision."""
    total = np.zeros(vectors.shape[1])
    for factor, vector in zip(factors, vectors, strict=False):
        total += factor * vector
    return total


def _start(system: Moving) -> np.ndarray:
    """A vector at random in both signs, (n dim,), which has its share of every free mode. Processes that share a body go
    through the numbers of all of it, and keep those of what they hold."""
    dim, share, numbers = system.space.dim, system.share, np.random.default_rng(0)
    found = np.empty(share.held * dim)
    for begin in range(0, share.whole, ROWS):
        some = numbers.standard_normal((min(ROWS, share.whole - begin), dim))
        low, high = (min(max(place, begin), begin + len(some)) for place in (share.first, share.first + share.held))
        found[(low - share.first) * dim : (high - share.first) * dim] = some[low - begin : high - begin].ravel()
    return system.project_free(found)


def _symmetric(system: Moving, dots: Dots, rate: float, still: float) -> Spectrum:
    """The spectrum of an undamped body of symmetric stiffness from Lanczos' three terms: w_(j+1) beta_(j+1) = K w_j -
    alpha_j w_j - beta_j w_(j-1), so that K projected on the w is tridiagonal, K W = W T + beta_(m+1) w_(m+1) e_m^T, and
    of the vectors two are kept. They lose their orthogonality where an eigenvalue is found to rounding, which changes no
    outermost one."""
    kind, last = system.space.numpy, _start(system)
    size = math.sqrt(dots.one(last, last))
    last /= size or 1.0
    last = last.astype(kind, copy=False)
    before, products = np.zeros_like(last), Products(system)
    diagonal, beside = np.zeros(VECTORS), np.zeros(VECTORS)
    m, beta = 0, 0.0
    while m < VECTORS and size > 0.0:
        new = products.stiffness(last)
        before *= kind(beta)
        new -= before
        diagonal[m] = dots.one(new, last)
        new -= np.multiply(last, kind(diagonal[m]), out=before)
        beta = math.sqrt(dots.one(new, new))
        beside[m] = beta
        m += 1
        if not np.isfinite(beta) or beta <= NOTHING * np.abs(diagonal[:m]).max():
            break
        before, last = last, np.divide(new, kind(beta), out=before)
    products.restore()
    projected = (
        np.diag(diagonal[:m]) + np.diag(beside[: m - 1], 1) + np.diag(beside[: m - 1], -1) if m else np.zeros((0, 0))
    )
    square = projected @ projected
    if m:
        square[-1, -1] += beside[m - 1] ** 2
    none = np.zeros((m, m))
    return Spectrum(projected, none, (square, none, none), rate, still)


def spectrum(system: Moving) -> Spectrum:
    """The spectrum of a body about its current state, in at most 50 right-hand sides.

    Lanczos' method on K finds the outermost of the undamped modes. With viscosity the vectors r_(j+1) = -(D r_j + K r_(j-1))
    of Bai & Su's second-order Krylov space (SIAM J. Matrix Anal. Appl. 26, 2005) follow, in which the modes of both are
    found; those that lie in the span already (all of them at first where D is as K) cost nothing and are gone through.
    """
    rate, still = system.damping_rate, STILL[system.space.precision]
    if not any_of(system.domain, bool(system.free_components.any())):
        none = np.zeros((0, 0))
        return Spectrum(none, none, (none, none, none), rate, still)
    dots = Dots(system.share, system.domain, system.space.dim)
    if system.symmetric and not system.drags:
        return _symmetric(system, dots, rate, still)
    products = Products(system)
    lanczos, most = DAMPED_VECTORS if system.drags else (VECTORS, VECTORS)
    span = _Span(products, dots, most, system.drags)
    span.add(_start(system))
    while span.count < lanczos:
        known = span.count
        span.add(span.last_stiffness())
        if span.count == known:  # nothing new, or nothing finite
            break
    before, last = np.zeros(1), np.eye(1)[0]
    for _ in range(3 * most if system.drags else 0):
        if span.count == most:
            break
        coefficients = span.add(span.next(last, before))
        size = float(np.linalg.norm(coefficients))
        if not size > 0.0:
            break
        before, last = last / size, coefficients / size
    products.restore()
    return span.spectrum(rate, still)
