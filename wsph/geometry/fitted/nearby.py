"""Distances to the nearest of many points, by bins."""

# pyright: strict

from itertools import product

import numpy as np


def nearest_distance(sources: np.ndarray, points: np.ndarray, reach: float) -> np.ndarray:
    """Distances (n,) [m] of `points` (n, dim) to the nearest of `sources` (m, dim), infinite beyond `reach` [m]."""
    squares = np.full(len(points), np.inf)
    if not len(sources) or not len(points):
        return squares
    low = np.minimum(sources.min(0), points.min(0)) - 2.0 * reach
    count = np.floor((np.maximum(sources.max(0), points.max(0)) - low) / reach).astype(np.int64) + 3
    strides = np.array([int(count[k + 1 :].prod()) for k in range(points.shape[1])])
    keys = np.floor((sources - low) / reach).astype(np.int64) @ strides
    order = np.argsort(keys, kind="stable")
    keys, home = keys[order], np.floor((points - low) / reach).astype(np.int64)
    for offset in product((-1, 0, 1), repeat=points.shape[1]):
        bins = (home + np.array(offset)) @ strides
        first = np.asarray(np.searchsorted(keys, bins), int)
        many = np.asarray(np.searchsorted(keys, bins, side="right"), int) - first
        rows = np.repeat(np.arange(len(points)), many)
        if not len(rows):
            continue
        starts = np.cumsum(many) - many
        found = order[np.arange(len(rows)) - starts[rows] + first[rows]]
        apart = ((points[rows] - sources[found]) ** 2).sum(1)
        some = many > 0
        squares[some] = np.minimum(squares[some], np.minimum.reduceat(apart, starts[some]))
    distance = np.sqrt(squares)
    return np.where(distance <= reach, distance, np.inf)
