"""Which particles of a body lie inside of another, in any configuration.

Each body knows the grid that it is cut from. A point has grid coordinates in it, those of the particle nearest to it and
what lies between, through the slopes of the places around that particle; it lies inside, some depth below the surface,
where all cells within that depth of it are filled. Of bodies that processes share none has all: each asks about particles
of its own, and all answer for theirs.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from wsph.backend.domain import Domain, Share, anywhere
from wsph.contact.mesh_solid import MeshSolid
from wsph.contact.point_solid import PointSolid
from wsph.geometry.cells import beside
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
    """A body as something that takes up room. `at_nodes`: its particles are the nodes of the lattice, else its cells. Of one
    that processes share each looks at its own particles and cells, and all of them ask together."""

    def __init__(self, lattice: Lattice, at_nodes: bool):
        self.geometry = self.lattice = lattice
        self.at_nodes = at_nodes
        self.domain, self.share = lattice.split.domain, lattice.split.particles(at_nodes=at_nodes)

    @cached_property
    def _room(self) -> tuple[np.ndarray, np.ndarray]:
        """A box about its own cells: where it begins in the grid (dim,), and which cells of it are filled."""
        cells = self._cells(np.arange(len(self.lattice.corners))[self.lattice.split.points.own])
        low = cells.min(0) - 1
        filled = np.zeros(tuple(np.ptp(cells, axis=0) + 3), bool)
        filled[tuple((cells - low).T)] = True
        return low, filled

    def _cells(self, rows: np.ndarray) -> np.ndarray:
        """Where cells are in the grid, (k, dim) int."""
        return np.rint(self.lattice.index[self.lattice.corners[rows, 0]]).astype(int)

    @property
    def places(self) -> np.ndarray:
        """Of its particles here at the start, (n, dim) [m]."""
        return self.lattice.nodes if self.at_nodes else self.lattice.cells

    def _index(self, particles: np.ndarray) -> np.ndarray:
        """Grid coordinates of some particles, (k, dim)."""
        index = self.lattice.index
        return index[particles] if self.at_nodes else index[self.lattice.corners[particles]].mean(1)

    def _beside(self, particles: np.ndarray) -> np.ndarray:
        """The particles before and behind each of some along every axis of the grid, itself where there is none, (k, dim,
        2)."""
        dim = self.lattice.index.shape[1]
        found = np.repeat(particles[:, None], 2 * dim, 1).reshape(-1, dim, 2)
        if self.at_nodes:
            wanted, place = np.unique(particles, return_inverse=True)
            return beside(self.lattice.corners, wanted, len(self.lattice.nodes))[place]
        there, box = self._known
        for axis, side in product(range(dim), (0, 1)):
            cells = self._cells(particles)
            cells[:, axis] += 2 * side - 1
            keys = np.ravel_multi_index(tuple((cells - box[0]).T), tuple(box[1].tolist()))
            at = np.minimum(np.searchsorted(there, keys), len(there) - 1)
            found[:, axis, side] = np.where(there[at] == keys, at, particles)
        return found

    @cached_property
    def _known(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the cells here in a box about them, ascending as they do, and the box: where it begins and its
        sides."""
        cells = self._cells(np.arange(len(self.lattice.corners)))
        box = np.stack([cells.min(0) - 1, np.ptp(cells, axis=0) + 3])
        keys: np.ndarray = np.asarray(np.ravel_multi_index(tuple((cells - box[0]).T), tuple(box[1].tolist())))
        return keys, box

    def coordinates(self, points: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Grid coordinates of points (k, dim) [m] where the particles here are at `places` (n, dim) [m]; NaN beyond them."""
        unit, share, dim = self.lattice.edges[1], self.share, points.shape[1]
        low, high = points.min(0) - REACH * unit, points.max(0) + REACH * unit
        near = share.own.start + np.flatnonzero(((places[share.own] >= low) & (places[share.own] <= high)).all(1))
        pairs = find_pairs(points / unit, places[near] / unit, REACH)
        seen: np.ndarray = pairs.indices.numpy()
        row, other = pairs.rows(), near[seen]
        distance = np.linalg.norm(points[row] - places[other], axis=1)
        order = np.lexsort((other, distance, row))
        first = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        k, nearest = self._nearest(len(points), row[first], other[first], distance[first])
        away = np.linalg.solve(self._slopes(nearest, places), (points[k] - places[nearest])[:, :, None])[:, :, 0]
        result = np.full((len(points), dim), -np.inf)
        result[k] = self._index(nearest) + away
        result = result if self.domain.size == 1 else self.domain.max(result)
        return np.where(np.isfinite(result), result, np.nan)

    def _nearest(
        self, count: int, point: np.ndarray, particle: np.ndarray, distance: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Of the particles (k,) that are this process's nearest to a `point` each, of so many, those that are of all."""
        if self.domain.size == 1:
            return point, particle
        least = np.full(count, np.inf)
        least[point] = distance
        near = distance == self.domain.min(least)[point]
        number = np.full(count, self.share.whole)
        number[point[near]] = particle[near] + self.share.first
        near &= particle + self.share.first == self.domain.min(number)[point]
        return point[near], particle[near]

    def _slopes(self, particles: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Places over grid coordinates at some particles, (k, dim, dim) [m]; as at the start where they say nothing."""
        ends_of, dim = self._beside(particles), places.shape[1]
        before, behind = ends_of[:, :, 0], ends_of[:, :, 1]
        ends = (self._index(each.ravel()).reshape(-1, dim, dim) for each in (behind, before))
        one, other = (np.diagonal(each, axis1=1, axis2=2) for each in ends)
        apart = one - other
        whole = self.lattice.frame.axes * self.lattice.frame.step
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = ((places[behind] - places[before]) / apart[:, :, None]).transpose(0, 2, 1)
        slopes = np.where((apart != 0.0)[:, None, :], slopes, whole)
        size = np.atleast_1d(np.abs(np.linalg.det(slopes / self.lattice.spacing)))
        return np.where((size > 1e-3)[:, None, None], slopes, whole)

    def inside(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points (k, dim) [m], the same in all processes, lie inside where the particles here are at `places` (n, dim)
        [m], `depth` [cells] below the surface, (k,) bool."""
        return self.holds(self.coordinates(points, places), depth)

    def holds(self, coordinates: np.ndarray, depth: float) -> np.ndarray:
        """Which grid coordinates (k, dim) lie inside, `depth` [cells] below the surface, (k,) bool."""
        known = np.logical_and.reduce(np.isfinite(coordinates), axis=1)
        at = np.where(known[:, None], coordinates, -np.inf)
        (low, room), filled = self._room, list[np.ndarray]()
        for corner in product((-depth, depth), repeat=coordinates.shape[1]):
            cell = np.clip(np.floor(at + corner) - low, 0, np.array(room.shape) - 1).astype(int)
            filled.append(room[tuple(cell.T)])
        return known & anywhere(self.domain, np.stack(filled)).all(0)


AnySolid = Solid | MeshSolid | PointSolid


def solid_of(geometry: Geometry, *, at_nodes: bool) -> AnySolid:
    """A body as something that takes up room; `at_nodes`: its particles are the nodes, else the cells of a lattice."""
    if isinstance(geometry, Meshed):
        return MeshSolid(geometry)
    if isinstance(geometry, Scattered):
        return PointSolid(geometry)
    return Solid(on_grid(geometry), at_nodes)


@dataclass(frozen=True)
class Found:
    """A particle, node or cell by its `number` in the whole body, and its `place` (dim,) [m]."""

    number: int
    place: np.ndarray


def bounds_of(places: np.ndarray, share: Share, domain: Domain) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest of the places (n, dim) here of all that processes own, (dim,) each."""
    own = places[share.own]
    return domain.min(own.min(0, initial=np.inf)), domain.max(own.max(0, initial=-np.inf))


def first_inside(
    places: np.ndarray, share: Share, domain: Domain, other: AnySolid, others: np.ndarray, depth: float | None = None
) -> Found | None:
    """The first of `places` (n, dim) [m], of which this process has a `share`, inside of a body whose particles here are at
    `others` (m, dim) [m], or None. `depth` [cells] below its surface; by default that at which its outermost particles have
    been passed. All processes ask together: each tells those of its own that are near."""
    low, high = bounds_of(others, other.share, other.domain)
    own = places[share.own]
    near = np.flatnonzero(((own >= low) & (own <= high)).all(1))
    for by, count in enumerate(domain.joined(np.array([len(near)])).tolist()):
        points = domain.told(lambda: own[near], by) if count else own[:0]
        if not count:
            continue
        inside = other.inside(points, others, PASSED[other.at_nodes] if depth is None else depth)
        if inside.any():
            k = int(inside.argmax())
            return Found(domain.told(lambda k=k: share.low + int(near[k]), by), points[k])
    return None


def overlapping(one: AnySolid, other: AnySolid, eased: float = 0.0) -> np.ndarray | None:
    """A place [m] at which two bodies overlap at the start, or None: a node or the middle of a cell of one inside of the
    other, deeper than `eased` [m]. All processes that share them ask together."""
    ends = [bounds_of(each.geometry.nodes, each.geometry.split.nodes, each.domain) for each in (one, other)]
    (low, high), (least, most) = ends
    if (np.minimum(high, most) <= np.maximum(low, least)).any():
        return None  # Their boxes touch at the most.
    for a, b in ((one, other), (other, one)):
        depth, split = max(SURFACE, eased / b.geometry.spacing), a.geometry.split
        for places, share in ((a.geometry.nodes, split.nodes), (a.geometry.cells, split.points)):
            found = first_inside(places, share, split.domain, b, b.places, depth)
            if found is not None:
                return found.place
    return None
