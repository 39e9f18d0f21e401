"""Stiffness and damping of a body projected on what a few dozen of its right-hand sides span."""

# pyright: strict

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from wsph.backend.arrays import host, put
from wsph.backend.domain import Domain, Share, any_of, mean_of
from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.stability.margins import DAMPED_VECTORS, STILL, VECTORS
from wsph.stability.spectrum import Spectrum
from wsph.units import Scales

NOTHING = 1e-12
"""A next vector of Lanczos' method below this part of the largest eigenvalue is rounding: those so far span all."""

LARGE = 1_000_000
"""Numbers in a vector from which on vectors are kept in single precision: a limit needs two digits."""


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

    def project_free(self, velocity: np.ndarray) -> np.ndarray: ...

    def temporary(self) -> State: ...

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None: ...

    def refresh(self, state: State) -> None: ...


Found = Callable[["Multiplied", np.ndarray], Spectrum]
"""From products and a vector to start with to a spectrum."""


class Products:
    """K and D of a body about its current state times mass-weighted vectors, prescribed components held."""

    def __init__(self, system: Moving):
        self.system = system
        # In the run's own precision: a limit needs two digits, and of a large body a vector is as much as its state.
        self.kind = system.space.numpy
        self.mass = np.sqrt(np.repeat(system.volume, system.space.dim)).astype(self.kind)
        self._moved, self._change = system.temporary(), system.temporary()
        self._start = host(system.state.buffer).copy()
        self._velocity, self._place = system.state.span("velocity"), system.state.span("displacement")
        self.count = n = len(self.mass)
        self._eps = 1e-6 if system.space.precision == "f64" else 1e-2
        self._resting = self._changes(np.zeros(n)) if system.evolves else None
        self._rest = self._accelerations(np.zeros(n))
        self._closing: np.ndarray | None = None
        if system.one_sided:
            # All pairs approach each other, so fast that a vector changes nothing in that.
            place = system.position / system.scales.length + self._start[self._place].reshape(system.position.shape)
            middle = mean_of(system.domain, place[system.share.own])
            self._closing = -20.0 * (place - middle).ravel() * system.scales.length / system.spacing
        self._idle = self._drag(np.zeros(n)) if self._closing is not None else 0.0

    def restore(self) -> None:
        """Put the body back into the state that it was in."""
        put(self.system.state.buffer, self._start)
        self.system.refresh(self.system.state)

    def _assign(self, values: np.ndarray) -> None:
        put(self._moved.buffer, values.astype(self.kind, copy=False))

    def _changes(self, w: np.ndarray) -> np.ndarray:
        """The rates of stress or deformation under velocities eps w, and those at rest."""
        moved = self._start.copy()
        moved[self._velocity] = self._eps * w
        self._assign(moved)
        self.system.refresh(self._moved)
        self.system.rate(self._moved, self._change, "rest")
        return host(self._change.buffer).astype(np.float64)

    def _accelerations(self, w: np.ndarray) -> np.ndarray:
        """a(u + eps w) with the velocities at rest."""
        shifted, base = self._start.copy(), self.system.state
        if self._resting is not None:
            increment = self._changes(w) - self._resting
            for span in (base.span(name) for name in ("stress", "deformation", "deviation") if name in base.start):
                shifted[span] += increment[span]
        shifted[self._velocity] = 0.0
        shifted[self._place] += self._eps * w
        self._assign(shifted)
        self.system.rate(self._moved, self._change, "velocity")
        return host(self._change.buffer)[self._velocity].copy()

    def stiffness(self, x: np.ndarray) -> np.ndarray:
        """K x."""
        change = self._accelerations(x / self.mass)
        change -= self._rest
        change *= self.mass
        change *= -1.0 / self._eps
        return self.system.project_free(change)

    def _drag(self, w: np.ndarray) -> np.ndarray:
        state = self._start.astype(np.float64)
        state[self._velocity] = 1e-9 * (w if self._closing is None else w + self._closing)
        self._assign(state)
        self.system.rate(self._moved, self._change, "velocity")
        return -host(self._change.flat("drag")).astype(np.float64) / 1e-9

    def damping(self, x: np.ndarray) -> np.ndarray:
        """D x, of all pairs."""
        size = float(self.system.domain.max(np.abs(x / self.mass).max()))
        return self.system.project_free((self._drag(x / self.mass / size) - self._idle) * size * self.mass)


class Multiplied(Protocol):
    """What multiplies vectors (count,) of numbers of a `kind`."""

    count: int

    @property
    def kind(self) -> type[np.float32] | type[np.float64]: ...

    def stiffness(self, x: np.ndarray) -> np.ndarray: ...

    def damping(self, x: np.ndarray) -> np.ndarray: ...


class _Span:
    """Up to `most` orthonormal vectors and their products."""

    def __init__(self, products: Multiplied, most: int, damped: bool):
        self._p, n = products, products.count
        kind = np.float32 if n > LARGE else np.float64
        self._least = 1e-5 if n > LARGE else 1e-8
        self.count, self.most = 0, most
        self._w, self._k = np.empty((most, n), kind), np.empty((most, n), kind)
        self._d = np.empty((most if damped else 0, n), kind)

    def add(self, x: np.ndarray) -> np.ndarray:
        """Take what is new of x; its coefficients on the vectors (count,), NaN where x is zero or not finite."""
        size, held = math.sqrt(_dot(x, x)), self._w[: self.count]
        if not np.isfinite(size) or size == 0.0:
            return np.full(self.count, np.nan)
        coefficients, left = np.zeros(self.count + 1), x / size
        for _ in range(2):
            part = np.einsum("in,n->i", held, left)
            coefficients[:-1] += part
            left = left - np.einsum("i,in->n", part, held)
        new = math.sqrt(_dot(left, left))
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
        drag = np.einsum("i,in->n", last, self._d[: len(last)])
        return -(drag + np.einsum("i,in->n", before, self._k[: len(before)])).astype(np.float64)

    def spectrum(self, rate: float, still: float) -> Spectrum:
        """The spectrum that follows from the products."""
        m = self.count
        w, k, d = self._w[:m], self._k[:m], self._d[:m]
        none = np.zeros((m, m))
        damping, kd, dd = (_products(a, d) for a in (w, k, d)) if len(self._d) else (none, none, none)
        return Spectrum(_products(w, k), damping, (_products(k, k), kd, dd), rate, still)


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    """A scalar product without BLAS, whose threads take longer to start than these sums, and change their last bits."""
    return float(np.einsum("n,n->", a, b, dtype=np.float64))


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The scalar products of the rows of a and b, in double precision."""
    return np.einsum("in,jn->ij", a, b, dtype=np.float64)


def _symmetric(products: Multiplied, start: np.ndarray, rate: float, still: float) -> Spectrum:
    """The spectrum of an undamped body of symmetric stiffness from Lanczos' three terms: w_(j+1) beta_(j+1) = K w_j -
    alpha_j w_j - beta_j w_(j-1), so that K projected on the w is tridiagonal, K W = W T + beta_(m+1) w_(m+1) e_m^T, and
    of the vectors two are kept. They lose their orthogonality where an eigenvalue is found to rounding, which changes no
    outermost one."""
    size = math.sqrt(_dot(start, start))
    last = (start / (size or 1.0)).astype(products.kind)
    before = np.zeros_like(last)
    diagonal, beside = np.zeros(VECTORS), np.zeros(VECTORS)
    m, beta = 0, 0.0
    while m < VECTORS and size > 0.0:
        new = products.stiffness(last).astype(products.kind, copy=False)
        new -= products.kind(beta) * before
        diagonal[m] = _dot(new, last)
        new -= products.kind(diagonal[m]) * last
        beta = math.sqrt(_dot(new, new))
        beside[m] = beta
        m += 1
        if not np.isfinite(beta) or beta <= NOTHING * np.abs(diagonal[:m]).max():
            break
        new /= products.kind(beta)
        before, last = last, new
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

    A start vector at random in both signs has its share of every mode. Lanczos' method on K finds the outermost of the
    undamped modes. With viscosity the vectors r_(j+1) = -(D r_j + K r_(j-1)) of Bai & Su's second-order Krylov space (SIAM
    J. Matrix Anal. Appl. 26, 2005) follow, in which the modes of both are found; those that lie in the span already (all of
    them at first where D is as K) cost nothing and are gone through.
    """
    rate, still = system.damping_rate, STILL[system.space.precision]
    if not any_of(system.domain, bool(system.free_components.any())):
        none = np.zeros((0, 0))
        return Spectrum(none, none, (none, none, none), rate, still)
    products = Products(system)
    if system.domain.size > 1:
        found = shared(system, products, lambda whole, start: _found(system, whole, start, rate, still))
    else:
        start = system.project_free(np.random.default_rng(0).standard_normal(products.count))
        found = _found(system, products, start, rate, still)
    products.restore()
    return found


def _found(system: Moving, products: Multiplied, start: np.ndarray, rate: float, still: float) -> Spectrum:
    """The spectrum that the products of vectors from `start` on span."""
    if system.symmetric and not system.drags:
        return _symmetric(products, start, rate, still)
    lanczos, most = DAMPED_VECTORS if system.drags else (VECTORS, VECTORS)
    span = _Span(products, most, system.drags)
    span.add(start)
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
    return span.spectrum(rate, still)


class _Spread:
    """The products of a body that processes share, as the first of them has them: of vectors over the whole body, which
    all of them multiply."""

    def __init__(self, products: Products, count: int):
        self._products, self._system, self.kind = products, products.system, products.kind
        self._shape, self.count = (-1, products.system.space.dim), count

    def stiffness(self, x: np.ndarray) -> np.ndarray:
        """K x."""
        return self._multiplied("stiffness", x)

    def damping(self, x: np.ndarray) -> np.ndarray:
        """D x."""
        return self._multiplied("damping", x)

    def _multiplied(self, by: str, x: np.ndarray) -> np.ndarray:
        self._system.domain.told(lambda: by)
        return self.answer(by, x.reshape(self._shape)).ravel()

    def answer(self, by: str, rows: np.ndarray | None) -> np.ndarray:
        """A product: the rows of the whole in the first process."""
        domain, share = self._system.domain, self._system.share
        mine = domain.scattered(rows, share).ravel()
        found = self._products.stiffness(mine) if by == "stiffness" else self._products.damping(mine)
        return domain.gathered(found.reshape(self._shape)[share.own])


def shared(system: Moving, products: Products, find: Found) -> Spectrum:
    """The spectrum of a body that processes share: the first has the vectors, and asks the others for its products."""
    domain, share, dim = system.domain, system.share, system.space.dim
    spread, free = _Spread(products, share.whole * dim), system.project_free(np.ones(products.count))
    every = domain.gathered(free.reshape(-1, dim)[share.own])
    found: Spectrum | None = None
    if domain.rank > 0:
        while by := domain.told(str):
            spread.answer(by, None)
    else:
        try:
            start = np.random.default_rng(0).standard_normal(spread.count)
            found = find(spread, start * every.ravel())
        except BaseException as error:
            domain.fail(error)
            raise
        domain.told(str)
    made = domain.told(lambda: found)
    assert made is not None
    return made
