"""Nodes near the surface smoothed, those on it along it."""

# pyright: strict

from itertools import product

import numpy as np

from wsph.geometry.cells import edge_ends
from wsph.geometry.fitted.layer import Cells
from wsph.geometry.fitted.projection import Projection
from wsph.geometry.fitted.relax.descent import descend
from wsph.geometry.fitted.relax.distortion import Measure

SWEEPS = 20
"""Sweeps towards the mean of the neighbours: they bring order, descent brings quality."""

INNER = 0.7
"""Part of the way to the mean that inner nodes go in a sweep."""

OUTER = 0.5
"""The same of nodes on the surface."""

DEEP = 2
"""Cells below the layer within which nodes move: the others stay where the grid has them."""

AGAIN = 2
"""Gauss-Newton steps back onto the surface after a move along it."""

STAGES = (
    (Measure(reach=0.65, power=2.0, least=0.02), 20),
    (Measure(reach=0.65, power=4.0, least=0.02), 20),
)
"""How distortion is measured in one descent after the other, and the steps of each: first so that cells inside out turn
back, then so that the worst ones count. A cell that is flat at a corner, as where an edge of the body runs along two of its
edges, is not at these points."""


def smoothed(
    nodes: np.ndarray, cells: Cells, labels: np.ndarray, first: int, onto: Projection, spacing: float
) -> np.ndarray:
    """The nodes (n, dim) [m] smoothed. `labels` (n, patches) bool: the patches that they lie on; those on as many as there
    are dimensions are corners and stay. The layer's cells are those from the `first` one."""
    dim, nodes = nodes.shape[1], nodes.copy()
    moving, near = _band(cells.corners, len(nodes), first)
    corners, count = cells.corners[near], labels.sum(1)
    start, end = _edges(corners, len(nodes))
    inner = _Means(start, end, moving & (count == 0), np.ones(len(start), bool))
    along = np.all(labels[end] | ~labels[start], axis=1)
    outer = _Means(start, end, moving & (count > 0) & (count < dim), along)
    for _ in range(SWEEPS):
        nodes[inner.rows] += INNER * (inner.of(nodes) - nodes[inner.rows])
        if len(outer.rows):
            nodes[outer.rows] += OUTER * (outer.of(nodes) - nodes[outer.rows])
            onto.onto(nodes, AGAIN)
    for measure, steps in STAGES:
        nodes = descend(nodes, corners, moving & (count < dim), onto, spacing, measure, steps)
    return nodes


class _Means:
    """The means over neighbours of the nodes `rows` (m,): of those `which` move that have any."""

    def __init__(self, start: np.ndarray, end: np.ndarray, which: np.ndarray, used: np.ndarray) -> None:
        used = used & which[start]
        self._end = end[used]
        self.rows, self._first, count = np.unique(start[used], return_index=True, return_counts=True)
        self._share = 1.0 / count[:, None]

    def of(self, nodes: np.ndarray) -> np.ndarray:
        """The means (m, dim) of positions (n, dim)."""
        return self._share * np.add.reduceat(nodes[self._end], self._first) if len(self.rows) else nodes[:0]


def _band(corners: np.ndarray, count: int, first: int) -> tuple[np.ndarray, np.ndarray]:
    """The nodes (n,) bool within some cells of the layer, and all cells that they have, (c,) bool."""
    moving = np.zeros(count, bool)
    moving[corners[first:]] = True
    near = np.any(moving[corners], axis=1)
    for _ in range(DEEP):
        moving[corners[near]] = True
        near = np.any(moving[corners], axis=1)
    return moving, near


def _edges(corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The edges of cells in both directions, each once, by their starts: nodes (e,) and (e,)."""
    dim = int(np.log2(corners.shape[1]))
    offsets = np.array(list(product((0, 1), repeat=dim)))
    keys: list[np.ndarray] = []
    for axis in range(dim):
        low, high = (corners[:, ends].ravel().astype(np.int64) for ends in edge_ends(offsets, axis))
        keys += [low * count + high, high * count + low]
    found = np.unique(np.concatenate(keys))
    return found // count, found % count
