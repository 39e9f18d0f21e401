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
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from wsph.geometry.gradients import mean_gradients
from wsph.geometry.meshes.abaqus import read_abaqus
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.meshes.sides import named_sides, outer_sides

UNNAMED = "unnamed"
"""The patch of sides that no group names."""

INNER = {2: {"quad": (0, 3, 1, 2), "triangle": (0, 1, 2)},
         3: {"hexahedron": (0, 4, 3, 7, 1, 5, 2, 6), "tetra": (0, 1, 2, 3)}}  # fmt: skip
"""By dimension, the cells that a body can have, and the places of a lattice's corners in a file's order."""

OUTER = {2: ("line",), 3: ("triangle", "quad")}
"""What can be a side of those."""

DIMENSION = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3}
"""Dimensions of the cells that a file's groups are of."""

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
    if dim not in INNER:
        raise ValueError("a mesh has cells of two or three dimensions, and the scene has dim = 1: give it a shape")
    if not path.is_file():
        raise FileNotFoundError(f"{path} is {'a folder' if path.is_dir() else 'no file'}")
    found = _found(path)
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
    used, blocks = _renumbered([_once(corners)[:, list(INNER[dim][kind])] for kind, corners in merged.items()])
    nodes = points[used]
    blocks = tuple(_upright(nodes, corners) for corners in blocks)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    sides, owner = outer_sides(nodes, blocks)
    outer = [
        (name, number[each.corners[rows]])
        for each in cells
        if each.kind in OUTER[dim]
        for name, rows in each.groups.items()
    ]
    sets = [(name, number[np.asarray(rows, int)]) for name, rows in (found.point_sets or {}).items()]
    groups = dict(named_sides(sides, outer, sets))
    named = np.zeros(len(sides), bool)
    for name, rows in groups.items():
        named[rows] |= name != UNNAMED
    if not named.all():
        groups[UNNAMED] = np.flatnonzero(~named)
    return Mesh(nodes, blocks, sides, owner, np.zeros(len(sides), int), (), groups)


def _found(path: Path) -> Any:
    """What a file has, as meshio has it. Its reader of Abaqus' files gives sets to other elements than theirs."""
    try:
        # Readers print, and end the process, where a file is not what its name says.
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            return read_abaqus(path) if path.suffix.lower() == ".inp" else meshio.read(path)
    except (Exception, SystemExit) as error:
        said = str(error).strip().splitlines()[:1]
        text = f"{path.name} cannot be read as a mesh{': ' + said[0] if said else ''}"
        if path.suffix.lower() != ".inp":
            text += f"; it is cut short, or of another kind than {path.suffix or 'a name without an ending'} says"
        raise ValueError(text) from error


def _cells(found: Any) -> Iterator[_Cells]:
    """The blocks of cells of a file with their groups. Gmsh numbers its groups in every dimension apart; one without a name
    has its number for one."""
    names = {(int(tag), int(dim)): name for name, (tag, dim) in _physical(found)}
    physical = (found.cell_data or {}).get("gmsh:physical")
    for k, block in enumerate(found.cells):
        corners = np.asarray(block.data)
        groups: dict[str, np.ndarray] = {}
        for name, rows in (found.cell_sets or {}).items():
            if not name.startswith("gmsh:") and rows[k] is not None and len(rows[k]):
                groups[name] = np.asarray(rows[k], int)
        if physical is not None:
            for tag in np.unique(physical[k]):
                name = names.get((int(tag), DIMENSION.get(block.type, -1)), str(int(tag)))
                if tag > 0:
                    groups[name] = np.flatnonzero(physical[k] == tag)
        yield _Cells(block.type, corners, groups)


def _physical(found: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Names of Gmsh's physical groups with their tags and dimensions."""
    for name, value in (found.field_data or {}).items():
        if np.shape(value) == (2,):
            yield name, np.asarray(value)


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


def _once(corners: np.ndarray) -> np.ndarray:
    """Cells without those that a file has again, once for each of their groups."""
    _, first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)
    return corners[np.sort(first)]


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
