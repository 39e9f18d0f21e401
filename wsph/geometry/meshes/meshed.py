"""Bodies of cells of any kind: the points that carry the stress, what they see, and faces, from a mesh.

Quadrilaterals and hexahedra have a point each, which sees its corners. Triangles and tetrahedra would lock with a point in
each; theirs are on the edges: a point takes 1/3, in 3D 1/6, of every cell at its edge, V_e = sum of the shares of V_c and
V_e g_ej = sum of the shares of V_c g_cj (Liu, Nguyen-Thoi & Lam 2009, edge-based smoothed finite elements). Any gathering of
the cells' gradients keeps the linear patch test, and what gathers over edges needs no residual.
"""

# pyright: strict

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from wsph.geometry.cells import Boxes, edge_lengths
from wsph.geometry.faces import Faces
from wsph.geometry.gradients import PointRows, corner_volumes, face_shares, mean_gradients, node_shares
from wsph.geometry.meshes.layered import Layered, Whole
from wsph.geometry.meshes.layers import Layers, inverse, longest_axis, numbered
from wsph.geometry.meshes.mesh import Mesh
from wsph.ranks.cuts import Counts
from wsph.ranks.slabs import Slab
from wsph.units import rounded

FOLDED = 0.05
"""Volume of a cell in its middle, as a part of that at its corners, below which it is turned over on the way."""

PARALLEL = 1e-9
"""A face lies across an axis if its normal is this near to it."""


_Cells = tuple[np.ndarray, ...]
"""Of every block of cells rows (c, m)."""


@dataclass(frozen=True)
class Meshed(Layered):
    """A body cut into the cells of a `mesh`; `places_of_points` (c, dim) [m]; `frame` (dim, dim), columns, the
    body's own axes; `seen` the points' rows; `points_in` of every block the points of its cells, (c, m), and `first_in` the
    first of each, (c,), which may be no point of a part: only of cells of its own it has all."""

    mesh: Mesh
    places_of_points: np.ndarray
    frame: np.ndarray
    seen: PointRows
    points_in: _Cells
    first_in: _Cells

    @property
    def cells(self) -> np.ndarray:
        return self.places_of_points

    @property
    def axes(self) -> np.ndarray:
        """Directions of the body's own axes, columns (dim, dim)."""
        return self.frame

    @property
    def boxes(self) -> Boxes | None:
        return self.mesh.boxes

    @property
    def rows(self) -> PointRows:
        return self.seen

    @property
    def own_faces(self) -> np.ndarray:
        return self.split.points.owns(np.concatenate(self.first_in)[self.faces.cell])

    @property
    def own_cells(self) -> tuple[np.ndarray, ...]:
        return tuple(self.split.points.owns(first) for first in self.first_in)

    @property
    def blocks(self) -> tuple[np.ndarray, ...]:
        return self.mesh.blocks

    @property
    def points_of_cells(self) -> tuple[np.ndarray, ...]:
        return self.points_in

    def needed(self, slab: Slab) -> tuple[int, int]:
        """Of its own cells all points are there, and rows of a grid are some, where the whole body has any."""
        low, high = slab.layers
        ends = np.cumsum(self.layers.points)
        for points, first in zip(self.points_in, self.first_in, strict=True):
            own = (first >= slab.cells.low) & (first < slab.cells.high)
            if own.any():
                last = int(points[own].max())
                high = max(high, 1 + int(np.searchsorted(ends, last, side="right")))
        if self.boxes is not None and self.boxes.rows is not None:
            layer: np.ndarray = np.searchsorted(ends, self.boxes.rows, side="right")
            nearest = int(layer[np.maximum(low - layer, layer + 1 - high).argmin()])
            low, high = min(low, nearest), max(high, nearest + 1)
        return low, high

    def cut(self, slab: Slab, of: Whole) -> "Meshed":
        nodes, points, boxes = slab.nodes.window, slab.cells.window, self.boxes
        if boxes is not None:
            boxes = boxes.within(nodes, points, len(self.cell_volume))
        mesh, cells, sides = self.mesh.within(nodes, boxes)
        parts = list(zip(self.points_in, self.first_in, cells, strict=True))
        faces = self.faces
        faces = Faces(
            faces.nodes[sides] - nodes.start,
            mesh.side_cell,
            faces.axis[sides],
            faces.sign[sides],
            faces.share[sides],
            faces.vector[sides],
            faces.name[sides],
            faces.outer[sides],
            faces.last[sides],
            mesh.named,
        )
        return replace(
            self,
            nodes=self.nodes[nodes],
            node_volume=self.node_volume[nodes],
            cell_volume=self.cell_volume[points],
            faces=faces,
            mesh=mesh,
            places_of_points=self.places_of_points[points],
            seen=self.seen.between(points, nodes.start),
            points_in=tuple(np.clip(each[held] - points.start, 0, slab.cells.held - 1) for each, _, held in parts),
            first_in=tuple(first[held] - points.start for _, first, held in parts),
            of=of,
        )


@dataclass(frozen=True)
class _Points:
    """Points of some cells: places, volumes, the nodes that each sees with their vectors, rows of different lengths, and
    which of the points are each cell's, (cells, m)."""

    place: np.ndarray
    volume: np.ndarray
    rows: PointRows
    of_cells: np.ndarray


def meshed(mesh: Mesh, axes: np.ndarray | None = None, *, listed: float | None = None) -> Meshed:
    """The geometry of a mesh, whose nodes and cells are numbered layer by layer: along the first of `axes` (dim, dim),
    columns, the body's own, by which faces have names, or without these along its longest side. `listed`: as so many in
    rows of a grid a pair in a list counts, where boxes have such rows; None: these have lists too. Raises ValueError for
    cells without a positive volume and for nodes that no cell has."""
    axis = longest_axis(mesh.nodes) if axes is None else axes[:, 0]
    mesh, layer, height, start = numbered(mesh, axis)
    nodes, dim = mesh.nodes, mesh.nodes.shape[1]
    node_volume = np.zeros(len(nodes))
    points: list[_Points] = []
    longest = 0.0
    for corners in mesh.blocks:
        slope, volume = mean_gradients(nodes, corners)
        _refuse_inverted(nodes, corners, volume)
        node_volume += np.bincount(corners.ravel(), node_shares(nodes, corners).ravel(), len(nodes))
        simplices = corners.shape[1] == dim + 1
        points.append(
            _on_edges(nodes, corners, slope, volume) if simplices else _in_cells(nodes, corners, slope, volume)
        )
        longest = max(longest, edge_lengths(nodes, corners))
    if not (node_volume > 0.0).all():
        alone = np.flatnonzero(~(node_volume > 0.0))
        raise ValueError(f"{len(alone)} nodes, the first at {rounded(nodes[alone[0]])} m, are corners of no cell")
    place, volume, rows, points_in = _in_layers(points, layer)
    mesh, points_in = _by_points(mesh, points_in)
    shortest = float(point_edges(rows, volume).min())
    frame = np.eye(dim) if axes is None else axes
    faces = _faces(mesh, frame, float(volume.mean()) ** (1.0 / dim))
    layers = Layers(*_counts(layer, rows, mesh.boxes, listed), axis, start, height)
    edges, first = (shortest, longest), tuple(points.min(1) for points in points_in)
    return Meshed(nodes, node_volume, volume, faces, edges, mesh, place, frame, rows, points_in, first, layers=layers)


def _refuse_inverted(nodes: np.ndarray, corners: np.ndarray, volume: np.ndarray) -> None:
    worst = int(volume.argmin())
    if not (volume > 0.0).all():
        count = int((volume <= 0.0).sum())
        raise ValueError(
            f"{count} cells have no positive volume, the worst at {_middle(nodes, corners[worst])}: {volume[worst]:.3g} "
            f"m^{nodes.shape[1]}"
        )
    if corners.shape[1] != 2 ** nodes.shape[1]:
        return
    # One that is folded over in half of its corners, or turned over on the way from one side to the other, crosses itself.
    there, centre = corner_volumes(nodes, corners)
    folded = (there <= 0.0).sum(1) >= corners.shape[1] // 2
    crossed = folded | (centre < FOLDED * np.abs(there).mean(1))
    if crossed.any():
        where = _middle(nodes, corners[int(crossed.argmax())])
        raise ValueError(
            f"{int(crossed.sum())} cells cross themselves, the first at {where}: their nodes are in a wrong order"
        )


def _middle(nodes: np.ndarray, corners: np.ndarray) -> str:
    """The middle of a cell, as messages tell it."""
    return f"{[float(f'{x:.9g}') for x in nodes[corners].mean(0)]} m"


def _in_cells(nodes: np.ndarray, corners: np.ndarray, slope: np.ndarray, volume: np.ndarray) -> _Points:
    order = np.argsort(corners, axis=1)
    slope = np.take_along_axis(slope, order[..., None], 1)
    rows = PointRows.of_corners(np.take_along_axis(corners, order, 1), slope)
    return _Points(nodes[corners].mean(1), volume, rows, np.arange(len(corners))[:, None])


def _edge_points(n: int, corners: np.ndarray) -> tuple[int, np.ndarray]:
    """How many edges simplices with `corners` (c, k) among `n` nodes have, and the edges of each, (c, k (k - 1)/2)."""
    edge = np.sort(corners[:, np.array(list(combinations(range(corners.shape[1]), 2)))], axis=2)
    keys = edge[..., 0].astype(np.int64) * n + edge[..., 1]
    found, point = np.unique(keys, return_inverse=True)
    return len(found), point.reshape(keys.shape)


def _on_edges(nodes: np.ndarray, corners: np.ndarray, slope: np.ndarray, volume: np.ndarray) -> _Points:
    """Points on the edges of simplices, each of which takes an equal share of the cells at it."""
    n = len(nodes)
    count, point = _edge_points(n, corners)
    edges = point.shape[1]
    share = 1.0 / edges
    total = share * np.bincount(point.ravel(), np.repeat(volume, edges))
    middle = nodes[corners].mean(1)
    place = [np.bincount(point.ravel(), np.repeat(share * volume * column, edges)) / total for column in middle.T]
    # Every corner of a cell is seen from each of its edges.
    seen = (point[:, :, None].astype(np.int64) * n + corners[:, None, :]).ravel()
    pairs, where = np.unique(seen, return_inverse=True)
    each = np.repeat(share * slope[:, None], edges, axis=1).reshape(-1, slope.shape[2])
    whole = np.stack([np.bincount(where.ravel(), column) for column in each.T], 1)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(pairs // n, minlength=count))])
    held = np.zeros(count, bool)
    rows = PointRows(offsets, (pairs % n).astype(np.int64), whole, held)
    return _Points(np.stack(place, 1), total, rows, point)


def _in_layers(points: list[_Points], layer: np.ndarray) -> tuple[np.ndarray, np.ndarray, PointRows, _Cells]:
    """Places (c, dim), volumes (c,) and rows of all points, one layer after the other, those of one in the order that they
    have, and of every block the points of its cells (c, m). `layer` (n,) of the nodes."""
    rows = _joined([each.rows for each in points])
    starts = np.cumsum([0, *(len(each.volume) for each in points)])[:-1].tolist()
    order = np.argsort(_layer_of_points(layer, rows), kind="stable")
    place, volume = (np.concatenate([getattr(each, of) for each in points]) for of in ("place", "volume"))
    number = inverse(order)
    of_cells = tuple(number[start + each.of_cells] for start, each in zip(starts, points, strict=True))
    return place[order], volume[order], rows.taken(order), of_cells


def _layer_of_points(layer: np.ndarray, rows: PointRows) -> np.ndarray:
    """The layers of points (c,), of those of nodes (n,): that of the first node that each sees."""
    return layer[rows.indices[rows.offsets[:-1]]]


def _counts(
    layer: np.ndarray, rows: PointRows, boxes: Boxes | None, listed: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How many nodes (l + 1,), points and visits of pairs (l,) every layer has, of the layers of the nodes (n,); `boxes` and
    `listed` as `meshed` has them."""
    count, many = int(layer[-1]) + 1, np.diff(rows.offsets)
    # Points see nodes of their own layer at least, and of one layer alone where there is no other.
    point, nodes = _layer_of_points(layer, rows), np.bincount(layer, minlength=count + 1)
    points = np.bincount(point, minlength=count)
    if boxes is None or listed is None or not boxes.pay(len(many)):
        return nodes, points, np.bincount(point, 2.0 * many, count)
    others, seen = boxes.others(len(many)), layer if boxes.nodes is None else layer[boxes.nodes]
    in_lists = np.bincount(point[others], 2.0 * listed * many[others], count)
    cells = points - np.bincount(point[others], minlength=count)
    alike = Counts.of_cells(np.bincount(seen, minlength=count + 1), cells, boxes.index.shape[1])
    return nodes, points, alike.visits + in_lists


def _by_points(mesh: Mesh, points_in: _Cells) -> tuple[Mesh, _Cells]:
    """A mesh with the cells of every block in the order of the first of their points (c, m), and these."""
    orders = [np.argsort(points.min(1), kind="stable") for points in points_in]
    starts = np.cumsum([0, *map(len, orders)])[:-1].tolist()
    number = np.concatenate([start + inverse(order) for start, order in zip(starts, orders, strict=True)])
    blocks = tuple(corners[order] for corners, order in zip(mesh.blocks, orders, strict=True))
    made = replace(mesh, blocks=blocks, side_cell=number[mesh.side_cell])
    return made, tuple(points[order] for points, order in zip(points_in, orders, strict=True))


def _joined(rows: list[PointRows]) -> PointRows:
    if len(rows) == 1:
        return rows[0]
    starts = np.cumsum([0, *(each.offsets[-1] for each in rows[:-1])])
    offsets = [each.offsets[:-1] + start for each, start in zip(rows, starts, strict=True)]
    end = [starts[-1] + rows[-1].offsets[-1]]
    slopes = [each.slope for each in rows if each.slope is not None]
    held = [np.ones(len(each.offsets) - 1, bool) if each.held is None else each.held for each in rows]
    indices = np.concatenate([each.indices for each in rows])
    return PointRows(np.concatenate([*offsets, end]), indices, np.concatenate(slopes), np.concatenate(held))


def point_edges(rows: PointRows, volume: np.ndarray) -> np.ndarray:
    """s = 2/sqrt(k largest eigenvalue of sum g (x) g) of every point (c,), k nodes seen: the edge of a cube with the same
    fastest swing [m]. Steps of a Courant number below 1 by the least of them are stable on any mesh."""
    if rows.slope is None:
        raise TypeError("the points of a mesh have vectors")
    many = np.diff(rows.offsets)
    dim = rows.slope.shape[1]
    g = rows.slope / np.repeat(volume, many)[:, None]
    square = np.stack(
        [np.add.reduceat(g[:, a] * g[:, b], rows.offsets[:-1]) for a in range(dim) for b in range(dim)], 1
    )
    largest = np.linalg.eigvalsh(square.reshape(-1, dim, dim))[:, -1]
    return 2.0 / np.sqrt(many * largest)


def _faces(mesh: Mesh, frame: np.ndarray, near: float) -> Faces:
    """The sides of a mesh. One that lies within `near` [m] of where the body ends along the axis that its normal is nearest
    to is an outer one, and has the name of that."""
    nodes, dim = mesh.sides, mesh.nodes.shape[1]
    if dim == 3 and nodes.shape[1] == 3:
        nodes = np.concatenate([nodes, nodes[:, 2:]], 1)
    middles = np.concatenate([mesh.nodes[corners].mean(1) for corners in mesh.blocks])
    share, vector = face_shares(mesh.nodes[nodes], middles[mesh.side_cell])
    whole: np.ndarray = vector.sum(1)
    along: np.ndarray = whole / np.linalg.norm(whole, axis=1, keepdims=True) @ frame
    nearest = np.abs(np.round(along, 9)).argmax(1)
    rows = np.arange(len(nearest))
    steepest: np.ndarray = along[rows, nearest]
    sign: np.ndarray = np.where(steepest > 0.0, 1, -1)
    flat = np.abs(steepest) > 1.0 - PARALLEL
    local = mesh.nodes @ frame
    height = local[nodes].mean(1)[rows, nearest] * sign
    ends = np.stack([-local.min(0), local.max(0)])
    outer = height > ends[(sign + 1) // 2, nearest] - near
    axis = np.where(flat, nearest, -1)
    name = 2 * nearest + (sign > 0)
    return Faces(nodes, mesh.side_cell, axis, sign, share, vector, name, outer, np.ones(len(outer), bool), mesh.named)
