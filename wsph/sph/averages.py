"""Averages on the host, for output: linear-exact interpolation that looks as far as it has to and through no crack.

Extrapolation to a face leaves the range of what it is made of, as it has to for a bending stress. Of a quantity with bounds
of its own, such as a plastic strain or a damage, a bounded average is the nearest value within that range.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.backend.arrays import host, put
from wsph.backend.space import Space
from wsph.geometry.geometry import Geometry
from wsph.sph.pairs import Pairs, find_pairs_once
from wsph.sph.weights import Weights, interpolation_weights

OUTWARDS = 1.2
"""Support with which particles on faces read points inside [cells]."""

FARTHEST = 6.0
"""Reach from which a target looks no further [cells]."""

WIDER = 1.5
"""Growth of the reach of a target that looks further."""

BEYOND = 2.0
"""Sum of the sizes of weights beyond which they are ill-conditioned, above the number of dimensions. At the corner of a
regular lattice it is one above."""


def farthest(support: float) -> float:
    """The reach that a target can come to that begins with a support [cells]."""
    while support <= FARTHEST:
        support *= WIDER
    return support


def average(weights: Weights, values: np.ndarray) -> np.ndarray:
    """Interpolate `values` (sources, k) on the host, (targets, k)."""
    indices, w, row = host(weights.pairs.indices), host(weights.values), weights.pairs.rows()
    return np.stack(
        [np.bincount(row, w * values[indices, c], weights.pairs.targets) for c in range(values.shape[1])], 1
    )


def ranges(weights: Weights, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least of `low` and the largest of `high` (sources, k) among the sources of each target, (targets, k) each;
    infinite where it has none."""
    indices, offsets = host(weights.pairs.indices), host(weights.pairs.offsets)
    some = np.flatnonzero(np.diff(offsets))
    least = np.full((weights.pairs.targets, low.shape[1]), -np.inf)
    most = -least
    if len(some):
        least[some] = np.minimum.reduceat(low[indices], offsets[some], axis=0)
        most[some] = np.maximum.reduceat(high[indices], offsets[some], axis=0)
    return least, most


def bounded_average(weights: Weights, values: np.ndarray) -> np.ndarray:
    """As `average`, brought back to the range of the sources of each target."""
    return np.clip(average(weights, values), *ranges(weights, values, values))


@dataclass(frozen=True)
class Averages:
    """Weighted averages over places by themselves: target i has the `places` and `weights` from `offsets[i]` to
    `offsets[i + 1]`. offsets (targets + 1,), places (terms,), weights (terms,)."""

    offsets: np.ndarray
    places: np.ndarray
    weights: np.ndarray

    @classmethod
    def of(cls, weights: Weights) -> "Averages":
        """Those of an interpolation."""
        return cls(*(host(each).copy() for each in (weights.pairs.offsets, weights.pairs.indices, weights.values)))

    @classmethod
    def nothing(cls, count: int) -> "Averages":
        """Targets of which nothing is read yet."""
        return cls(np.zeros(count + 1, int), np.zeros(0, int), np.zeros(0))

    @classmethod
    def themselves(cls, places: np.ndarray) -> "Averages":
        """Each of the `places` (n,) as it is."""
        return cls(np.arange(len(places) + 1), places, np.ones(len(places)))

    @property
    def count(self) -> int:
        """Targets."""
        return len(self.offsets) - 1

    @property
    def rows(self) -> np.ndarray:
        """The target of every term, (terms,)."""
        return np.repeat(np.arange(self.count), np.diff(self.offsets))

    def only(self, targets: np.ndarray) -> "Averages":
        """Those of `targets` (n,) alone, in their order."""
        return self._spread(targets, np.ones(len(targets)), np.arange(len(targets)), len(targets))

    def through(self, inner: "Averages") -> "Averages":
        """Averages of averages: the places of these are the targets of `inner`. A place stands once in each."""
        return inner._spread(self.places, self.weights, self.rows, self.count)._joined()

    def together(self, share: float) -> "Averages":
        """One target: the sum of all, times `share`."""
        whole = np.array([0, len(self.places)])
        return Averages(whole, self.places, share * self.weights)._joined()

    def but(self, others: np.ndarray, averages: "Averages") -> "Averages":
        """These, with the targets of `averages` in the place of `others` (k,), in that order."""
        there = np.arange(self.count)
        there[others] = self.count + np.arange(len(others))
        both = Averages(
            np.concatenate([self.offsets, self.offsets[-1] + averages.offsets[1:]]),
            np.concatenate([self.places, averages.places]),
            np.concatenate([self.weights, averages.weights]),
        )
        return both.only(there)

    def _spread(self, targets: np.ndarray, factors: np.ndarray, rows: np.ndarray, count: int) -> "Averages":
        """The terms of `targets` (n,), each times its factor, one after the other; `rows` (n,), ascending, are their new
        targets of which there are `count`."""
        lengths = np.diff(self.offsets)[targets]
        ends = np.cumsum(lengths)
        where = np.arange(ends[-1] if len(ends) else 0) + np.repeat(self.offsets[targets] - (ends - lengths), lengths)
        sizes = np.bincount(rows, lengths, count).astype(int)
        weights = np.repeat(factors, lengths) * self.weights[where]
        return Averages(np.concatenate([[0], np.cumsum(sizes)]), self.places[where], weights)

    def _joined(self) -> "Averages":
        """Places that a target has twice become one, in the order of the places."""
        most = int(self.places.max()) + 1 if len(self.places) else 1
        keys, place = np.unique(self.rows * most + self.places, return_inverse=True)
        offsets = np.searchsorted(keys, np.arange(self.count + 1) * most)
        return Averages(offsets, keys % most, np.bincount(place, self.weights, len(keys)))


def visible(pairs: Pairs, geometry: Geometry, targets: np.ndarray, sources: np.ndarray) -> Pairs:
    """Pairs whose line crosses no crack. `targets` (n, dim) and `sources` (m, dim) in grid coordinates, off the cracks."""
    if not geometry.cracks:
        return pairs
    return pairs.where(~geometry.crossed(targets[pairs.rows()], sources[host(pairs.indices)]))


def spanning_weights(
    geometry: Geometry,
    support: float,
    points: tuple[np.ndarray, np.ndarray],
    off_cracks: tuple[np.ndarray, np.ndarray],
    volume: np.ndarray,
) -> Weights:
    """Linear-exact interpolation for output, `points` = (targets, sources) in cells: a target looks further than `support`
    until its sources span every direction, so well that no weight is large. `off_cracks`: the same in grid coordinates,
    moved off the cracks. A target that finds no such sources has a mean, which is exact for constants alone."""
    targets, sources = points
    reach = np.full(len(targets), support)
    dim = sources.shape[1]
    while True:
        pairs = visible(find_pairs_once(targets, sources, reach), geometry, *off_cracks)
        weights = interpolation_weights(Space(dim), pairs, targets, sources, volume)
        large = np.bincount(pairs.rows(), np.abs(host(weights.values)), len(targets)) > dim + BEYOND
        narrow = (weights.rank < dim) | large
        if not narrow.any() or reach.max() > FARTHEST:
            break
        reach[narrow] *= WIDER
    if large.any():
        mean = interpolation_weights(Space(dim), pairs, targets, sources, volume, order="constant")
        values = host(weights.values).copy()
        values[large[pairs.rows()]] = host(mean.values)[large[pairs.rows()]]
        put(weights.values, values)
    return weights


def outward_weights(geometry: Geometry, support: float) -> Weights:
    """Interpolation from cells to nodes that extrapolates linearly to faces: for output. `support` in cells."""
    return spanning_weights(geometry, support, geometry.centred, geometry.off_cracks, geometry.cell_volume)
