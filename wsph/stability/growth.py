"""The growth per step, measured: the largest eigenvalue of the linearised step about the current state.

Limits from interpolation weights hold for lattices. Jitter, corners and odd shapes have modes of their own, which only the
step itself knows. Arnoldi's method on blocks of steps finds them: a block raises what grows above the many modes that
merely oscillate.
"""

# pyright: strict

from collections.abc import Callable

import numpy as np

from wsph.backend.arrays import host, put
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.state import State
from wsph.ranks.blocks import Dots
from wsph.stability.margins import PRODUCTS


class _Products:
    """Scalar products of vectors over the fields of a state, a part of which each process has."""

    def __init__(self, state: State, share: Share | None, domain: Domain):
        """`share`: the particles that are here; all, where it is None."""
        self._spans = {name: state.span(name) for name in state.start}
        shares = {name: share or Share.all(count) for name, count in state.counts.items()}
        self._dots = {name: Dots(shares[name], domain, state.widths[name]) for name in self._spans}
        self._windows = {name: (shares[name], state.widths[name]) for name in self._spans}
        self.whole = sum(dots.whole for dots in self._dots.values())
        """Numbers of a vector of the whole body."""

    def every(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Those of a (n,) and the rows of b (m, n), (m,)."""
        found = np.zeros(len(b))
        for name, span in self._spans.items():
            found += self._dots[name].every(a[span], b[:, span])
        return found

    def length(self, a: np.ndarray) -> float:
        """That of a (n,)."""
        return float(np.sqrt(self.every(a, a[None])[0]))

    def random(self) -> np.ndarray:
        """A vector of random numbers, alike for any number of processes."""
        rng = np.random.default_rng(0)
        each = [
            rng.standard_normal((share.whole, width))[share.window].ravel() for share, width in self._windows.values()
        ]
        return np.concatenate(each)


def largest_growth(step: Callable[[], None], state: State, block: int = 100, products: int = PRODUCTS,
                   units: dict[str, float] | None = None, share: Share | None = None,
                   domain: Domain = WHOLE) -> float:  # fmt: skip
    """Growth per step, |eigenvalue| - 1, of the fastest growing mode that is resolved; not above zero where none is.

    `step` advances `state` by launches; its clock stands still, so prescribed values are those of the start. The state is
    left as it was. Costs (products + 1) * block steps. What grows by less than a few per cent in a block may be missed
    among modes that only oscillate: on blocks of 64 nodes growth of 2e-4 to 9e-4 a step was found to 1 % with 40 products
    of 100 steps, one of 2.3e-4 among many like it was not. The state is in double precision: in single, rounding grows.
    `units`: sizes of fields, one where not said; a body that is far softer than another has its own. `share`: the particles
    that a process of the `domain` has, all of whose processes call this together.
    """
    origin, size, product = host(state.buffer).copy(), 1e-5, _Products(state, share, domain)
    unit = np.ones(len(origin))
    for name, value in (units or {}).items():
        if name in state.start:
            unit[state.span(name)] = value

    def advanced(start: np.ndarray) -> np.ndarray:
        put(state.buffer, start)
        for _ in range(block):
            step()
        return host(state.buffer).copy()

    rest = advanced(origin)
    basis = np.zeros((products + 1, len(origin)))
    hessenberg = np.zeros((products + 1, products))
    start = product.random()
    basis[0] = start / product.length(start)
    kept = products
    for k in range(products):
        scale = size * np.sqrt(product.whole)
        w = (advanced(origin + scale * unit * basis[k]) - rest) / (scale * unit)
        for _ in range(2):  # once more: what is left after the first sweep is not orthogonal to rounding
            along = product.every(w, basis[: k + 1])
            hessenberg[: k + 1, k] += along
            for part, row in zip(
                along, basis, strict=False
            ):  # one after the other: the same bits wherever a row stands
                w -= part * row
        hessenberg[k + 1, k] = product.length(w)
        if not np.isfinite(hessenberg[k + 1, k]):
            kept = k
            break
        if hessenberg[k + 1, k] <= 1e-12:
            kept = k + 1
            break
        basis[k + 1] = w / hessenberg[k + 1, k]
    put(state.buffer, origin)
    if kept == 0:
        return np.inf
    values, vectors = np.linalg.eig(hessenberg[:kept, :kept])
    sizes = np.abs(values)
    residual = hessenberg[kept, kept - 1] * np.abs(vectors[-1]) if kept < products + 1 else 0.0 * sizes
    # A step is far from normal: what looks like growth but is not resolved may be none.
    sure = sizes - residual > 1.0
    radius = float(sizes[sure].max()) if sure.any() else min(1.0, float(sizes.max()))
    return radius ** (1.0 / block) - 1.0
