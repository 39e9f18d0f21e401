"""The outer sides of cells, and what the groups of a file name of them."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Iterable, Iterator
from itertools import combinations, product

import numpy as np

from wsph.geometry.cells import edge_ends
from wsph.geometry.gradients import face_shares
from wsph.units import rounded


def cell_sides(count: int, dim: int) -> np.ndarray:
    """The corners of each side of a cell with `count` corners, rows."""
    if count == dim + 1:
        return np.array(list(combinations(range(count), dim)))
    offsets = np.array(list(product((0, 1), repeat=dim)))
    return np.concatenate([np.stack(edge_ends(offsets, axis)) for axis in range(dim)])


def outer_sides(nodes: np.ndarray, blocks: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
    """The sides that belong to one cell alone, (m, j) nodes, a triangle among quadrilaterals with its last node twice, and
    the cells that they belong to (m,), counted through all blocks of corners at `nodes` (n, dim) [m]. Raises ValueError
    where more than two cells share a side, and where cells with three corners a side meet those with four."""
    dim = nodes.shape[1]
    width = 2 if dim == 2 else max(3 if corners.shape[1] == 4 else 4 for corners in blocks)
    sides, owners = list[np.ndarray](), list[np.ndarray]()
    before = 0
    for corners in blocks:
        each = corners[:, cell_sides(corners.shape[1], dim)]
        each = each.reshape(-1, each.shape[2])
        if each.shape[1] < width:
            each = np.concatenate([each, each[:, -1:]], 1)
        owners.append(before + np.repeat(np.arange(len(corners)), len(each) // len(corners)))
        sides.append(each)
        before += len(corners)
    every, owner = np.concatenate(sides), np.concatenate(owners)
    # In ascending order, so that a side is the same from both cells; a triangle among quadrilaterals ends in -1.
    keys = np.sort(every, axis=1)
    keys[:, 1:][keys[:, 1:] == keys[:, :-1]] = -1
    keys = -np.sort(-keys, axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    if (count > 2).any():
        shared = every[first[count > 2][0]]
        raise ValueError(f"more than two cells share the side at {_place(nodes, shared)}")
    alone = np.sort(first[count == 1])
    if dim == 3 and len(blocks) > 1:
        _refuse_meeting(nodes, every[alone])
    return every[alone], owner[alone]


def between_sides(
    points: np.ndarray, cells: np.ndarray, pairs: tuple[np.ndarray, np.ndarray], slack: float | np.ndarray
) -> np.ndarray:
    """Which of `pairs`, rows of `points` (n, dim) and of `cells` (c, corners, dim), have the point between the planes of the
    cell's sides, or at most `slack` beyond, one for all or of each (pairs,); (pairs,) bool. All in one unit of length."""
    row, cell = pairs
    dim, middle = points.shape[1], cells.mean(1)
    within = np.ones(len(row), bool)
    for corners in cell_sides(cells.shape[1], dim):
        ends = cells[:, corners]
        if dim == 3 and len(corners) == 3:
            ends = ends[:, [0, 1, 2, 2]]
        _, vector = face_shares(ends, middle)
        normal, on = vector.sum(1), ends.mean(1)
        height = np.einsum("ka,ka->k", points[row] - on[cell], normal[cell])
        within &= height <= slack * np.linalg.norm(normal[cell], axis=1)
    return within


def _place(nodes: np.ndarray, side: np.ndarray) -> str:
    """The middle of a side (j,), which may have a node twice, in words."""
    return f"{rounded(nodes[np.unique(side)].mean(0))} m"


def _refuse_meeting(nodes: np.ndarray, sides: np.ndarray) -> None:
    """Refuse outer quadrilaterals on which triangles lie: what is no side of both is none of either, but a crack."""
    narrow = sides[:, 2] == sides[:, 3]
    triples = np.concatenate([np.delete(sides[~narrow], k, 1) for k in range(4)])
    rows = np.sort(np.concatenate([sides[narrow, :3], triples]), axis=1)
    _, where = np.unique(rows, axis=0, return_inverse=True)
    meeting = np.isin(where.ravel()[: int(narrow.sum())], where.ravel()[int(narrow.sum()) :])
    if meeting.any():
        place = _place(nodes, sides[narrow][meeting][0])
        raise ValueError(
            f"tetrahedra meet hexahedra at {place}: sides with three corners cannot be joined to those with four; mesh it"
            " with one kind of cells"
        )


def named_sides(
    sides: np.ndarray, groups: Iterable[tuple[str, np.ndarray]], sets: Iterable[tuple[str, np.ndarray]]
) -> Iterator[tuple[str, np.ndarray]]:
    """Names and rows of outer `sides` (m, j): of `groups` of sides by their corners (s, c), -1 for what no cell has, and of
    `sets` of nodes the sides all of whose nodes they hold."""
    keys = {tuple(np.unique(side)): k for k, side in enumerate(sides)}
    rows: dict[str, list[int]] = {}
    for name, members in groups:
        at = [keys[key] for key in (tuple(np.unique(corners)) for corners in members) if key in keys]
        rows.setdefault(name, []).extend(at)
    count = int(sides.max()) + 1
    for name, members in sets:
        within = np.zeros(count, bool)
        within[members[(members >= 0) & (members < count)]] = True
        rows.setdefault(name, []).extend(np.flatnonzero(within[sides].all(1)).tolist())
    yield from ((name, np.unique(found)) for name, found in rows.items() if found)
