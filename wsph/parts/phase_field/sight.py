"""How far points see where cells differ: the numbers of the Laplacian, point by point, and how unlike directions are.

A point p sees the corners j of its cell, of equal weights w = 1/k, and by them the points q at these, v_jq of sum one. With

    T_p = sum_j w_pj sum_q v_jq (x_q - x_p) (x) (x_q - x_p),   c_p = dim/tr T_p

2 c_p sum_j w_pj (d_j - d_p) is the Laplacian, if directions are seen alike: if T_p is a multiple of the identity. Along an
axis of which T has the part t of its mean the length of the model is l sqrt(t), and so is the energy of a crack across it.

At the surface points see less, and what they see is right for c_p of a neighbourhood that is continued there by its mirror
image, in which no flux leaves: their tr T_p is that of the points around in proportion to the size of their cells.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.geometry import Geometry
from wsph.geometry.gradients import PointRows

WHOLE = 2.0
"""tr T_p over the mean square distance of the corners from their middle, of the cells of a grid."""

SKEW = 0.15
"""The largest part by which the energy of cracks may be off their toughness for the shape of the cells, on the mean."""


ROUNDS = 3
"""Cells around over which directions are averaged."""


@dataclass(frozen=True)
class Sight:
    """`laplacian` c_p (m,) [1/m2]; `skew`: 1 - sqrt(t) of the direction that is seen least some cells around, the mean over
    the volume."""

    laplacian: np.ndarray
    skew: float


def sight_of(geometry: Geometry) -> Sight:
    """What the points of a body see that see the corners of their own cells. Raises ValueError for one so thin that no point
    on an edge has a whole neighbourhood."""
    rows, dim = geometry.rows, geometry.nodes.shape[1]
    many = np.diff(rows.offsets)
    m, weight = len(many), 1.0 / np.repeat(many, many)
    point = np.repeat(np.arange(m), many)
    place = geometry.nodes - geometry.nodes.mean(0)
    centre = _summed(point, weight[:, None] * place[rows.indices], m)
    tensor = _tensor(rows, point, weight, centre, len(place))
    whole = np.trace(tensor, axis1=1, axis2=2)
    apart = place[rows.indices] - centre[point]
    own = _summed(point, weight[:, None] * (apart**2).sum(1, keepdims=True), m)[:, 0]
    held = np.ones(m, bool) if rows.held is None else rows.held
    # Of triangles and tetrahedra the points at the surface see too few corners to tell their size by.
    size = np.where(held, own, 1.0)
    inside = ~np.logical_or.reduceat(geometry.on_face[rows.indices], rows.offsets[:-1])
    if not inside.any() and not held.all():
        raise ValueError("it is too thin: no point has a whole neighbourhood")
    ratio = np.full(m, WHOLE)
    ratio[inside] = whole[inside] / size[inside]
    if inside.any():
        ratio = _continued(rows, point, ratio, inside, len(place))
    part = (dim * tensor / np.maximum(whole, np.finfo(float).tiny)[:, None, None]).reshape(m, dim * dim)
    skew = _skew(rows, point, part, inside, geometry.cell_volume) if inside.any() else 0.0
    return Sight(dim / (ratio * size), skew)


def _summed(where: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sums of rows `values` (e, k) by the place `where` (e,) each belongs to, (count, k)."""
    return np.stack([np.bincount(where, column, count) for column in values.T], 1)


def _tensor(rows: PointRows, point: np.ndarray, weight: np.ndarray, centre: np.ndarray, nodes: int) -> np.ndarray:
    """T_p (m, dim, dim)."""
    m, dim = centre.shape
    total = np.maximum(np.bincount(rows.indices, weight, nodes), np.finfo(float).tiny)
    first = _summed(rows.indices, weight[:, None] * centre[point], nodes) / total[:, None]
    outer = np.einsum("pa,pb->pab", centre, centre).reshape(m, dim * dim)
    second = (_summed(rows.indices, weight[:, None] * outer[point], nodes) / total[:, None]).reshape(-1, dim, dim)
    mean = _summed(point, weight[:, None] * first[rows.indices], m)
    square = _summed(point, weight[:, None] * second.reshape(-1, dim * dim)[rows.indices], m).reshape(m, dim, dim)
    cross = np.einsum("pa,pb->pab", mean, centre)
    return square - cross - cross.swapaxes(1, 2) + outer.reshape(m, dim, dim)


def _skew(rows: PointRows, point: np.ndarray, part: np.ndarray, inside: np.ndarray, volume: np.ndarray) -> float:
    """Of the parts T_p/(tr T_p/dim) (m, dim^2) of points `inside`: what differs from cell to cell a crack does not feel."""
    nodes, dim = int(rows.indices.max()) + 1, round(part.shape[1] ** 0.5)
    for _ in range(ROUNDS):
        known = np.maximum(np.bincount(rows.indices, inside[point], nodes), 1.0)
        mean = _summed(rows.indices, part[point] * inside[point, None], nodes) / known[:, None]
        part = _summed(point, mean[rows.indices], len(part)) / np.bincount(point)[:, None]
    least = np.linalg.eigvalsh(part[inside].reshape(-1, dim, dim))[:, 0]
    return float(np.average(1.0 - np.sqrt(np.clip(least, 0.0, 1.0)), weights=volume[inside]))


def _continued(rows: PointRows, point: np.ndarray, values: np.ndarray, known: np.ndarray, nodes: int) -> np.ndarray:
    """Values (m,) of the points where they are `known`, elsewhere the mean of those around, layer by layer."""
    values, known = values.copy(), known.copy()
    while not known.all():
        count = np.bincount(rows.indices, known[point], nodes)
        total = np.bincount(rows.indices, np.where(known, values, 0.0)[point], nodes)
        around, sums = (np.bincount(point, each[rows.indices], len(values)) for each in (count, total))
        reached = ~known & (around > 0)
        if not reached.any():
            # A piece of its own, without a point inside.
            values[~known] = values[known].mean()
            break
        values[reached] = sums[reached] / around[reached]
        known |= reached
    return values
