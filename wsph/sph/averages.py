"""Averages on the host, for output: linear-exact interpolation that looks as far as it has to and through no crack."""

# pyright: strict

import numpy as np

from wsph.backend.arrays import host
from wsph.backend.space import Space
from wsph.geometry.geometry import Geometry
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.weights import Weights, interpolation_weights


def average(weights: Weights, values: np.ndarray) -> np.ndarray:
    """Interpolate `values` (sources, k) on the host, (targets, k)."""
    indices, w, row = host(weights.pairs.indices), host(weights.values), weights.pairs.rows()
    return np.stack(
        [np.bincount(row, w * values[indices, c], weights.pairs.targets) for c in range(values.shape[1])], 1
    )


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
    until its sources span every direction. `off_cracks`: the same in grid coordinates, moved off the cracks."""
    targets, sources = points
    reach = np.full(len(targets), support)
    dim = sources.shape[1]
    while True:
        pairs = visible(find_pairs(targets, sources, reach, "cpu"), geometry, *off_cracks)
        weights = interpolation_weights(Space(dim), pairs, targets, sources, volume)
        narrow = weights.rank < dim
        if not narrow.any() or reach.max() > 6.0:
            return weights
        reach[narrow] *= 1.5


def outward_weights(geometry: Geometry, support: float) -> Weights:
    """Interpolation from cells to nodes that extrapolates linearly to faces: for output. `support` in cells."""
    return spanning_weights(geometry, support, geometry.centred, geometry.off_cracks, geometry.cell_volume)
