"""Where particles sit: nodes and cells of a grid inside a shape, and the faces of the body.

Two-set methods put real particles at the nodes (faces, edges and corners included) and virtual ones at the cell centres;
one-set methods put theirs at the cell centres. Faces are found from the cells alone: a cell face that belongs to one cell
is a face of the body, whatever the shape. A crack cuts the faces that it runs along, and its nodes are there once for each
side. Everything here is numpy, in metres; grid coordinates are in cells along the grid's own axes.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from wsph.grid import FIT, Grid, plan
from wsph.shapes import Rotation, Shape

TRIFLE = 1e-7 * np.array([1.0, 2.3, 3.7])
"""Added to the centres of cells, in cells, where sides of a crack are told."""


@dataclass(frozen=True)
class Faces:
    """Faces of a body, one row a cell face.

    `nodes` (m, 2^(dim-1)), `cell` (m,), `axis` (m,) of the grid, `sign` of the outward normal (m,), `area` (m,)
    [m^(dim-1)]; `name` (m,) int: 2k for the shape's -x, -y, -z and 2k + 1 for +x, +y, +z, before its rotation; `outer`
    (m,) bool: not a side of a hole or of a crack.
    """

    nodes: np.ndarray
    cell: np.ndarray
    axis: np.ndarray
    sign: np.ndarray
    area: np.ndarray
    name: np.ndarray
    outer: np.ndarray

    def named(self, name: str) -> np.ndarray:
        """Rows of the outer faces whose normal is nearest to "+x", "-x", ... before the shape's rotation, (m,) bool."""
        return self.outer & (self.name == 2 * "xyz".index(name[1]) + (name[0] == "+"))


@dataclass(frozen=True)
class Crack:
    """A cut in grid coordinates, in 2D the segment from `start` to `end`, in 3D the rectangle with these corners."""

    start: np.ndarray
    end: np.ndarray

    def crosses(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Whether the lines from `first` to `second` (n, dim) pass through the crack, (n,) bool."""
        way = self.end - self.start
        if len(way) == 2:
            normal = np.array([-way[1], way[0]])
        else:
            normal = (np.abs(way) < FIT).astype(float)
        a, b = (first - self.start) @ normal, (second - self.start) @ normal
        apart = a * b < 0.0
        share = np.divide(a, a - b, out=np.zeros_like(a), where=apart)
        at = first + share[:, None] * (second - first) - self.start
        if len(way) == 2:
            along = at @ way / (way @ way)
            return apart & (along >= 0.0) & (along <= 1.0)
        flat = normal == 0.0
        low, high = np.minimum(way, 0.0) - FIT, np.maximum(way, 0.0) + FIT
        return apart & (((at >= low) & (at <= high)) | ~flat).all(1)


@dataclass(frozen=True)
class Lattice:
    """A body cut into cells: `nodes` (n, dim), `cells` (c, dim) [m], `corners` (c, 2^dim) node ids, volumes [m^dim].

    `index` (n, dim) the nodes in grid coordinates, jitter included; `cracks` in grid coordinates; `frame` the grid before
    any map; `edges` the shortest and the longest edge of a cell [m].
    """

    frame: Grid
    index: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    corners: np.ndarray
    node_volume: np.ndarray
    cell_volume: np.ndarray
    faces: Faces
    cracks: tuple[Crack, ...]
    edges: tuple[float, float]

    @property
    def spacing(self) -> float:
        """The shortest edge of a cell [m]."""
        return self.edges[0]

    @property
    def mapped(self) -> bool:
        """Whether cells differ in size: a map has moved the nodes."""
        return self.edges[0] != float(self.frame.step.min())

    def comparable(self, points: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, dim) [m] and nodes or cells (m, dim) [m] in units of cells, to find who is near whom."""
        if self.mapped:
            return points / self.edges[1], sources / self.edges[1]
        return self.frame.coordinates(points), self.frame.coordinates(sources)

    @property
    def centred(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n, dim) and cells (c, dim) in cells about the middle of the body.

        From the grid's integers, not from the positions: differences of positions lose a digit for every decade of
        cells, and a scheme that is exact at Courant number 1 shows it.
        """
        nodes = self.index - np.floor(self.index.mean(0))
        return nodes, nodes[self.corners].mean(1)

    @property
    def neighbours(self) -> np.ndarray:
        """Per node and axis of the grid the nodes before and behind it in its own cells, itself where there is none,
        (n, dim, 2)."""
        dim = self.index.shape[1]
        offsets = np.array(list(product((0, 1), repeat=dim)))
        result = np.repeat(np.arange(len(self.nodes))[:, None], 2 * dim, 1).reshape(-1, dim, 2)
        for axis in range(dim):
            for a, b in zip(*_ends(offsets, axis), strict=True):
                result[self.corners[:, a], axis, 1] = self.corners[:, b]
                result[self.corners[:, b], axis, 0] = self.corners[:, a]
        return result

    @property
    def on_face(self) -> np.ndarray:
        """Nodes on any face, (n,) bool."""
        mask = np.zeros(len(self.nodes), bool)
        mask[self.faces.nodes.ravel()] = True
        return mask

    @property
    def sided(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and cells in grid coordinates, nodes moved a trifle into their own cells, and cells off any line through
        their centres: each on its side of a crack."""
        cells = self.index[self.corners].mean(1)
        own = np.repeat(np.arange(len(cells)), self.corners.shape[1])
        share = np.bincount(self.corners.ravel(), minlength=len(self.nodes))
        mean = [
            np.bincount(self.corners.ravel(), cells[own, k], len(self.nodes)) / share for k in range(cells.shape[1])
        ]
        # A crack's tip is in the middle of its own cells, and stays on the crack's line: it sees both sides.
        return self.index + 1e-3 * (np.stack(mean, 1) - self.index), cells + TRIFLE[: self.index.shape[1]]

    def apart(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Which pairs of points, (n, dim) in grid coordinates, a crack parts, (n,) bool."""
        parted = np.zeros(len(first), bool)
        for crack in self.cracks:
            parted |= crack.crosses(first, second)
        return parted


def lattice(
    shape: Shape,
    spacing: float | tuple[float, ...],
    jitter: float = 0.0,
    seed: int = 0,
    *,
    lattice_rotate: Rotation = 0.0,
    cracks: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...] = (),
    split: bool = True,
    map: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Lattice:
    """Cut `shape` into cells of edge `spacing` [m], one number or one for each axis.

    `jitter` moves every node by up to that fraction of the spacing along each axis, those on a face within their face;
    cells follow as the centroids of their corners. `cracks` are (from, to) [m]; with `split` they have to run along lines
    of the grid, and part the nodes on them. `map` takes positions (n, dim) [m] to where the nodes are to be. Raises
    ValueError where spacing or cracks do not fit, or the map turns a cell inside out.
    """
    dim, grid = shape.dim, plan(shape, spacing, lattice_rotate)
    count = grid.count
    index = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), -1).reshape(-1, dim)
    index = index[shape.contains(grid.points(index + 0.5))]
    if not len(index):
        raise ValueError(f"{grid.step.min():g} m leaves no cell inside the shape")
    inside = np.zeros(tuple(count), bool)
    inside[tuple(index.T)] = True

    offsets = np.array(list(product((0, 1), repeat=dim)))
    strides = np.array([int(np.prod(count[k + 1 :] + 1)) for k in range(dim)])
    flat = ((index[:, None, :] + offsets) * strides).sum(-1)
    used, corners = np.unique(flat, return_inverse=True)
    corners = corners.reshape(flat.shape)
    node_index = (used[:, None] // strides) % (count + 1)
    cuts = tuple(Crack(*grid.coordinates(np.array(ends, float))) for ends in cracks)
    cut = np.zeros((dim, *count), bool)
    for crack in cuts:
        if split:
            _cut_faces(crack, cut, shape, grid)
        if not _parts_cells(crack, inside, index):
            ends = ", ".join(
                str([round(float(x), 12) for x in end]) for end in grid.points(np.stack([crack.start, crack.end]))
            )
            raise ValueError(f"from and to {ends} part no cells of the body")
    cell, axis, sign, whole = _faces(inside, cut, index)
    sides = (corners[cell], offsets, axis, sign)
    shift = np.zeros((len(used), dim))
    if jitter:
        shift = np.random.default_rng(seed).uniform(-jitter, jitter, shift.shape)
        for k in range(dim):
            shift[np.unique(_face_nodes(*sides)[axis == k]), k] = 0.0
    if cut.any():
        corners, owner = _part(corners, node_index, inside, cut, index, offsets)
        node_index, shift = node_index[owner], shift[owner]
    turn = shape.axes.T @ grid.axes
    normal = sign[:, None] * turn[:, axis].T
    nearest = np.abs(np.round(normal, 9)).argmax(1)
    name = 2 * nearest + (normal[np.arange(len(axis)), nearest] > 0.0)
    beside = grid.points(index[cell] + 0.5 + sign[:, None] * np.eye(dim)[axis])
    area = np.prod(grid.step) / grid.step[axis]
    faces = Faces(
        _face_nodes(corners[cell], offsets, axis, sign), cell, axis, sign, area, name, whole & ~shape.covers(beside)
    )
    nodes = grid.points(node_index)
    cell_volume = np.full(len(index), float(np.prod(grid.step)))
    if jitter:
        nodes = nodes + (shift * grid.step) @ grid.axes.T
        cell_volume = cell_volume * _volumes((node_index + shift)[corners], offsets)
    edges = (float(grid.step.min()), float(grid.step.max()))
    if map is not None:
        nodes = map(nodes)
        cell_volume, edges = _mapped_cells(nodes[corners], offsets)
        faces = replace(faces, area=_mapped_areas(nodes[faces.nodes]))
    node_volume = np.bincount(corners.ravel(), np.repeat(cell_volume, 2**dim) / 2**dim, len(nodes))
    return Lattice(
        grid, node_index + shift, nodes, nodes[corners].mean(1), corners, node_volume, cell_volume, faces, cuts, edges
    )


def _ends(offsets: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners at the low and at the high end of a cell's edges along an axis, in pairs."""
    low = np.flatnonzero(offsets[:, axis] == 0)
    beyond = offsets[low] + np.eye(offsets.shape[1], dtype=int)[axis]
    return low, np.array([int(np.flatnonzero((offsets == o).all(1))[0]) for o in beyond])


def _mapped_cells(cells: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """Volumes [m^dim] of mapped cells (c, 2^dim, dim) and their shortest and longest edge [m]."""
    if not np.isfinite(cells).all():
        raise ValueError("the map gives positions that are not finite")
    volume = _volumes(cells, offsets)
    if not (volume > 0.0).all():
        where = cells[np.flatnonzero(~(volume > 0.0))[0]].mean(0)
        raise ValueError(f"the map turns the cell at {[float(f'{x:.6g}') for x in where]} m inside out")
    lengths = []
    for axis in range(cells.shape[2]):
        low, high = _ends(offsets, axis)
        lengths.append(np.linalg.norm(cells[:, high] - cells[:, low], axis=2))
    return volume, (float(np.min(lengths)), float(np.max(lengths)))


def _mapped_areas(faces: np.ndarray) -> np.ndarray:
    """Areas [m^(dim-1)] of faces from their corners (m, 2^(dim-1), dim), those of a quadrilateral by its diagonals."""
    if faces.shape[2] == 1:
        return np.ones(len(faces))
    if faces.shape[2] == 2:
        return np.linalg.norm(faces[:, 1] - faces[:, 0], axis=1)
    return 0.5 * np.linalg.norm(np.cross(faces[:, 3] - faces[:, 0], faces[:, 2] - faces[:, 1]), axis=1)


def _volumes(cells: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Volumes of cells from their corners (c, 2^dim, dim), multilinear between them, exactly by Gauss points, (c,)."""
    dim = cells.shape[2]
    total = np.zeros(len(cells))
    for point in product((0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5), repeat=dim):
        weight = np.where(offsets == 1, point, 1.0 - np.array(point))
        slope = np.stack([(2.0 * offsets[:, k] - 1.0) * np.delete(weight, k, 1).prod(1) for k in range(dim)], 1)
        total += np.linalg.det(np.einsum("cka,kb->cab", cells, slope)) / 2**dim
    return total


def _faces(inside: np.ndarray, cut: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, ...]:
    """Cell, axis, sign of every cell face with no neighbour behind it, and whether it is not the side of a cut."""
    rows: list[tuple[np.ndarray, ...]] = []
    padded = np.pad(inside, 1)
    for axis in range(inside.ndim):
        for sign in (-1, 1):
            beside = index + 1
            beside[:, axis] += sign
            whole = ~padded[tuple(beside.T)]
            lower = index.copy()
            lower[:, axis] -= sign < 0
            parted = cut[axis][tuple(lower.T)] & (lower[:, axis] >= 0)
            cell = np.flatnonzero(whole | parted)
            rows.append((cell, np.full(len(cell), axis), np.full(len(cell), sign), whole[cell]))
    cell, axis, sign, whole = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    return cell, axis, sign, whole


def _face_nodes(corners: np.ndarray, offsets: np.ndarray, axis: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Nodes of faces: those of the cell's corners (m, 2^dim) on the face's side, (m, 2^(dim-1))."""
    on = offsets.T[axis] == ((sign + 1) // 2)[:, None]
    return corners[on].reshape(len(corners), -1)


def _parts_cells(crack: Crack, inside: np.ndarray, index: np.ndarray) -> bool:
    """Whether a crack passes between two neighbouring cells of the body."""
    padded = np.pad(inside, 1)
    for axis in range(inside.ndim):
        step = np.eye(inside.ndim, dtype=int)[axis]
        both = index[padded[tuple((index + 1 + step).T)]]
        centres = both + 0.5 + TRIFLE[: inside.ndim]
        if len(both) and crack.crosses(centres, centres + step).any():
            return True
    return False


def _cut_faces(crack: Crack, cut: np.ndarray, shape: Shape, grid: Grid) -> None:
    """Mark in `cut` [axis, lower cell] the faces that a crack runs along. Raises ValueError off the grid's lines."""
    dim, ends = len(cut), np.stack([crack.start, crack.end])
    flat = np.flatnonzero(np.abs(ends[0] - ends[1]) < FIT)
    if len(flat) != 1:
        across = "a side of the cells" if dim == 2 else "one plane of the cells, its corners `from` and `to`"
        raise ValueError(f"a crack in a body with particles on its faces runs along {across}")
    axis = int(flat[0])
    line = np.rint(ends[0, axis])
    if abs(ends[0, axis] - line) > FIT:
        below, above = (grid.low[axis] + grid.step[axis] * (np.floor(ends[0, axis]) + k) for k in (0, 1))
        at = grid.low[axis] + grid.step[axis] * ends[0, axis]
        raise ValueError(
            f"lies at {'xyz'[axis]} = {at:.12g} m between the cells' sides at {below:.12g} m and {above:.12g} m"
        )
    low, high = ends.min(0), ends.max(0)
    for k in (k for k in range(dim) if k != axis):
        for end in (low[k], high[k]):
            if 0.0 < end < grid.count[k] and abs(end - np.rint(end)) > FIT:
                below, above = (grid.low[k] + grid.step[k] * (np.floor(end) + s) for s in (0, 1))
                at = grid.low[k] + grid.step[k] * end
                raise ValueError(
                    f"ends at {'xyz'[k]} = {at:.12g} m between the particles at {below:.12g} m and {above:.12g} m"
                )
    if not 1 <= line <= grid.count[axis] - 1:
        return
    span = [
        slice(int(np.clip(np.rint(low[k]), 0, n)), int(np.clip(np.rint(high[k]), 0, n)))
        for k, n in enumerate(grid.count)
    ]
    span[axis] = slice(int(line) - 1, int(line))
    cut[(axis, *span)] = True


def _part(corners: np.ndarray, node_index: np.ndarray, inside: np.ndarray, cut: np.ndarray, index: np.ndarray,
          offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Nodes once for each group of cells around them that no cut parts: new corners, and the old node of each new one."""
    dim = inside.ndim
    around, solid = np.pad(inside, 1), len(offsets)
    slot = {tuple(o): k for k, o in enumerate(offsets)}
    blocked = np.pad(cut, [(0, 0), *[(1, 1)] * dim])
    # Cell of slot o around a node stands at node - 1 + o, or node + o in the padded arrays.
    place = node_index[:, None, :] + offsets
    present = around[tuple(np.moveaxis(place, -1, 0))]
    label = np.where(present, np.arange(solid), solid)
    for _ in range(solid):
        for axis in range(dim):
            for o in (o for o in offsets if o[axis] == 0):
                low, high = slot[tuple(o)], slot[tuple(o + np.eye(dim, dtype=int)[axis])]
                open_ = ~blocked[axis][tuple(place[:, low].T)] & present[:, low] & present[:, high]
                both = np.minimum(label[:, low], label[:, high])
                label[open_, low] = label[open_, high] = both[open_]
    touched = np.zeros(len(node_index), bool)
    for axis in range(dim):
        for o in (o for o in offsets if o[axis] == 0):
            touched |= blocked[axis][tuple(place[:, slot[tuple(o)]].T)]
    # Elsewhere cells that meet at a corner alone stay joined.
    label[~touched] = np.where(present[~touched], 0, solid)
    keys = np.arange(len(node_index))[:, None] * solid + label
    # The cell's corner o is the node around which the cell has slot 1 - o.
    opposite = [slot[tuple(1 - o)] for o in offsets]
    mine = np.stack([keys[corners[:, k], opposite[k]] for k in range(solid)], 1)
    new, parted = np.unique(mine, return_inverse=True)
    return parted.reshape(corners.shape), new // solid
