"""Meshes from files: what meshio reads, with groups of cells as parts and groups of sides or nodes as patches.

Quadrilaterals, hexahedra, triangles and tetrahedra of the first order. Names come from Gmsh's physical groups (formats 2.2
and 4.1) and from Abaqus' sets; an unnamed side belongs to the patch "unnamed".
"""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
# pyright: reportUnknownArgumentType=false, reportUnknownVariableType=false

import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from wsph.geometry.cells import edge_ends
from wsph.geometry.gradients import mean_gradients
from wsph.geometry.meshes.mesh import Mesh

UNNAMED = "unnamed"
"""The patch of sides that no group names."""

INNER = {2: {"quad": (0, 3, 1, 2), "triangle": (0, 1, 2)},
         3: {"hexahedron": (0, 4, 3, 7, 1, 5, 2, 6), "tetra": (0, 1, 2, 3)}}  # fmt: skip
"""By dimension, the cells that a body can have, and the places of a lattice's corners in a file's order."""

OUTER = {2: ("line",), 3: ("triangle", "quad")}
"""What can be a side of those."""

IGNORED = ("vertex", "line", "line3")
"""Cells of a file that are of no interest to a body."""


@dataclass(frozen=True)
class _Cells:
    """Cells of one kind, corners (c, k) as the file has them, with the names of the groups that each is in."""

    kind: str
    corners: np.ndarray
    groups: dict[str, np.ndarray]


def read_mesh(path: Path, dim: int, scale: float, part: str | None = None) -> Mesh:
    """The mesh of a file, its lengths times `scale` [m], or of it the group of cells `part`. Raises ValueError for a file
    that cannot be read, has no cells of the dimension or cells that a body cannot have, and OSError where there is none."""
    if not path.is_file():
        raise FileNotFoundError(f"{path} is no file")
    try:
        # Readers print, and end the process, where a file is not what its name says.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            found = meshio.read(path)
    except (Exception, SystemExit) as error:
        said = str(error).strip().splitlines()[:1]
        raise ValueError(f"{path.name} cannot be read as a mesh{': ' + said[0] if said else ''}") from error
    cells = list(_cells(found))
    inner = [each for each in cells if each.kind in INNER[dim]]
    _refuse_others(path, dim, cells)
    if part is not None:
        inner = _of_part(path, inner, part)
    if not inner:
        kinds = sorted({each.kind for each in cells})
        raise ValueError(f"{path.name} has no {' or '.join(INNER[dim])}: it has {', '.join(kinds) or 'no cells'}")
    points = _points(found, path, dim, inner) * scale
    merged = {kind: np.concatenate([each.corners for each in inner if each.kind == kind]) for kind in INNER[dim]
              if any(each.kind == kind for each in inner)}  # fmt: skip
    used, blocks = _renumbered([corners[:, list(INNER[dim][kind])] for kind, corners in merged.items()])
    nodes = points[used]
    blocks = tuple(_upright(nodes, corners) for corners in blocks)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    sides, owner = outer_sides(blocks, dim)
    groups = dict(_named_sides(found, cells, dim, number, sides))
    named = np.zeros(len(sides), bool)
    for rows in groups.values():
        named[rows] = True
    if not named.all():
        groups[UNNAMED] = np.flatnonzero(~named)
    return Mesh(nodes, blocks, sides, owner, np.zeros(len(sides), int), (), groups)


def _cells(found: Any) -> Iterator[_Cells]:
    """The blocks of cells of a file with their groups."""
    names = {int(tag): (name, int(dim)) for name, (tag, dim) in (found.field_data or {}).items()}
    physical = (found.cell_data or {}).get("gmsh:physical")
    for k, block in enumerate(found.cells):
        corners = np.asarray(block.data)
        groups: dict[str, np.ndarray] = {}
        for name, rows in (found.cell_sets or {}).items():
            if not name.startswith("gmsh:") and rows[k] is not None and len(rows[k]):
                groups[name] = np.asarray(rows[k], int)
        if physical is not None and names:
            for tag in np.unique(physical[k]):
                if int(tag) in names:
                    groups[names[int(tag)][0]] = np.flatnonzero(physical[k] == tag)
        yield _Cells(block.type, corners, groups)


def _refuse_others(path: Path, dim: int, cells: list[_Cells]) -> None:
    known = {*INNER[dim], *OUTER[dim], *IGNORED}
    other = sorted({each.kind for each in cells if each.kind not in known})
    if other:
        raise ValueError(
            f"{path.name} has cells of kind {', '.join(other)}; a body in {dim}D can have {' and '.join(INNER[dim])} of the"
            " first order: mesh it again with those"
        )


def _of_part(path: Path, inner: list[_Cells], part: str) -> list[_Cells]:
    names = sorted({name for each in inner for name in each.groups})
    if part not in names:
        raise ValueError(f"{path.name} has no group of cells {part!r}: it has {', '.join(names) or 'none'}")
    return [_Cells(each.kind, each.corners[each.groups[part]], {}) for each in inner if part in each.groups]


def _points(found: Any, path: Path, dim: int, inner: list[_Cells]) -> np.ndarray:
    points = np.asarray(found.points, float)
    if points.shape[1] > dim:
        used = np.unique(np.concatenate([each.corners.ravel() for each in inner]))
        beyond = points[used, dim:]
        if np.ptp(beyond, axis=0).max() > 1e-9 * max(np.ptp(points[used, :dim], axis=0).max(), 1e-300):
            raise ValueError(f"{path.name} is not flat in z, and the scene has dim = {dim}")
        points = points[:, :dim]
    if not np.isfinite(points).all():
        raise ValueError(f"{path.name} has nodes whose coordinates are not finite")
    return points


def _renumbered(blocks: list[np.ndarray]) -> tuple[np.ndarray, list[np.ndarray]]:
    """The nodes that cells use, in the file's order, and the cells by their new numbers."""
    used, where = np.unique(np.concatenate([corners.ravel() for corners in blocks]), return_inverse=True)
    ends = np.cumsum([corners.size for corners in blocks])[:-1]
    parts = np.split(where.ravel(), ends)
    return used, [part.reshape(corners.shape) for part, corners in zip(parts, blocks, strict=True)]


def _upright(nodes: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Cells with those turned round whose volume would be negative."""
    dim, count = nodes.shape[1], corners.shape[1]
    volume = mean_gradients(nodes, corners)[1]
    order = np.arange(count)
    if count == dim + 1:
        order[-2:] = order[-2:][::-1]
    else:
        order = order.reshape((2,) * dim).swapaxes(0, 1).ravel()
    return np.where((volume < 0.0)[:, None], corners[:, order], corners)


def cell_sides(count: int, dim: int) -> np.ndarray:
    """The corners of each side of a cell with `count` corners, rows."""
    if count == dim + 1:
        return np.array(list(combinations(range(count), dim)))
    offsets = np.array(list(product((0, 1), repeat=dim)))
    return np.concatenate([np.stack(edge_ends(offsets, axis)) for axis in range(dim)])


def outer_sides(blocks: tuple[np.ndarray, ...], dim: int) -> tuple[np.ndarray, np.ndarray]:
    """The sides that belong to one cell alone, (m, j) nodes, a triangle among quadrilaterals with its last node twice, and
    the cells that they belong to (m,), counted through all blocks."""
    width = 2 if dim == 2 else max(3 if corners.shape[1] == 4 else 4 for corners in blocks)
    sides: list[np.ndarray] = []
    owners: list[np.ndarray] = []
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
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    if (count > 2).any():
        raise ValueError("more than two cells share a side")
    alone = np.sort(first[count == 1])
    return every[alone], owner[alone]


def _named_sides(
    found: Any, cells: list[_Cells], dim: int, number: np.ndarray, sides: np.ndarray
) -> Iterator[tuple[str, np.ndarray]]:
    """Groups of sides, and of nodes whose sides they make, by name and rows."""
    keys = {tuple(np.unique(side)): k for k, side in enumerate(sides)}
    rows: dict[str, list[int]] = {}
    for each in cells:
        if each.kind not in OUTER[dim]:
            continue
        for name, members in each.groups.items():
            for corners in number[each.corners[members]]:
                at = keys.get(tuple(np.unique(corners)))
                if at is not None:
                    rows.setdefault(name, []).append(at)
    for name, members in (found.point_sets or {}).items():
        chosen = np.zeros(len(number), bool)
        chosen[np.asarray(members, int)] = True
        within = np.zeros(int(number.max()) + 1, bool)
        within[number[chosen & (number >= 0)]] = True
        at = np.flatnonzero(within[sides].all(1))
        if len(at):
            rows.setdefault(name, []).extend(at.tolist())
    for name, found_rows in rows.items():
        yield name, np.unique(found_rows)
