"""Which particles of a body lie inside of another, in any configuration.

Each body knows the grid that it is cut from. A point has grid coordinates in it, those of the particle nearest to it and
what lies between, through the slopes of the places around that particle; it lies inside, some depth below the surface,
where all cells within that depth of it are filled.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cached_property
from itertools import product

import numpy as np

from wsph.contact.mesh_solid import MeshSolid
from wsph.contact.point_solid import PointSolid
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice, on_grid
from wsph.geometry.meshes.meshed import Meshed
from wsph.geometry.meshes.scattered import Scattered
from wsph.sph.pairs import find_pairs

SURFACE = 1e-6
"""Depth [cells] from which a place at the start is inside: touching faces are not."""

EASED = {"surface": 1.0, "tie": 0.5}
"""Depth, in the larger spacing, up to which surfaces may overlap at the start, by the laws of contact that take it for none.
Two curved ones in cells of their own do, and the cells of a turned lattice reach out of its shape by most of one."""

PASSED = {True: 0.05, False: 0.5}
"""Depth [cells] below the surface at which a particle has passed the outermost particles of a body: these stand on the
surface, at nodes, or half a cell below it, at the centres of cells."""

REACH = 1.5
"""Distance [spacings] within which the nearest particle is looked for."""


class Solid:
    """A body as something that takes up room. `at_nodes`: its particles are the nodes of the lattice, else its cells."""

    def __init__(self, lattice: Lattice, at_nodes: bool):
        self.geometry = self.lattice = lattice
        self.at_nodes = at_nodes
        cells = np.floor(lattice.index[lattice.corners].mean(1)).astype(int)
        self._low, self._cells = cells.min(0) - 1, cells
        self._filled = np.zeros(tuple(np.ptp(cells, axis=0) + 3), bool)
        self._filled[tuple((cells - self._low).T)] = True

    @property
    def places(self) -> np.ndarray:
        """Of its particles at the start, (n, dim) [m]."""
        return self.lattice.nodes if self.at_nodes else self.lattice.cells

    @cached_property
    def _index(self) -> np.ndarray:
        """Grid coordinates of its particles."""
        index = self.lattice.index
        return index if self.at_nodes else index[self.lattice.corners].mean(1)

    @cached_property
    def _beside(self) -> np.ndarray:
        """The particles before and behind each along every axis of the grid, itself where there is none, (n, dim, 2)."""
        if self.at_nodes:
            return self.lattice.neighbours
        number = np.full(self._filled.shape, -1)
        number[tuple((self._cells - self._low).T)] = np.arange(len(self._cells))
        found = np.empty((*self._cells.shape, 2), int)
        for axis, side in product(range(self._cells.shape[1]), (0, 1)):
            there = self._cells - self._low
            there[:, axis] += 2 * side - 1
            found[:, axis, side] = number[tuple(there.T)]
        return np.where(found < 0, np.arange(len(found))[:, None, None], found)

    def coordinates(self, points: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Grid coordinates of points (k, dim) [m] where the particles are at `places` (n, dim) [m]; NaN beyond them."""
        result = np.full(points.shape, np.nan)
        unit = self.lattice.edges[1]
        low, high = points.min(0) - REACH * unit, points.max(0) + REACH * unit
        near = np.flatnonzero(((places >= low) & (places <= high)).all(1))
        pairs = find_pairs(points / unit, places[near] / unit, REACH)
        seen: np.ndarray = pairs.indices.numpy()
        row, other = pairs.rows(), near[seen]
        if not len(row):
            return result
        distance = np.linalg.norm(points[row] - places[other], axis=1)
        order = np.lexsort((distance, row))
        first = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        k, nearest = row[first], other[first]
        away = np.linalg.solve(self._slopes(nearest, places), (points[k] - places[nearest])[:, :, None])[:, :, 0]
        result[k] = self._index[nearest] + away
        return result

    def _slopes(self, particles: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Places over grid coordinates at some particles, (k, dim, dim) [m]; as at the start where they say nothing."""
        before, behind = (self._beside[particles, :, side] for side in (0, 1))
        dim = places.shape[1]
        apart = self._index[behind, np.arange(dim)] - self._index[before, np.arange(dim)]
        whole = self.lattice.frame.axes * self.lattice.frame.step
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = ((places[behind] - places[before]) / apart[:, :, None]).transpose(0, 2, 1)
        slopes = np.where((apart != 0.0)[:, None, :], slopes, whole)
        size = np.atleast_1d(np.abs(np.linalg.det(slopes / self.lattice.spacing)))
        return np.where((size > 1e-3)[:, None, None], slopes, whole)

    def inside(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points (k, dim) [m] lie inside where the particles are at `places` (n, dim) [m], `depth` [cells] below the
        surface, (k,) bool."""
        return self.holds(self.coordinates(points, places), depth)

    def holds(self, coordinates: np.ndarray, depth: float) -> np.ndarray:
        """Which grid coordinates (k, dim) lie inside, `depth` [cells] below the surface, (k,) bool."""
        known = np.logical_and.reduce(np.isfinite(coordinates), axis=1)
        at = np.where(known[:, None], coordinates, -np.inf)
        for corner in product((-depth, depth), repeat=coordinates.shape[1]):
            cell = np.clip(np.floor(at + corner) - self._low, 0, np.array(self._filled.shape) - 1).astype(int)
            known &= self._filled[tuple(cell.T)]
        return known


AnySolid = Solid | MeshSolid | PointSolid


def solid_of(geometry: Geometry, *, at_nodes: bool) -> AnySolid:
    """A body as something that takes up room; `at_nodes`: its particles are the nodes, else the cells of a lattice."""
    if isinstance(geometry, Meshed):
        return MeshSolid(geometry)
    if isinstance(geometry, Scattered):
        return PointSolid(geometry)
    return Solid(on_grid(geometry), at_nodes)


def first_inside(places: np.ndarray, other: AnySolid, others: np.ndarray, depth: float | None = None) -> int | None:
    """The first of `places` (n, dim) [m] inside of a body whose particles are at `others` (m, dim) [m], or None. `depth`
    [cells] below its surface; by default that at which its outermost particles have been passed."""
    low, high = others.min(0), others.max(0)
    near = np.flatnonzero(((places >= low) & (places <= high)).all(1))
    if not len(near):
        return None
    inside = other.inside(places[near], others, PASSED[other.at_nodes] if depth is None else depth)
    return int(near[inside.argmax()]) if inside.any() else None


def overlapping(one: AnySolid, other: AnySolid, eased: float = 0.0) -> np.ndarray | None:
    """A place [m] at which two bodies overlap at the start, or None: a node or the middle of a cell of one inside of the
    other, deeper than `eased` [m]."""
    for a, b in ((one, other), (other, one)):
        depth = max(SURFACE, eased / b.geometry.spacing)
        for places in (a.geometry.nodes, a.geometry.cells):
            found = first_inside(places, b, b.places, depth)
            if found is not None:
                return places[found]
    return None
