"""Which points lie inside of a body whose cells are of no grid, in any configuration: inside of one of its cells, and as far
below its surface as is asked."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np

from wsph.geometry.gradients import face_shares
from wsph.geometry.meshes.meshed import Meshed
from wsph.geometry.meshes.sides import between_sides
from wsph.sph.pairs import find_pairs

SLACK = 1e-9
"""Part of a cell by which a point on its side counts as inside."""


class MeshSolid:
    """A body of a mesh as something that takes up room; its particles are the nodes."""

    at_nodes = True

    def __init__(self, geometry: Meshed):
        self.geometry = geometry

    @property
    def places(self) -> np.ndarray:
        """Of its particles at the start, (n, dim) [m]."""
        return self.geometry.nodes

    def inside(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points (k, dim) [m] lie inside where the particles are at `places` (n, dim) [m], `depth` [spacings] below
        the surface, (k,) bool."""
        found = np.zeros(len(points), bool)
        for corners in self.geometry.mesh.blocks:
            found |= _in_cells(points, places[corners])
        found[found] = ~self._near_surface(points[found], places, depth * self.geometry.spacing)
        return found

    def _near_surface(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points inside are less than `depth` [m] below one of the outer sides."""
        near = np.zeros(len(points), bool)
        if depth == 0.0 or not len(points):
            return near
        faces = self.geometry.faces
        ends = places[faces.nodes]
        middle = ends.mean(1)
        size = float(np.linalg.norm(ends - middle[:, None], axis=2).max()) + depth
        _, vector = face_shares(ends, self._behind(places))
        normal = vector.sum(1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        pairs = find_pairs(points / size, middle / size, 1.0)
        row, side = pairs.rows(), pairs.indices.numpy()
        height = np.einsum("ka,ka->k", points[row] - middle[side], normal[side])
        near[row[height > -depth]] = True
        return near

    def _behind(self, places: np.ndarray) -> np.ndarray:
        """The middles of the cells that the outer sides belong to, (m, dim) [m]."""
        middles = np.concatenate([places[corners].mean(1) for corners in self.geometry.mesh.blocks])
        return middles[self.geometry.faces.cell]


def _in_cells(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Which points (k, dim) lie in one of some cells (c, corners, dim), between the planes of their sides, (k,) bool."""
    middle = cells.mean(1)
    reach = float(np.linalg.norm(cells - middle[:, None], axis=2).max())
    found = np.zeros(len(points), bool)
    pairs = find_pairs(points / reach, middle / reach, 1.0 + SLACK)
    row, cell = pairs.rows(), pairs.indices.numpy()
    found[row[between_sides(points, cells, (row, cell), SLACK * reach)]] = True
    return found
