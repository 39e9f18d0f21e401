"""Counts of a body's nodes, cells and pairs of cells, found without laying out a lattice."""

# pyright: strict
# pyright: reportUnknownArgumentType=false, reportUnknownVariableType=false

from itertools import combinations, product

import numpy as np

from wsph.geometry.fitted.planning import on_grid_lines
from wsph.geometry.grid import cells_in, plan
from wsph.geometry.shapes.box import Box
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.shape import Rotation


def cells_along(
    shape: Shape, spacing: float | tuple[float, ...], lattice_rotate: Rotation, surface: str | None
) -> list[int]:
    """Cells along every axis of a body whose `surface` is asked to be "fitted", "stairs" or what its form takes (None). One
    that may be fitted needs no line of the grid on it. Raises ValueError as `plan` does."""
    try:
        return plan(shape, spacing, lattice_rotate).count.tolist()
    except ValueError as error:
        if "not divide" not in str(error) or shape.dim == 1 or surface == "stairs":
            raise
        if surface is None and on_grid_lines(shape):
            raise
    return plan(shape, spacing, lattice_rotate, fitted=True).count.tolist()


def lattice_counts(
    shape: Shape, spacing: float | tuple[float, ...], lattice_rotate: Rotation = 0.0, *, fitted: bool = False
) -> np.ndarray:
    """How many nodes a body has, how many cells, and for k = 1 ... dim how many pairs of cells lie a step apart along k
    axes of the grid at once, the mean over those directions: (dim + 2,).

    Faces, edges and pairs within any reach of a block of a x b x c cells are sums of these: they span the polynomials
    of a, b and c that have every power to the first and treat the axes alike, one of them too many. Raises ValueError
    as `plan` does.
    """
    grid = plan(shape, spacing, lattice_rotate, fitted=fitted)
    if isinstance(shape, Box) and lattice_rotate == 0.0:
        return block_counts(tuple(grid.count.tolist()))
    inside, dim = cells_in(shape, grid), len(grid.count)
    found = [float(_nodes(inside)), float(inside.sum())]
    for steps in range(1, dim + 1):
        ways = [way for way in product((-1, 0, 1), repeat=dim) if np.count_nonzero(way) == steps and way > (0,) * dim]
        found.append(float(np.mean([_apart(inside, way) for way in ways])))
    return np.array(found)


def block_counts(cells: tuple[int, ...]) -> np.ndarray:
    """The same of a block with so many `cells` along its axes."""
    axes, found = range(len(cells)), [float(np.prod([n + 1.0 for n in cells]))]
    for steps in range(len(cells) + 1):
        apart = [np.prod([float(n - (k in moved)) for k, n in enumerate(cells)]) for moved in combinations(axes, steps)]
        found.append(float(np.mean(apart)))
    return np.array(found)


def line_segments(
    shape: Shape,
    spacing: float | tuple[float, ...],
    lattice_rotate: Rotation = 0.0,
    *,
    fitted: bool = False,
    width: int,
) -> tuple[int, int]:
    """In how many segments of `width` cells the lines of a body's cells along the last axis of its grid are cut, and in how
    many of its nodes: what an end of a line has of one more counts with the segment before. Raises ValueError as `plan`
    does."""
    grid = plan(shape, spacing, lattice_rotate, fitted=fitted)
    if isinstance(shape, Box) and lattice_rotate == 0.0:
        return block_segments(tuple(grid.count.tolist()), width)
    inside = cells_in(shape, grid)
    lines = np.zeros([*(n + 1 for n in inside.shape[:-1]), inside.shape[-1]], bool)
    for corner in product((0, 1), repeat=inside.ndim - 1):
        lines[tuple(slice(k, k + n) for k, n in zip(corner, inside.shape[:-1], strict=True))] |= inside
    return _segments(inside, width), _segments(lines, width)


def block_segments(cells: tuple[int, ...], width: int) -> tuple[int, int]:
    """The same of a block with so many `cells` along its axes."""
    along = -(-cells[-1] // width)
    return int(np.prod(cells[:-1])) * along, int(np.prod([n + 1 for n in cells[:-1]])) * along


def inner_rows(
    shape: Shape,
    spacing: float | tuple[float, ...],
    lattice_rotate: Rotation = 0.0,
    *,
    fitted: bool = False,
    width: int,
) -> tuple[int, tuple[int, int]]:
    """How many cells of a body have all of their neighbours, and how many nodes all of their cells, together; and in how
    many pieces of at most `width` the runs of either along the last axis of the grid are cut. Raises ValueError as `plan`
    does."""
    grid = plan(shape, spacing, lattice_rotate, fitted=fitted)
    if isinstance(shape, Box) and lattice_rotate == 0.0:
        return block_inner(tuple(grid.count.tolist()), width)
    nodes = _all_around(cells_in(shape, grid))
    cells = _all_around(nodes)
    return int(np.count_nonzero(nodes) + np.count_nonzero(cells)), (_cut_runs(cells, width), _cut_runs(nodes, width))


def block_inner(cells: tuple[int, ...], width: int) -> tuple[int, tuple[int, int]]:
    """The same of a block with so many `cells` along its axes."""
    rows, cut = 0, list[int]()
    for less in (2, 1):
        own = [max(n - less, 0) for n in cells]
        rows += int(np.prod(own))
        cut.append(int(np.prod(own[:-1])) * -(-own[-1] // width))
    return rows, (cut[0], cut[1])


def _all_around(there: np.ndarray) -> np.ndarray:
    """Between which places of a grid there is something in all of them."""
    for axis in range(there.ndim):
        before, behind = (np.take(there, range(k, there.shape[axis] - 1 + k), axis) for k in (0, 1))
        there = before & behind
    return there


def _cut_runs(there: np.ndarray, width: int) -> int:
    """Pieces of at most `width` of the runs along the last axis."""
    place, opens = np.arange(there.shape[-1]), there.copy()
    opens[..., 1:] &= ~there[..., :-1]
    first = np.maximum.accumulate(np.where(opens, place, 0), axis=-1)
    return int(np.count_nonzero(there & ((place - first) % width == 0)))


def _segments(lines: np.ndarray, width: int) -> int:
    """Segments of lines along the last axis that have anything in them."""
    starts = np.arange(0, lines.shape[-1], width)
    return int(np.count_nonzero(np.logical_or.reduceat(lines, starts, axis=-1)))


def _apart(inside: np.ndarray, way: tuple[int, ...]) -> int:
    """Pairs of cells that lie `way` apart."""
    here = tuple(slice(max(0, -step), n - max(0, step)) for step, n in zip(way, inside.shape, strict=True))
    there = tuple(slice(max(0, step), n - max(0, -step)) for step, n in zip(way, inside.shape, strict=True))
    return int(np.count_nonzero(inside[here] & inside[there]))


def _nodes(inside: np.ndarray) -> int:
    """Corners of cells, each once."""
    touched = np.zeros([n + 1 for n in inside.shape], bool)
    for corner in product((0, 1), repeat=inside.ndim):
        touched[tuple(slice(k, k + n) for k, n in zip(corner, inside.shape, strict=True))] |= inside
    return int(np.count_nonzero(touched))
