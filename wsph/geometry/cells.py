"""Cells: volumes, edges and areas from their corners, and those that are boxes of a grid."""

# pyright: strict

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from wsph.plugins.traits import relaxes, turns
from wsph.units import rounded

LEAST = 0.25
"""Part of the cells of a body that are boxes from which they pay: with fewer it steps by its pairs alone, as fast."""

LISTED = {"total": (3.0, 5.0), "rate": (1.7, 2.8), "relaxing": (1.0, 1.2)}
"""Time of a visit of a pair in a list over that of one in rows of a grid, in f64 and in f32, where a law gives the stress
itself, its rate, or a rate that is asked at rest too: the more a point has to do, the less it matters how it finds nodes.
Measured on a CPU of a bar with holes at one end, by the time that four processes take for what they visit of both, and by
how much of the mean the slowest has more, all weights at 3, and as here:

| | f64: measured | at 3 | here | f32: measured | at 3 | here |
| --- | --- | --- | --- | --- | --- | --- |
| elastic | 2.9 | 3 % | 3 % | 5.1 | 17 % | 7 % |
| neo-hookean | 2.9 | 6 % | 6 % | 4.7 | 13 % | 5 % |
| jaumann | 1.8 | 23 % | 5 % | 2.9 | 4 % | 4 % |
| mises | 1.6 | 27 % | 9 % | 2.6 | 11 % | 4 % |
| perzyna | 0.9 | 45 % | 5 % | 1.2 | 38 % | 3 % |

`mises` while it flows has 1.3 and 1.8, and 13 and 18 % here (tests/benchmarks/shares.py drilled --law LAW --precision P, at
3 with --listed 3)."""


def listed_weight(material: object, precision: str) -> float:
    """Time of a visit of a pair in a list over that of one in rows of a grid (`LISTED`), of a body that has both."""
    law = "total" if not turns(material) else "relaxing" if relaxes(material) else "rate"
    return LISTED[law][precision == "f32"]


@dataclass(frozen=True)
class Boxes:
    """The cells of a body that are boxes of a grid, in its order, its last axis fastest: `corners` (b, 2^dim) node ids in
    the order of `itertools.product` of 0 and 1 along the axes; `index` (n, dim), where nodes of the body are in the grid,
    those of all boxes among them; the grid's `step` (dim,) [m] and `axes`, columns (dim, dim); `first`, where lines along
    the last axis begin, of the whole body that this may be a part of. Beside other cells `rows` (b,) are the boxes' points,
    and `nodes` (n,) those of the `index`, both ascending: without them the first of all. The whole body has so many boxes
    and points, `whole`, and nodes `before` this part's."""

    corners: np.ndarray
    index: np.ndarray
    step: np.ndarray
    axes: np.ndarray
    first: int | None = None
    rows: np.ndarray | None = None
    nodes: np.ndarray | None = None
    whole: tuple[int, int] | None = None
    before: int = 0

    def share(self, points: int) -> float:
        """The part of the points of the whole body, or of so many, that are boxes."""
        boxes, every = self.whole or (len(self.corners), points)
        return boxes / every

    def pay(self, points: int) -> bool:
        """Whether they are so many of these points that a body with rows of its grid is faster than with lists of pairs."""
        return self.share(points) >= LEAST

    def others(self, points: int) -> np.ndarray:
        """Which of so many points are no boxes, ascending."""
        other = np.ones(points, bool)
        other[slice(len(self.corners)) if self.rows is None else self.rows] = False
        return np.flatnonzero(other)

    def within(self, nodes: slice, points: slice, every: int) -> "Boxes":
        """Those of a part of a body with so many points, its nodes and points from one up to another."""
        rows = np.arange(len(self.corners)) if self.rows is None else self.rows
        seen = np.arange(len(self.index)) if self.nodes is None else self.nodes
        here, there = ((each >= of.start) & (each < of.stop) for each, of in ((rows, points), (seen, nodes)))
        return replace(
            self,
            corners=self.corners[here] - nodes.start,
            index=self.index[there],
            first=int(np.rint(self.index[:, -1].min())) if self.first is None else self.first,
            rows=rows[here] - points.start,
            nodes=seen[there] - nodes.start,
            whole=self.whole or (len(self.corners), every),
            before=self.before + nodes.start,
        )

    def steps(self, length: float) -> np.ndarray:
        """The grid's steps (dim,) in units of `length` [m], exactly one where they are that."""
        return steps_in(self.step, length)


def steps_in(step: np.ndarray, length: float) -> np.ndarray:
    """Steps (dim,) [m] in units of `length` [m], exactly one where they are that."""
    steps = step / length
    return np.where(np.abs(steps - 1.0) < 1e-6, 1.0, steps)


def edge_ends(offsets: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners at the low and at the high end of a cell's edges along an axis, in pairs."""
    low = np.flatnonzero(offsets[:, axis] == 0)
    beyond = offsets[low] + np.eye(offsets.shape[1], dtype=int)[axis]
    return low, np.array([int(np.flatnonzero((offsets == o).all(1))[0]) for o in beyond])


def edge_lengths(nodes: np.ndarray, corners: np.ndarray) -> float:
    """The longest edge [m] of cells with `corners` (c, 2^dim), or (c, dim + 1) of simplices, at `nodes` (n, dim) [m]."""
    dim, count = nodes.shape[1], corners.shape[1]
    if count == dim + 1 != 2:
        ends = np.array(list(combinations(range(count), 2)))
    else:
        offsets = np.array(list(product((0, 1), repeat=dim)))
        ends = np.concatenate([np.stack(edge_ends(offsets, axis), 1) for axis in range(dim)])
    along = nodes[corners[:, ends[:, 1]]] - nodes[corners[:, ends[:, 0]]]
    return float(np.linalg.norm(along, axis=2).max())


def mapped_cells(cells: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """Volumes [m^dim] of mapped cells (c, 2^dim, dim) and their shortest and longest edge [m]."""
    if not np.isfinite(cells).all():
        raise ValueError("the map gives positions that are not finite")
    volume = cell_volumes(cells, offsets)
    if not (volume > 0.0).all():
        where = cells[np.flatnonzero(~(volume > 0.0))[0]].mean(0)
        raise ValueError(f"the map turns the cell at {rounded(where)} m inside out")
    lengths: list[np.ndarray] = []
    for axis in range(cells.shape[2]):
        low, high = edge_ends(offsets, axis)
        lengths.append(np.linalg.norm(cells[:, high] - cells[:, low], axis=2))
    return volume, (float(np.min(lengths)), float(np.max(lengths)))


def cell_volumes(cells: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Volumes of cells from their corners (c, 2^dim, dim), multilinear between them, exactly by Gauss points, (c,)."""
    dim = cells.shape[2]
    total = np.zeros(len(cells))
    for point in product((0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5), repeat=dim):
        weight = np.where(offsets == 1, point, 1.0 - np.array(point))
        slope = np.stack([(2.0 * offsets[:, k] - 1.0) * np.delete(weight, k, 1).prod(1) for k in range(dim)], 1)
        total += np.linalg.det(np.einsum("cka,kb->cab", cells, slope)) / 2**dim
    return total


def beside(corners: np.ndarray, nodes: np.ndarray, count: int) -> np.ndarray:
    """Per node of some (k,), ascending, of so many, and axis of the grid the nodes before and behind it in its own cells,
    whose `corners` are (c, 2^dim), itself where there is none, (k, dim, 2)."""
    dim = round(np.log2(corners.shape[1]))
    result = np.repeat(nodes[:, None], 2 * dim, 1).reshape(-1, dim, 2)
    number, offsets = np.full(count, -1, np.int32), np.array(list(product((0, 1), repeat=dim)))
    number[nodes] = np.arange(len(nodes))
    corners = corners[(number[corners] >= 0).any(1)]
    for axis in range(dim):
        for ends in zip(*edge_ends(offsets, axis), strict=True):
            for one, other, side in ((*ends, 1), (*ends[::-1], 0)):
                row = number[corners[:, one]]
                result[row[row >= 0], axis, side] = corners[row >= 0, other]
    return result
