"""Which points lie inside of a body whose cells are of no grid, in any configuration: inside of one of its cells, and as far
below its surface as is asked. Of one that processes share each looks at its own cells."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np

from wsph.backend.domain import Domain, anywhere
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
        self.domain, self.share = geometry.split.domain, geometry.split.nodes

    @property
    def places(self) -> np.ndarray:
        """Of its particles here at the start, (n, dim) [m]."""
        return self.geometry.nodes

    def inside(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points (k, dim) [m], the same in all processes, lie inside where the particles here are at `places` (n, dim)
        [m], `depth` [spacings] below the surface, (k,) bool."""
        found = np.zeros(len(points), bool)
        for corners, own in zip(self.geometry.blocks, self.geometry.own_cells, strict=True):
            found |= _in_cells(points, places[corners[own]], self.domain)
        found = anywhere(self.domain, found)
        found[found] = ~self._near_surface(points[found], places, depth * self.geometry.spacing)
        return found

    def _near_surface(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points inside are less than `depth` [m] below one of the outer sides."""
        near = np.zeros(len(points), bool)
        if depth == 0.0 or not len(points):
            return near
        faces, own = self.geometry.faces, self.geometry.own_faces
        ends = places[faces.nodes[own]]
        middle = ends.mean(1)
        size = _largest(np.linalg.norm(ends - middle[:, None], axis=2), self.domain) + depth
        _, vector = face_shares(ends, self._middles(places)[faces.cell[own]])
        normal = vector.sum(1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        pairs = find_pairs(points / size, middle / size, 1.0)
        row, side = pairs.rows(), pairs.indices.numpy()
        height = np.einsum("ka,ka->k", points[row] - middle[side], normal[side])
        near[row[height > -depth]] = True
        return anywhere(self.domain, near)

    def _middles(self, places: np.ndarray) -> np.ndarray:
        """Of the cells here, (c, dim) [m]."""
        return np.concatenate([places[corners].mean(1) for corners in self.geometry.blocks])


def _largest(values: np.ndarray, domain: Domain) -> float:
    return float(domain.max(np.array(values.max(initial=0.0))))


def _in_cells(points: np.ndarray, cells: np.ndarray, domain: Domain) -> np.ndarray:
    """Which points (k, dim) lie in one of some cells (c, corners, dim), between the planes of their sides, (k,) bool. The
    others of a `domain` have cells of theirs."""
    middle = cells.mean(1)
    reach = _largest(np.linalg.norm(cells - middle[:, None], axis=2), domain)
    found = np.zeros(len(points), bool)
    pairs = find_pairs(points / reach, middle / reach, 1.0 + SLACK)
    row, cell = pairs.rows(), pairs.indices.numpy()
    found[row[between_sides(points, cells, (row, cell), SLACK * reach)]] = True
    return found
