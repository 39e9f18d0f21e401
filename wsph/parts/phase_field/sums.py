"""Sums over what the points of a body see, on the host."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

import numpy as np

from wsph.backend.domain import Halo
from wsph.parts.part import Neighbourhood

TINY = 1e-30
"""A sum of weights below which nothing is seen."""


def squares(seen: Neighbourhood, values: np.ndarray, halo: Halo) -> np.ndarray:
    """Sum of w times the mean square of what a pair sees of `values` (m, k) less the point's own, (m,). All processes ask
    together: by the `halo` of what pairs see they have it of those that own it."""
    weight: np.ndarray = np.asarray(seen.weight.numpy(), float)
    indices: np.ndarray = np.asarray(seen.pairs.indices.numpy())
    rows: np.ndarray = seen.pairs.rows()
    first, second = _averaged(seen, values, halo), _averaged(seen, (values**2).sum(1), halo)
    own = values[rows]
    each = second[indices] - 2.0 * (first[indices] * own).sum(1) + (own**2).sum(1)
    return np.bincount(rows, weight * each, len(values))


def _averaged(seen: Neighbourhood, values: np.ndarray, halo: Halo) -> np.ndarray:
    """Values at the points as pairs see them, (m, ...) to (n, ...)."""
    back, back_weight = seen.back, seen.back_weight
    if back is None or back_weight is None:
        return values
    weight: np.ndarray = np.asarray(back_weight.numpy(), float)
    points: np.ndarray = np.asarray(back.indices.numpy())
    rows: np.ndarray = back.rows()
    total = np.maximum(np.bincount(rows, weight, back.targets), TINY)
    flat = values.reshape(len(values), -1)
    sums = [np.bincount(rows, weight * column[points], back.targets) / total for column in flat.T]
    found = np.stack(sums, 1).reshape(-1, *values.shape[1:])
    halo.fill(found)
    return found
