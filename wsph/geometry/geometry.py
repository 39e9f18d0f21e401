"""The geometry of a body cut into cells, whatever cut it: nodes, points that carry the stress, and faces.

What needs the lines of a grid takes a `wsph.geometry.lattice.Lattice`; all others take this.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import WHOLE, Share, Split
from wsph.geometry.cells import Boxes
from wsph.geometry.cracks import Crack
from wsph.geometry.faces import Faces
from wsph.geometry.gradients import PointRows
from wsph.geometry.meshes.sides import between_sides
from wsph.ranks.cuts import Counts
from wsph.ranks.slabs import Cutting

BULGE = 0.1
"""Height of a round surface over the sides of cells that follow it, over half of the diameter of a cell, at most: an arc
over a chord h rises by h^2/(8 R), and a radius R has at least two cells."""


@dataclass(frozen=True)
class Geometry:
    """A body cut into cells: `nodes` (n, dim) [m], and points that carry the stress, one a cell or, of triangles and
    tetrahedra, one an edge: their volumes `cell_volume` (c,) [m^dim].

    `node_volume` (n,) [m^dim]. `edges` [m]: the shortest edge of a cell of a grid, otherwise that of a cube whose waves
    swing as fast as the fastest of the body's; and the longest edge of a cell.
    """

    nodes: np.ndarray
    node_volume: np.ndarray
    cell_volume: np.ndarray
    faces: Faces
    edges: tuple[float, float]

    @property
    def cells(self) -> np.ndarray:
        """Places of the points (c, dim) [m]."""
        raise NotImplementedError

    @property
    def split(self) -> Split:
        """The part of the whole body that it is."""
        return Split(WHOLE, Share.all(len(self.nodes)), Share.all(len(self.cell_volume)))

    @property
    def mean_volume(self) -> float:
        """Mean of the volumes of the points of the whole body [m^dim]."""
        return float(self.cell_volume.mean())

    def wider(self, layers: tuple[int, int]) -> "Geometry":
        """The same part of the body with more around it: at least some layers of cells, from one up to another. All
        processes that share the body ask for it together."""
        return self

    def seeing(self, layers: tuple[int, int]) -> "Geometry":
        """The same part with more copies around it: at least those of some layers, whose state need not be that of their
        owners in every step. All processes that share the body ask for it together."""
        return self

    @property
    def cutting(self) -> Cutting | None:
        """How it is cut for the processes that share it, if any do."""
        return None

    def cut_by(self, visits: np.ndarray) -> "Geometry":
        """The part that this process has where the body is cut by other `visits` of pairs (l,) in its layers. All processes
        that share the body ask for it together."""
        return self

    @property
    def spacing(self) -> float:
        """The first of `edges` [m]: what Courant numbers count in."""
        return self.edges[0]

    @property
    def mapped(self) -> bool:
        """Whether cells differ in size and direction."""
        return True

    @property
    def irregular(self) -> bool:
        """Whether cells differ at all."""
        return True

    @property
    def axes(self) -> np.ndarray:
        """Directions of the body's own axes, columns (dim, dim)."""
        return np.eye(self.nodes.shape[1])

    @property
    def upright(self) -> bool:
        """Whether those are the coordinate axes."""
        return bool((self.axes == np.eye(self.nodes.shape[1])).all())

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """Cuts from the start."""
        return ()

    @property
    def boxes(self) -> Boxes | None:
        """Those of its cells that are alike, if any."""
        return None

    @property
    def rows(self) -> PointRows:
        """The nodes that each point sees, those of its own cells, and where cells differ the gradients."""
        raise NotImplementedError

    @property
    def sides(self) -> Faces:
        """The faces as loads and selections see them."""
        return self.faces

    def across(self, places: np.ndarray) -> np.ndarray:
        """Where places (n, dim) [m] are across the layers that the body can be cut between, (n,), before any map."""
        raise NotImplementedError

    @property
    def node_layer(self) -> np.ndarray:
        """The layers of the nodes, (n,)."""
        return np.floor(self.across(self.nodes))

    @property
    def point_layer(self) -> np.ndarray:
        """The layers of the points, (c,)."""
        return np.floor(self.across(self.cells))

    @property
    def layer_count(self) -> int:
        """How many layers of points the whole body has."""
        raise NotImplementedError

    @property
    def counts(self) -> Counts:
        """What is in these layers, of a body that is whole."""
        raise NotImplementedError

    @property
    def own_faces(self) -> np.ndarray:
        """Which of the faces are this part's own, (m,) bool: those of points that it owns."""
        return np.ones(len(self.faces.cell), bool)

    @property
    def blocks(self) -> tuple[np.ndarray, ...]:
        """Corners of the cells (c, k), node ids, by their kind: of quadrilaterals and hexahedra in the order of
        `itertools.product` of 0 and 1 along the cell's axes."""
        raise NotImplementedError

    @property
    def points_of_cells(self) -> tuple[np.ndarray, ...]:
        """The points of the cells of every block, (c, m): the one in each, or those on its edges."""
        raise NotImplementedError

    @property
    def size(self) -> float:
        """The edge of a cube of a cell's mean volume [m]."""
        return self.mean_volume ** (1.0 / self.nodes.shape[1])

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (m, dim) [m] lie in a cell, or beside one by less than a round surface bulges over its sides,
        (m,) bool."""
        found = np.zeros(len(points), bool)
        for corners in self.blocks:
            cells = self.nodes[corners]
            middle = cells.mean(1)
            reach = np.linalg.norm(cells - middle[:, None], axis=2).max(1)
            for k in np.flatnonzero(~found):
                near = np.flatnonzero(np.linalg.norm(points[k] - middle, axis=1) <= (1.0 + BULGE) * reach)
                row = np.full(len(near), k)
                found[k] = between_sides(points, cells, (row, near), BULGE * reach[near]).any()
        return found

    @property
    def own_cells(self) -> tuple[np.ndarray, ...]:
        """Which cells of every block are this part's own, (c,) bool: those whose first point it owns, which no other has."""
        return tuple(self.split.points.owns(points.min(1)) for points in self.points_of_cells)

    @property
    def middle(self) -> np.ndarray:
        """The middle of the whole body, the mean of its nodes (dim,) [m]."""
        return self.nodes.mean(0)

    def places(self, length: float) -> np.ndarray:
        """Nodes (n, dim) in units of `length` [m] about the middle of the body, along the coordinate axes."""
        return (self.nodes - self.middle) / length

    def comparable(self, points: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, dim) [m] and nodes or cells (m, dim) [m] in units of cells, to find who is near whom."""
        return points / self.edges[1], sources / self.edges[1]

    @property
    def centred(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n, dim) and points (c, dim) in units of cells about the middle of the body."""
        middle = self.middle
        return (self.nodes - middle) / self.edges[1], (self.cells - middle) / self.edges[1]

    @property
    def off_cracks(self) -> tuple[np.ndarray, np.ndarray]:
        """The same, moved so that none lies on a crack."""
        return self.centred

    def crossed(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Which of the lines between two points (n, dim), as `off_cracks` has them, cross a crack, (n,) bool."""
        parted = np.zeros(len(first), bool)
        for crack in self.cracks:
            parted |= crack.crosses(first, second)
        return parted

    @property
    def on_face(self) -> np.ndarray:
        """Nodes on any face, (n,) bool."""
        mask = np.zeros(len(self.nodes), bool)
        mask[self.faces.nodes.ravel()] = True
        return mask
