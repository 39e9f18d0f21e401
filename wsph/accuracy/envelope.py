"""The error of the finest of three or four rows by their differences alone, and the bar that is put on it.

One order is fitted to the differences of all pairs of rows by least squares, and held between bounds; each difference of
neighbours is brought to the finest row by it; the largest is the estimate. A lucky small last difference cannot shrink it
(of grids; of fitted cells by half its logarithm at most), and norms of differences have no sign by which they could cancel.
Over 3508 windows of 17 scenes the bar, 1.5 times the estimate, held in 99 % at twice the true error in the median; Roache's
grid convergence index 1.25 with the order as found held in 77 %, and 3 with the formal order in 97 % at three times.

Cells that are fitted to a surface are no refined ones of each other: a part of the error of a row is its own, differences
have those of two rows, and a small ratio of spacings magnifies them: such estimates are twice the true error. There one
with a part that no other row has is fitted to all pairs beside the envelope. That alone may be too small, by a third, for
a few rows do not tell both parts for sure: the estimate is the geometric mean of both. Orders of 1.4 to 2 are seen there,
and rise with finer cells, so that what is fitted to rows that are coarser is above that of the finest: no order is taken to
be above 1.7. That, and the least that the own part is sought with, was chosen on rows of six bodies, and then judged by
those of five others, of which one had shown that it was needed.

    from wsph.accuracy.envelope import estimate
    found = estimate(spacings, distances(records), formal=2.0)      # both finest first
    found.error, found.bar, found.order, found.converges

Sources: Roache, J. Fluids Eng. 116 (1994) 405 (the index); Eça & Hoekstra, J. Comput. Phys. 262 (2014) 104 (least squares
over more rows than needed); the envelope and its constants by measurement (tests/benchmarks/coverage.py).
"""

# pyright: strict

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

FEWEST, KEEP = 3, 4
"""Rows without which there is no estimate; the finest that are looked at."""

BAR, BAR_OF_STAIRS = 1.5, 1.0
"""The bar as a multiple of the estimate; of staircases, where estimates are too large by themselves."""

LEAST_ORDER = {1.0: 0.4, 2.0: 1.0}
"""The lowest order that differences are scaled by, by the formal one."""

ORDERS_OF_FITTED = 1.5, 1.7
"""The least order of cells that are fitted to a surface where each row has its own part, and the highest."""

ORDERS = np.arange(0.05, 4.0005, 0.005)
"""Orders among which the fitted one is sought."""

FLOOR = {"f64": 1e-6, "f32": 2e-4}
"""Differences below which rows are the same but for rounding, by the precision of the run."""

GROWTH, SHRINK = 1.25, 0.5
"""No convergence: differences a unit of log h that grow by this factor over three neighbours, or the span of all four rows
below this part of what the last two would make it."""

SCATTER = 0.6
"""No convergence: differences of histories that are, in the mean over all pairs of four rows, off by this in their logarithm
from those of any order that is used. Of 764 windows on scenes that converge the worst is off by .55, half by under .05."""

SCATTER_TORN = 0.2
"""The same where the area of cracks has no limit (`boundless`): what has to do with them has none, and differences may fall
by chance. Six in seven of those windows follow an order as closely, and none of a strip that comes to pieces at ten
rates."""

NEGLIGIBLE = 0.1
"""Part of the tolerance below which differences may do as they like."""


@dataclass(frozen=True)
class Estimate:
    """What rows say of the finest: its relative `error` (estimated) and the `bar` that the true one should be within; the
    `order` that differences were scaled by, and `seen`, the fitted one; whether they showed convergence (`converges`);
    `differences` of neighbours, finest first. Without convergence there is no bar: it is infinite."""

    error: float
    bar: float
    order: float
    seen: float
    converges: bool
    differences: tuple[float, ...]

    @property
    def clamped(self) -> bool:
        """Whether the order fitted is below the least that is used."""
        return self.seen < self.order

    @property
    def lost(self) -> "Estimate":
        """The same without convergence."""
        return replace(self, bar=math.inf, converges=False)


def fitted_order(spacings: np.ndarray, distances: np.ndarray) -> float:
    """The order q for which the differences (k, k) of k rows come nearest to c |h_i^q - h_j^q|, in their logarithms and over
    all pairs; `spacings` (k,)."""
    return float(ORDERS[np.argmin(_scatter(spacings, distances))])


def _scatter(spacings: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """How far differences are from those of each of the ORDERS, the standard deviation in logarithms, (orders,)."""
    first, other = np.triu_indices(len(spacings), 1)
    h = np.asarray(spacings, float) / float(np.min(spacings))
    powers = h[None, :] ** ORDERS[:, None]
    ratios = np.log(distances[first, other])[None, :] - np.log(np.abs(powers[:, first] - powers[:, other]))
    return np.asarray(ratios.std(axis=1))


def estimate(
    spacings: Sequence[float],
    distances: np.ndarray,
    formal: float,
    *,
    tolerance: float = 0.0,
    floor: float = FLOOR["f64"],
    bar: float = BAR,
    norms: bool = True,
    fitted: bool = False,
    torn: bool = False,
) -> Estimate:
    """The error of the first of k rows, the finest; no more than the four finest are looked at.

    `spacings` (k,) in any unit, finest first, `distances` (k, k) of one column (`wsph.accuracy.measures.distances`);
    `formal`: the order that the scheme has on the scene, 1 or 2; differences below a tenth of the `tolerance` need not
    converge; `floor` of rounding; `bar`: the multiple of the estimate; `norms`: whether distances are norms, as of
    histories, and not of numbers, which coincide by luck; `fitted`: whether cells of rows are fitted to a surface, each by
    themselves; `torn`: whether cracks have no limit of their area, so that differences have to follow an order closely.
    Raises ValueError for fewer than three rows, or spacings that do not rise."""
    h, d = np.asarray(spacings, float)[:KEEP], np.asarray(distances, float)[:KEEP, :KEEP]
    if len(h) < FEWEST:
        raise ValueError(f"{len(h)} rows give no estimate: at least {FEWEST} are needed")
    if not (np.diff(h) > 0.0).all():
        raise ValueError(f"spacings {h.tolist()} do not rise: give the finest row first")
    neighbours = tuple(float(d[k, k + 1]) for k in range(len(h) - 1))
    if not np.isfinite(d).all():
        return Estimate(math.inf, math.inf, math.nan, math.nan, False, neighbours)
    if float(d.max()) < floor:
        return Estimate(0.0, 0.0, formal, formal, True, neighbours)
    d = np.maximum(d, floor)
    seen, highest = fitted_order(h, d), min(formal, ORDERS_OF_FITTED[1]) if fitted else formal
    order = min(max(seen, LEAST_ORDER[formal]), highest)
    error = max(_scaled(h, d, k, order) for k in range(len(h) - 1))
    if fitted and norms:
        error = math.sqrt(error * min(own_part(h, d), error))
    least, most = LEAST_ORDER[formal] if norms or torn else None, SCATTER_TORN if torn else SCATTER
    converges = len(h) < KEEP or neighbours[0] <= NEGLIGIBLE * tolerance or _converges(h, d, least, most)
    return Estimate(error, bar * error if converges else math.inf, order, seen, converges, neighbours)


def _scaled(h: np.ndarray, d: np.ndarray, k: int, order: float) -> float:
    """The error of the finest row by the difference of the k-th and its neighbour."""
    return float(d[k, k + 1] / ((h[k + 1] / h[0]) ** order - (h[k] / h[0]) ** order))


def own_part(spacings: np.ndarray, distances: np.ndarray) -> float:
    """The error of the first of k rows with one part that all have alike and one that is each row's own: distances (k, k)
    are sqrt(a (h_i^p - h_j^p)^2 + b (h_i^2p + h_j^2p)), with a and b not below zero and the order p one of
    ORDERS_OF_FITTED or between them, by least squares of relative squares over all pairs; the error is sqrt(a + b) h_0^p."""
    orders = np.linspace(*ORDERS_OF_FITTED, 11)
    return min(_two_parts(spacings, distances, float(each)) for each in orders)[1]


def _two_parts(spacings: np.ndarray, distances: np.ndarray, order: float) -> tuple[float, float]:
    """The sum of squares that is left at an order, and the error."""
    first, other = np.triu_indices(len(spacings), 1)
    powers = (spacings / spacings[0]) ** order
    d = distances[first, other]
    alike: np.ndarray = ((powers[first] - powers[other]) / d) ** 2
    own: np.ndarray = (powers[first] ** 2 + powers[other] ** 2) / d**2
    a, b = np.linalg.lstsq(np.stack([alike, own], 1), np.ones(len(d)), rcond=None)[0].tolist()
    tried = (
        [(a, b)]
        if min(a, b) >= 0.0
        else [(float(alike.sum() / (alike @ alike)), 0.0), (0.0, float(own.sum() / (own @ own)))]
    )
    return min((float(((a * alike + b * own - 1.0) ** 2).sum()), math.sqrt(a + b)) for a, b in tried)


def _converges(h: np.ndarray, d: np.ndarray, least: float | None, most: float) -> bool:
    """Whether the differences of four rows fall with their spacings and, where a `least` order is given, follow one with
    `most` scatter."""
    per_octave = [float(d[k, k + 1] / np.log(h[k + 1] / h[k])) for k in range(KEEP - 1)]
    span = d[0, 3] / d[0, 1] * np.log(h[1] / h[0]) / np.log(h[3] / h[0])
    if per_octave[0] > GROWTH * per_octave[2] or span < SHRINK:
        return False
    return least is None or float(_scatter(h, d)[least <= ORDERS].min()) <= most


def boundless(spacings: Sequence[float], sizes: Sequence[float]) -> bool:
    """Whether a size of four rows, as the area of the cracks in them, grows with every finer one, and by more an octave than
    before: then it has no limit. One that comes to a limit grows by less and less.

    `spacings` and `sizes` (k,), finest first; False for fewer rows."""
    if len(sizes) < KEEP:
        return False
    growth: np.ndarray = -np.diff(sizes[:KEEP]) / np.diff(np.log(spacings[:KEEP]))
    return bool((growth > 0.0).all() and growth[0] > GROWTH * growth[2])


def disagree(bar: float, other: float, apart: float) -> bool:
    """Whether two answers that differ by `apart` cannot both be within their bars.

    Bars see no wrong limit: of 301 pairs with a wrong bar this told 94, and of 1385 right ones none."""
    return apart > bar + other
