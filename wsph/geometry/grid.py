"""The grid that cuts a shape into cells, planned from the scene alone: where its lines are and whether the shape meets them.

A grid stands in its own frame: its lines are at `origin + k * step` along `axes`, the shape's own axes turned by
`lattice_rotate`. Points in units of cells along those axes are called grid coordinates.
"""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.shape import Rotation, rotation_matrix

FIT = 1e-6
"""An edge lies on a line of the grid if it is this near, in cells."""

CHUNK = 2**16
"""Cells that are looked at at once."""

LOST = 1e-12
"""Spacing over the largest coordinate below which positions have too few digits for it."""


@dataclass(frozen=True)
class Grid:
    """Lines of a grid: `middle` (dim,) [m] about which it turns, `low`, `high` (dim,) [m] its ends before it does, `step`
    (dim,) [m], `count` (dim,) cells, `axes` (dim, dim) whose columns are its directions."""

    middle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    step: np.ndarray
    count: np.ndarray
    axes: np.ndarray

    @property
    def upright(self) -> bool:
        """Whether its directions are the coordinate axes."""
        return bool((self.axes == np.eye(len(self.step))).all())

    def points(self, index: np.ndarray) -> np.ndarray:
        """Positions [m] of grid coordinates (n, dim)."""
        # The last line is the shape's edge to the last bit: an edge divided by its count, not the spacing added up.
        local = np.empty(index.shape)
        for k, last in enumerate(self.count):  # a column at a time, which takes little more memory than they do
            of = index[:, k]
            local[:, k] = np.where(of == last, self.high[k], self.low[k] + of * self.step[k])
        return local if self.upright else self.middle + (local - self.middle) @ self.axes.T

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Grid coordinates of positions (n, dim) [m]."""
        local = points if self.upright else self.middle + (points - self.middle) @ self.axes
        return (local - self.low) / self.step


def cells_in(shape: Shape, grid: Grid, layers: tuple[int, int] | None = None) -> np.ndarray:
    """Which cells of a grid have their middles in a shape, of the grid's shape, bool; of some `layers` across its first axis
    alone, from one up to another."""
    first, end = layers or (0, int(grid.count[0]))
    count = (end - first, *grid.count[1:].tolist())
    cells = np.zeros(int(np.prod(count)), bool)
    for begin in range(0, len(cells), CHUNK):
        number = np.arange(begin, min(begin + CHUNK, len(cells)))
        index = np.stack(np.unravel_index(number, count), 1)
        index[:, 0] += first
        cells[number] = shape.contains(grid.points(index + 0.5))
    return cells.reshape(count)


def layers_of(shape: Shape, grid: Grid, first: int, end: int) -> np.ndarray:
    """What every layer of nodes across the first axis of a grid has, from one up to another, (layers, 2 + 3 dim) int64:
    nodes, cells behind them, and of the nodes the sums of their grid coordinates, their least and their largest."""
    dim, cells = len(grid.count), int(grid.count[0])
    found = np.zeros((end - first, 2 + 3 * dim), np.int64)
    before = cells_in(shape, grid, (first - 1, first)) if first > 0 else None
    for k in range(first, end):
        here = cells_in(shape, grid, (k, k + 1)) if k < cells else None
        either = [each[0] for each in (before, here) if each is not None]
        touched = np.zeros([n + 1 for n in either[0].shape], bool)
        for view in product(*(((0, n), (1, n + 1)) for n in either[0].shape)):
            for each in either:
                touched[tuple(slice(*ends) for ends in view)] |= each
        places = np.nonzero(touched) if dim > 1 else ()
        row, count = found[k - first], np.count_nonzero(touched)
        row[0], row[1] = count, 0 if here is None else np.count_nonzero(here)
        row[2], row[2 + dim], row[2 + 2 * dim] = count * k, k, k
        for axis, place in enumerate(places, start=1):
            low, high = (place.min(), place.max()) if count else (np.iinfo(np.int64).max, -1)
            row[2 + axis], row[2 + dim + axis], row[2 + 2 * dim + axis] = place.sum(), low, high
        before = here
    return found


def plan(
    shape: Shape, spacing: float | tuple[float, ...], lattice_rotate: Rotation = 0.0, *, fitted: bool = False
) -> Grid:
    """The grid of a shape. `spacing` [m], one number or one for each axis.

    Where the shape has edges along an axis, lines fall on them; elsewhere, and where the surface is to be `fitted`, the
    grid is centred. Raises ValueError where edges do not fit to 1e-6 (with the nearest spacings that do) or a rotation is
    not for the dimension.
    """
    dim, middle = shape.dim, shape.middle
    steps = np.broadcast_to(np.asarray(spacing, float), (dim,)) if np.size(spacing) in (1, dim) else None
    if steps is None:
        raise ValueError(
            f"{np.ravel(spacing).tolist()} has {np.size(spacing)} numbers in {dim}D; give one, or one for each axis"
        )
    turn = rotation_matrix(lattice_rotate, dim)
    low, high = shape.bounds()
    edges = [np.zeros(0)] * dim if fitted else shape.edges()
    if lattice_rotate != 0.0:
        ends = np.array(list(product(*zip(low, high, strict=True))))
        turned = middle + (ends - middle) @ turn
        low, high, edges = turned.min(0), turned.max(0), [np.zeros(0)] * dim
    with np.errstate(over="ignore"):
        small = not ((high - low) / steps < 1e15).all()
    if small:
        raise ValueError(f"{steps.min():g} m is too small for a body of {(high - low).max():g} m")
    farthest = max(float(np.abs(each).max()) for each in (low, high))
    if steps.min() < LOST * farthest:
        raise ValueError(
            f"{steps.min():g} m is lost in the rounding of coordinates of {farthest:g} m: move the body to the origin"
        )
    every = [float(gap) for each in edges for gap in np.diff(each)] if np.size(spacing) == 1 else []
    found = [lines(k, low[k], high[k], float(steps[k]), edges[k], every) for k in range(dim)]
    first, last, count = (np.array(column) for column in zip(*found, strict=True))
    return Grid(middle, first, last, (last - first) / count, count.astype(int), shape.axes @ turn)


MOST_TRIED = 1000
"""Numbers of cells that are tried for a spacing that divides all edges."""


def _dividing(spacing: float, gaps: list[float]) -> list[float]:
    """The nearest spacings below and above that divide the first of `gaps`: all of them, where there are such near by."""
    first, ratio = gaps[0], gaps[0] / spacing
    finer, coarser = int(np.ceil(ratio)), max(int(np.floor(ratio)), 1)
    divides = [n for n in range(max(coarser - MOST_TRIED, 1), finer + MOST_TRIED) if _all(first / n, gaps)]
    below = next((n for n in divides if n >= finer), finer)
    above = next((n for n in reversed(divides) if n <= coarser), coarser)
    return sorted({first / below, first / above})


def _all(spacing: float, gaps: list[float]) -> bool:
    ratios = np.array(gaps) / spacing
    return bool((np.abs(ratios - np.rint(ratios)) <= FIT * np.maximum(ratios, 1.0)).all() and (ratios > 0.5).all())


def lines(
    axis: int, low: float, high: float, spacing: float, edges: np.ndarray, every: Sequence[float] = ()
) -> tuple[float, float, int]:
    """First and last line along an axis [m], and the number of cells between them. `every` are the gaps between edges of all
    axes that one spacing has to divide."""
    if not len(edges):
        if spacing > (1.0 + FIT) * (high - low):
            raise ValueError(f"{spacing:g} m is larger than the shape, which is {high - low:g} m along {'xyz'[axis]}")
        count = max(int(np.ceil((high - low) / spacing - FIT)), 1)
        half = 0.5 * count * spacing
        return 0.5 * (low + high) - half, 0.5 * (low + high) + half, count
    anchor = edges[0]
    for edge in edges[1:]:
        ratio = (edge - anchor) / spacing
        if abs(ratio - np.rint(ratio)) > FIT * max(ratio, 1.0) or ratio < 0.5:
            fitting = _dividing(spacing, [float(edge - anchor), *every])
            whose = "the box's" if len(edges) == 2 else f"what lies between {anchor:g} m and {edge:g} m of the shape's"
            raise ValueError(
                f"{spacing:g} m does not divide {whose} {'xyz'[axis]} edge of {edge - anchor:g} m; the nearest that do: {' m, '.join(f'{f:.12g}' for f in fitting)} m"
            )
    if edges[0] == low and edges[-1] == high:
        return low, high, int(np.rint((high - low) / spacing))
    before = int(np.ceil((anchor - low) / spacing - FIT))
    after = int(np.ceil((high - anchor) / spacing - FIT))
    return anchor - before * spacing, anchor + after * spacing, before + after


def places_of(inside: np.ndarray, first: int = 0) -> np.ndarray:
    """Where an array of the shape of a grid, from its `first` layer on, is true, (n, dim) int32, the last axis fastest."""
    left = np.flatnonzero(inside)
    places = np.empty((len(left), inside.ndim), np.int32)
    for axis in reversed(range(inside.ndim)):
        left, places[:, axis] = np.divmod(left, inside.shape[axis])
    places[:, 0] += np.int32(first)
    return places


def corners_of(inside: np.ndarray, offsets: np.ndarray, first: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Corners (c, 2^dim) of the cells `inside`, and places (n, dim) in the grid of all that are, in its order; int32."""
    touched = np.zeros([n + 1 for n in inside.shape], bool)
    views = [tuple(slice(k, k + n) for k, n in zip(o, inside.shape, strict=True)) for o in offsets.tolist()]
    for view in views:
        touched[view] |= inside
    number = (np.cumsum(touched.ravel(), dtype=np.int32) - np.int32(1)).reshape(touched.shape)
    corners = np.empty((np.count_nonzero(inside), len(offsets)), np.int32)
    for k, view in enumerate(views):
        corners[:, k] = number[view][inside]
    return corners, places_of(touched, first)
