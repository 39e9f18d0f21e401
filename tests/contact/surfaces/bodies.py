"""Bodies whose surfaces are tested: in one, two and three dimensions, of lattices and of meshes."""

from itertools import permutations
from typing import Any

import numpy as np

from tests import scenes
from wsph.contact.surfaces.meshing.mesh import SurfaceMesh, surface_mesh
from wsph.contact.surfaces.meshing.own import OwnCells
from wsph.contact.surfaces.meshing.shell import Shell, shell_of
from wsph.geometry.fitted.fit import fit
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import lattice
from wsph.geometry.meshes.mesh import Mesh
from wsph.geometry.meshes.meshed import meshed
from wsph.geometry.meshes.sides import outer_sides

NONE = np.zeros((0, 2), int)
"""No cells that have parted."""

SQUARE, CUBE = scenes.box(1.0, 1.0), scenes.box(1.0, 1.0, 1.0)
DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}
SPHERE = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0}
CYLINDER = {"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 0.0, 2.0], "radius": 1.0}
PLATE = {"type": "difference", "shapes": [scenes.box((-1.0, 1.0), (-1.0, 1.0)), {**DISC, "radius": 0.5}]}
SLIT = (((0.5, 0.0), (0.5, 0.5)),)
"""A crack from an edge of the unit square to its middle."""


def cut(shape: scenes.Data, spacing: float | tuple[float, ...], jitter: float = 0.0, **keys: Any) -> Geometry:
    """A shape cut into the cells of a grid."""
    return lattice(scenes.shape(**shape), spacing, jitter, 5, **keys)


def bent(points: np.ndarray) -> np.ndarray:
    """A map that bends and stretches."""
    return points + 0.1 * np.sin(2.0 * np.roll(points, 1, axis=1))


def of_cells(nodes: np.ndarray, *blocks: np.ndarray) -> Geometry:
    """A mesh of some cells."""
    sides, cell = outer_sides(nodes, blocks)
    return meshed(Mesh(nodes, blocks, sides, cell, np.zeros(len(sides), int), ("all",)))


def simplices(dim: int, cells: int, *, half: bool = False) -> Geometry:
    """A cube of triangles or tetrahedra; `half`: beside it another one of quadrilaterals or hexahedra."""
    grid = cut(SQUARE if dim == 2 else CUBE, 1.0 / cells)
    corners = grid.blocks[0]
    steps = 2 ** np.arange(dim)[::-1]
    paths = [np.cumsum([0, *(steps[k] for k in order)]) for order in permutations(range(dim))]
    parts = np.concatenate([corners[:, path] for path in paths])
    way = grid.nodes[parts[:, 1:]] - grid.nodes[parts[:, :1]]
    inverted = np.linalg.det(way) < 0.0
    parts[inverted] = parts[inverted][:, [1, 0, *range(2, dim + 1)]]
    if not half:
        return of_cells(bent(grid.nodes), parts)
    nodes = np.concatenate([grid.nodes, grid.nodes + 2.0])
    return of_cells(nodes, parts, corners + len(grid.nodes))


BODIES: dict[str, Any] = {
    "bar": lambda: cut(scenes.box(1.0), 0.1),
    "jittered bar": lambda: cut(scenes.box(1.0), 0.1, 0.2),
    "rectangle": lambda: cut(scenes.box(1.0, 0.5), (0.1, 0.05)),
    "jittered square": lambda: cut(SQUARE, 0.1, 0.2),
    "disc": lambda: cut(DISC, 0.1),
    "jittered plate": lambda: cut(PLATE, 0.1, 0.2),
    "turned plate": lambda: cut(PLATE, 0.1, lattice_rotate=20.0),
    "cracked square": lambda: cut(SQUARE, 0.1, cracks=SLIT),
    "unsplit crack": lambda: cut(SQUARE, 0.1, cracks=SLIT, split=False),
    "bent square": lambda: cut(SQUARE, 0.1, map=bent),
    "fitted disc": lambda: meshed(fit(scenes.shape(**DISC), 0.1)),
    "fitted plate": lambda: meshed(fit(scenes.shape(**PLATE), 0.1)),
    "triangles": lambda: simplices(2, 5),
    "triangles and squares": lambda: simplices(2, 5, half=True),
    "cube": lambda: cut(CUBE, 0.2, 0.2),
    "sphere": lambda: cut(SPHERE, 0.2),
    "turned box": lambda: cut(scenes.box(2.0, 1.0, 1.0), 0.2, lattice_rotate=((0.0, 0.0, 1.0), 30.0)),
    "bent cube": lambda: cut(CUBE, 0.2, map=bent),
    "cracked cube": lambda: cut(CUBE, 0.2, cracks=(((0.4, 0.0, 0.0), (0.4, 0.4, 1.0)),)),
    "fitted sphere": lambda: meshed(fit(scenes.shape(**SPHERE), 0.2)),
    "tetrahedra": lambda: simplices(3, 3),
    "tetrahedra and cubes": lambda: simplices(3, 3, half=True),
}
"""Geometries by name."""

MESHES = tuple(name for name in BODIES if name.startswith(("fitted", "triangles", "tetrahedra")))
"""Those that no grid has cut."""


def cells_of(geometry: Geometry) -> int:
    """How many cells there are."""
    return sum(len(corners) for corners in geometry.blocks)


def around(geometry: Geometry, parted: np.ndarray = NONE, live: np.ndarray | None = None) -> Shell:
    """The shell of all cells, or of those that are `live`."""
    own = OwnCells.of(geometry)
    return shell_of(geometry, own, np.ones(own.whole, bool) if live is None else live, parted, deep=True)


def whole(geometry: Geometry, parted: np.ndarray = NONE) -> SurfaceMesh:
    """The surface of all cells."""
    return surface_mesh(around(geometry, parted), deep=True)
