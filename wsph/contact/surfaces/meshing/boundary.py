"""Where the cells of a body end: its sides, and the fans of cells that hang together around their nodes.

A side that belongs to one live cell, or to two that are parted, is a side of the body, of each. A vertex is a node and the
cells around it that hang together by their sides: so both banks of a crack have vertices of their own, and so do cells that
meet at a corner alone, whether or not the geometry has a node for each.
"""

# pyright: strict

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wsph.contact.surfaces.meshing.sparse import spread
from wsph.geometry.connected import connected
from wsph.geometry.geometry import Geometry
from wsph.geometry.meshes.sides import cell_sides


@dataclass(frozen=True)
class Boundary:
    """The boundary of a body, n vertices and s sides.

    node      # of the geometry, of each vertex, (n,)
    sides     # vertices of each side, (s, corners), one with fewer corners repeats its last
    cell      # that each side belongs to, (s,)
    starts    # where the cells of each vertex begin, (n + 1,), in
    cells     # the fans, ascending
    joins     # pairs (k, 2) of a cell in a fan and one that hangs together with it around a node of both
    """

    node: np.ndarray
    sides: np.ndarray
    cell: np.ndarray
    starts: np.ndarray
    cells: np.ndarray
    joins: np.ndarray


@dataclass(frozen=True)
class _Sides:
    """Sides of cells: `nodes` (s, w), `cell` (s,), and of each node the corner of a cell, counted through all, (s, w)."""

    nodes: np.ndarray
    cell: np.ndarray
    corner: np.ndarray


class Cells(Protocol):
    """Live cells of a body and their nodes, as a boundary is found of them (`wsph.contact.surfaces.meshing.shell.Shell`)."""

    @property
    def nodes(self) -> np.ndarray: ...

    @property
    def blocks(self) -> tuple[np.ndarray, ...]: ...

    @property
    def wanted(self) -> np.ndarray: ...

    @property
    def parted(self) -> np.ndarray: ...


def boundary_of(cells: Cells, *, deep: bool) -> Boundary:
    """The boundary of some cells. `deep`: the `joins` are asked for. Raises ValueError for a geometry without cells."""
    blocks, wanted, parted, count = cells.blocks, cells.wanted, cells.parted, sum(map(len, cells.blocks))
    if deep:
        wanted = _touched(blocks, wanted, len(cells.nodes))
    corners, sides = _around(blocks, wanted, cells.nodes.shape[1])
    shared, _, alone = _matched(sides, parted, count)
    fan = connected(shared[0], shared[1], len(corners))
    cell, node = corners.T
    at = sides.corner[alone]
    outer = np.unique(fan[at])
    # Vertices in the order of their nodes.
    order = np.argsort(_first_of(fan, node)[outer], kind="stable")
    vertex = np.full(int(fan.max(initial=-1)) + 1, -1)
    vertex[outer[order]] = np.arange(len(outer))
    own = np.flatnonzero(vertex[fan] >= 0)
    own = own[np.lexsort((cell[own], vertex[fan[own]]))]
    starts = np.searchsorted(vertex[fan[own]], np.arange(len(outer) + 1))
    joins = _joined(fan, cell, np.unique(cell[own]), parted, count) if deep else np.zeros((0, 2), int)
    return Boundary(_first_of(fan, node)[outer[order]], vertex[fan[at]], sides.cell[alone], starts, cell[own], joins)


def neighbours(geometry: Geometry) -> np.ndarray:
    """Pairs of the cells of a lattice that are here and share a side, the lower one first, (k, 2)."""
    everywhere = np.ones(len(geometry.nodes), bool)
    sides = _around(geometry.blocks, everywhere, geometry.nodes.shape[1])[1]
    return _matched(sides, np.zeros((0, 2), int), sum(map(len, geometry.blocks)))[1]


def _touched(blocks: tuple[np.ndarray, ...], wanted: np.ndarray, count: int) -> np.ndarray:
    """All nodes of the cells with a node that is `wanted`."""
    found = np.zeros(count, bool)
    for corners in blocks:
        found[corners[wanted[corners].any(1)].ravel()] = True
    return found


def _around(blocks: tuple[np.ndarray, ...], wanted: np.ndarray, dim: int) -> tuple[np.ndarray, _Sides]:
    """The corners (cell, node) of cells with a node that is `wanted` (nodes,) bool, and their sides with such a node."""
    width = max(cell_sides(corners.shape[1], dim).shape[1] for corners in blocks)
    all_corners: list[np.ndarray] = []
    found: list[_Sides] = []
    first = before = 0
    for corners in blocks:
        rows = np.flatnonzero(wanted[corners].any(1))
        own, k = corners[rows], corners.shape[1]
        all_corners.append(np.stack([np.repeat(first + rows, k), own.ravel()], 1))
        local = cell_sides(k, dim)
        if local.shape[1] < width:
            local = np.concatenate([local, local[:, -1:]], 1)
        nodes = own[:, local].reshape(-1, width)
        corner = (before + k * np.arange(len(rows))[:, None, None] + local).reshape(-1, width)
        there = wanted[nodes].any(1)
        found.append(_Sides(nodes[there], np.repeat(first + rows, len(local))[there], corner[there]))
        first, before = first + len(corners), before + k * len(rows)
    joined = _Sides(*(np.concatenate([getattr(each, name) for each in found]) for name in ("nodes", "cell", "corner")))
    return np.concatenate(all_corners), joined


def _matched(sides: _Sides, parted: np.ndarray, cells: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of corners that two cells share at a side, (k,) and (k,), and the cells that share it; and the rows of the
    sides that are alone."""
    nodes = sides.nodes.copy()
    # A side is the same from both cells in ascending order; a corner that is there twice counts once.
    if nodes.shape[1] > 1:
        nodes[:, 1:][nodes[:, 1:] == nodes[:, :-1]] = -1
    order = np.argsort(nodes, axis=1, kind="stable")
    keys, corner = np.take_along_axis(nodes, order, 1), np.take_along_axis(sides.corner, order, 1)
    rows = np.lexsort(keys.T)
    same = (keys[rows[1:]] == keys[rows[:-1]]).all(1)
    first, second = rows[:-1][same], rows[1:][same]
    whole = ~_among(sides.cell[first], sides.cell[second], parted, cells)
    first, second = first[whole], second[whole]
    alone = np.ones(len(nodes), bool)
    alone[first] = alone[second] = False
    there = keys[first] >= 0
    shared = np.stack([corner[first][there], corner[second][there]])
    return shared, np.stack([sides.cell[first], sides.cell[second]], 1), np.flatnonzero(alone)


def _among(first: np.ndarray, second: np.ndarray, pairs: np.ndarray, cells: int) -> np.ndarray:
    """Which pairs of `first` and `second` (k,), of so many cells, are among `pairs` (p, 2), whichever is named first."""
    ends = np.sort(pairs, axis=1).astype(np.int64)
    keys = np.minimum(first, second).astype(np.int64) * cells + np.maximum(first, second)
    return np.isin(keys, ends[:, 0] * cells + ends[:, 1])


def _first_of(fan: np.ndarray, node: np.ndarray) -> np.ndarray:
    """The node of every fan: all of its corners have the same."""
    found = np.zeros(int(fan.max(initial=-1)) + 1, int)
    found[fan] = node
    return found


def _joined(fan: np.ndarray, cell: np.ndarray, own: np.ndarray, parted: np.ndarray, cells: int) -> np.ndarray:
    """Pairs of one of the cells `own` and one that shares a fan of corners with it, and is not parted from it, (k, 2)."""
    order = np.argsort(fan, kind="stable")
    starts = np.searchsorted(fan[order], np.arange(int(fan.max(initial=-1)) + 2))
    mine = np.flatnonzero(np.isin(cell, own))
    whose, where = spread(starts, fan[mine])
    first, second = cell[mine[whose]], cell[order[where]]
    keys = np.unique(first[first != second].astype(np.int64) * cells + second[first != second])
    first, second = keys // cells, keys % cells
    whole = ~_among(first, second, parted, cells)
    return np.stack([first[whole], second[whole]], 1)


def successors(old: Boundary, new: Boundary) -> np.ndarray:
    """Which vertex of a new boundary each one of the `old` is now: at its node the one with most of its cells, (old n,); -1
    where none of these has a vertex there any more."""
    mine, theirs = _members(old), _members(new)
    count = 1 + max(int(each[:, :2].max(initial=0)) for each in (mine, theirs))
    keys = [each[:, 0].astype(np.int64) * count + each[:, 1] for each in (mine, theirs)]
    _, first, second = np.intersect1d(keys[0], keys[1], return_indices=True)
    width = len(new.node) + 1
    both, shared = np.unique(mine[first, 2].astype(np.int64) * width + theirs[second, 2], return_counts=True)
    found = np.full(len(old.node), -1)
    # The last that is written stays: most cells in common, and of equals the lowest.
    order = np.lexsort((-(both % width), shared))
    found[both[order] // width] = both[order] % width
    return found


def _members(boundary: Boundary) -> np.ndarray:
    """Node, cell and vertex of every place in a fan, (k, 3)."""
    vertex = np.repeat(np.arange(len(boundary.node)), np.diff(boundary.starts))
    return np.stack([boundary.node[vertex], boundary.cells, vertex], 1)
