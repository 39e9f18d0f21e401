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

from wsph.backend.domain import any_of
from wsph.geometry.geometry import Geometry
from wsph.ranks.blocks import own_sum

WHOLE = 2.0
"""tr T_p over the mean square distance of the corners from their middle, of the cells of a grid."""

SKEW = 0.15
"""The largest part by which the energy of cracks may be off their toughness for the shape of the cells, on the mean."""


ROUNDS = 3
"""Cells around over which directions are averaged."""


@dataclass(frozen=True)
class Sight:
    """`laplacian` c_p (m,) [1/m2] of the points here; `skew`: 1 - sqrt(t) of the direction that is seen least some cells
    around, the mean over the volume of the whole body."""

    laplacian: np.ndarray
    skew: float


class _Points:
    """The m points that are here of a body, with as much around them as theirs see, and what they see: the `nodes` (e,) of
    each `point` (e,). What depends on points around is right on a process's own until the others are `told`."""

    def __init__(self, geometry: Geometry):
        low, high = geometry.split.layers
        self.wide = wide = geometry.wider((low - 1, high + 1))
        self.share, self.domain = wide.split.points, wide.split.domain
        rows = wide.rows
        self.many = np.diff(rows.offsets)
        self.point, self.nodes = np.repeat(np.arange(len(self.many)), self.many), rows.indices
        self.m, self.n = len(self.many), len(wide.nodes)
        self.held = np.ones(self.m, bool) if rows.held is None else rows.held
        self.inside = ~np.logical_or.reduceat(wide.on_face[rows.indices], rows.offsets[:-1])
        self._halo = self.domain.halo(self.share)

    def told(self, values: np.ndarray) -> np.ndarray:
        """Values (m, k) as their owners have them."""
        found = np.ascontiguousarray(values, float)
        self._halo.fill(found)
        return found

    def at_nodes(self, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Sums (n, k) over the points around each node of numbers (m, k) of theirs, times weights (e,)."""
        sums = [np.bincount(self.nodes, weight * column[self.point], self.n) for column in values.T]
        return np.stack(sums, 1)

    def at_points(self, values: np.ndarray, weight: np.ndarray | float = 1.0) -> np.ndarray:
        """Sums (m, k) over the nodes that each point sees of numbers (n, k) of theirs, times weights (e,)."""
        sums = [np.bincount(self.point, weight * column[self.nodes], self.m) for column in values.T]
        return np.stack(sums, 1)

    def any(self, flags: np.ndarray) -> bool:
        """Whether any of the points of the body has a flag (m,) bool."""
        return any_of(self.domain, bool(flags[self.share.own].any()))

    def mean(self, values: np.ndarray, weight: np.ndarray) -> float:
        """The mean of numbers (m,) of all points of the body by their weights (m,)."""
        total = own_sum(weight, self.share, self.domain)
        return own_sum(values * weight, self.share, self.domain) / total


def sight_of(geometry: Geometry) -> Sight:
    """What the points of a body see that see the corners of their own cells; all processes that share it ask together.
    Raises ValueError for one so thin that no point on an edge has a whole neighbourhood."""
    seen = _Points(geometry)
    wide, dim = seen.wide, geometry.nodes.shape[1]
    weight = 1.0 / np.repeat(seen.many, seen.many)
    place = wide.nodes - wide.middle
    centre = seen.at_points(place, weight)
    tensor = _tensor(seen, weight, centre)
    whole = np.trace(tensor, axis1=1, axis2=2)
    square = np.zeros(len(weight))
    for there, here in zip(place.T, centre.T, strict=True):
        square += (there[seen.nodes] - here[seen.point]) ** 2
    own = np.bincount(seen.point, weight * square, seen.m)
    # Of triangles and tetrahedra the points at the surface see too few corners to tell their size by.
    size, any_inside = np.where(seen.held, own, 1.0), seen.any(seen.inside)
    if not any_inside and seen.any(~seen.held):
        raise ValueError("it is too thin: no point has a whole neighbourhood")
    ratio, skew = np.full(seen.m, WHOLE), 0.0
    ratio[seen.inside] = whole[seen.inside] / size[seen.inside]
    if any_inside:
        ratio, inside = seen.told(np.stack([ratio, seen.inside], 1)).T
        seen.inside = inside > 0.0
        ratio = _continued(seen, ratio)
        part = (dim * tensor / np.maximum(whole, np.finfo(float).tiny)[:, None, None]).reshape(-1, dim * dim)
        skew = _skew(seen, part)
    first = geometry.split.points.first - seen.share.first
    return Sight((dim / (ratio * size))[first : first + geometry.split.points.held], skew)


def _tensor(seen: _Points, weight: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """T_p (m, dim, dim)."""
    m, dim = centre.shape
    total = np.maximum(np.bincount(seen.nodes, weight, seen.n), np.finfo(float).tiny)
    first = seen.at_nodes(centre, weight) / total[:, None]
    outer = np.einsum("pa,pb->pab", centre, centre).reshape(m, dim * dim)
    second = seen.at_nodes(outer, weight) / total[:, None]
    mean = seen.at_points(first, weight)
    square = seen.at_points(second, weight).reshape(m, dim, dim)
    cross = np.einsum("pa,pb->pab", mean, centre)
    return square - cross - cross.swapaxes(1, 2) + outer.reshape(m, dim, dim)


def _skew(seen: _Points, part: np.ndarray) -> float:
    """Of the parts T_p/(tr T_p/dim) (m, dim^2) of points inside: what differs from cell to cell a crack does not feel."""
    inside, dim = seen.inside, round(part.shape[1] ** 0.5)
    counts = inside[seen.point].astype(float)
    known = np.maximum(np.bincount(seen.nodes, counts, seen.n), 1.0)
    for _ in range(ROUNDS):
        mean = seen.at_nodes(seen.told(part), counts) / known[:, None]
        part = seen.at_points(mean) / seen.many[:, None]
    own = np.flatnonzero(inside & seen.share.owns(np.arange(seen.m)))
    least, lost = np.linalg.eigvalsh(part[own].reshape(-1, dim, dim))[:, 0], np.zeros(seen.m)
    lost[own] = 1.0 - np.sqrt(np.clip(least, 0.0, 1.0))
    return seen.mean(lost, seen.wide.cell_volume * inside)


def _continued(seen: _Points, values: np.ndarray) -> np.ndarray:
    """Values (m,) of the points where they are inside, elsewhere the mean of those around, layer by layer."""
    values, known = values.copy(), seen.inside.copy()
    while seen.any(~known):
        count = np.bincount(seen.nodes, known[seen.point], seen.n)
        total = np.bincount(seen.nodes, np.where(known, values, 0.0)[seen.point], seen.n)
        around, sums = (np.bincount(seen.point, each[seen.nodes], seen.m) for each in (count, total))
        reached = ~known & (around > 0)
        if not seen.any(reached):
            # A piece of its own, without a point inside.
            values[~known] = seen.mean(np.where(known, values, 0.0), known.astype(float))
            break
        values[reached] = sums[reached] / around[reached]
        values, flags = seen.told(np.stack([values, known | reached], 1)).T
        known = flags > 0.0
    return values
