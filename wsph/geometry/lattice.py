"""Where particles sit: nodes and cells of a grid inside a shape, and the faces of the body.

Nodes are on the faces, edges and corners too. Two-set methods have real particles at the nodes and virtual ones at the
cell centres, stress points particles at the nodes and points at the centres; one set has its particles at either. Faces
are found from the cells alone: a cell face that belongs to one cell is a face of the body, whatever the shape. A crack
cuts the faces that it runs along, and its nodes are there once for each side. Everything here is numpy, in metres; grid
coordinates are in cells along the grid's own axes.
"""

# pyright: strict

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product

import numpy as np

from wsph.backend.domain import WHOLE, Domain, Split, any_of
from wsph.geometry.cells import Boxes, beside, cell_volumes, mapped_cells, steps_in
from wsph.geometry.cracks import OFF_CENTRE, Crack, cut_faces, part_nodes, parts_cells
from wsph.geometry.faces import Faces, face_names, face_nodes, find_faces, outermost
from wsph.geometry.geometry import Geometry
from wsph.geometry.gradients import PointRows, face_shares, mean_gradients
from wsph.geometry.grid import Grid, cells_in, corners_of, layers_of, places_of, plan
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.shape import Rotation
from wsph.geometry.shapes.stair_patches import StairPatches
from wsph.ranks.blocks import own_sum
from wsph.ranks.cuts import Counts, Reach
from wsph.ranks.slabs import NOTHING, Cutting, Slab, work_of


@dataclass(frozen=True)
class Lattice(Geometry):
    """A body cut into the cells of a grid: `corners` (c, 2^dim) node ids, int32, `index` (n, dim) the nodes in grid
    coordinates, int32 or, with jitter, float64; `cuts` the cracks in grid coordinates; `frame` the grid before any map;
    `bent`: a map has moved nodes; `part`, of a body that processes share, which part it is, `widened` how it is made with
    more around it, and `recut` how it was cut and how it is by other visits of pairs."""

    frame: Grid
    index: np.ndarray
    corners: np.ndarray
    cuts: tuple[Crack, ...]
    bent: bool = False
    part: Split | None = None
    widened: Callable[[tuple[int, int], tuple[int, int]], "Lattice"] | None = None
    recut: tuple[Cutting, Callable[[np.ndarray], "Lattice"]] | None = None

    def wider(self, layers: tuple[int, int]) -> "Lattice":
        return self if self.widened is None else self.widened(layers, self.split.around)

    def seeing(self, layers: tuple[int, int]) -> "Lattice":
        return self if self.widened is None else self.widened(self.split.layers, layers)

    @property
    def cutting(self) -> Cutting | None:
        return None if self.recut is None else self.recut[0]

    def cut_by(self, visits: np.ndarray) -> "Lattice":
        return self if self.recut is None else self.recut[1](visits)

    @property
    def split(self) -> Split:
        return super().split if self.part is None else self.part

    @property
    def mean_volume(self) -> float:
        return self._mean_volume

    @cached_property
    def _mean_volume(self) -> float:
        share = self.split.points
        if self.irregular:
            return own_sum(self.cell_volume, share, self.split.domain) / share.whole
        # Cells are alike; a mean has the roundings of as many as there are.
        return float(np.broadcast_to(self.cell_volume[:1], (share.whole,)).mean())

    @property
    def cells(self) -> np.ndarray:
        return self._cells

    @cached_property
    def _cells(self) -> np.ndarray:
        """Means of the corners (c, dim) [m], added up a corner at a time, which takes no more memory than they do."""
        middles = self.nodes[self.corners[:, 0]]
        for k in range(1, self.corners.shape[1]):
            middles += self.nodes[self.corners[:, k]]
        middles /= self.corners.shape[1]
        return middles

    @property
    def cracks(self) -> tuple[Crack, ...]:
        """Cuts from the start, in grid coordinates."""
        return self.cuts

    @property
    def axes(self) -> np.ndarray:
        """Directions of the grid, columns (dim, dim)."""
        return self.frame.axes

    @property
    def mapped(self) -> bool:
        """Whether cells differ in size and direction: a map has moved the nodes."""
        return self.bent

    @property
    def irregular(self) -> bool:
        """Whether cells differ: by jitter or a map."""
        moved = self.index.dtype.kind == "f"
        return self.mapped or (moved and (self.part is not None or bool((self.index != np.rint(self.index)).any())))

    @property
    def sides(self) -> Faces:
        return self._sides

    @cached_property
    def _sides(self) -> Faces:
        """The faces as loads and selections see them: of a lattice that is turned in its shape each cell face stands for its
        part of the shape's own side, along that side's normal, so that all of them have its area."""
        patches = self.faces.patches
        if self.mapped or not isinstance(patches, StairPatches) or patches.along(self.frame.axes):
            return self.faces
        normal, name, last = patches.projected(self.faces.outer, self.split.domain)
        outward = self.faces.sign[:, None] * self.frame.axes.T[self.faces.axis]
        share = self.faces.share * np.maximum((normal * outward).sum(1), 0.0)[:, None]
        none = np.full(len(name), -1)
        vector = share[:, :, None] * normal[:, None]
        return replace(self.faces, axis=none, share=share, vector=vector, name=name, last=last)

    def across(self, places: np.ndarray) -> np.ndarray:
        return self.frame.coordinates(places)[:, 0]

    @property
    def node_layer(self) -> np.ndarray:
        return np.rint(self.index[:, 0])

    @property
    def point_layer(self) -> np.ndarray:
        return self.node_layer[self.corners[:, 0]]

    @property
    def layer_count(self) -> int:
        return int(self.frame.count[0])

    @property
    def counts(self) -> Counts:
        node, count = self.node_layer.astype(np.int64), self.layer_count
        nodes, cells = np.bincount(node, minlength=count + 1), np.bincount(node[self.corners[:, 0]], minlength=count)
        return Counts.of_cells(nodes, cells, self.index.shape[1])

    @property
    def own_faces(self) -> np.ndarray:
        return self.split.points.owns(self.faces.cell)

    @property
    def boxes(self) -> Boxes | None:
        if self.irregular:
            return None
        first = None if self.part is None or self.part.low is None else int(self.part.low[-1])
        return Boxes(self.corners, self.index, self.frame.step, self.frame.axes, first)

    @property
    def rows(self) -> PointRows:
        if not self.irregular:
            return PointRows.of_corners(self.corners)
        return PointRows.of_corners(self.corners, mean_gradients(self.nodes, self.corners)[0])

    @property
    def blocks(self) -> tuple[np.ndarray, ...]:
        return (self.corners,)

    @property
    def points_of_cells(self) -> tuple[np.ndarray, ...]:
        return (np.arange(len(self.corners))[:, None],)

    def comparable(self, points: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.mapped:
            return super().comparable(points, sources)
        return self.frame.coordinates(points), self.frame.coordinates(sources)

    @property
    def centred(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n, dim) and cells (c, dim) in cells of the grid about the middle of the body.

        From the grid's integers, not from the positions: differences of positions lose a digit for every decade of
        cells, and a scheme that is exact at Courant number 1 shows it. The middle is that of the nodes without jitter.
        """
        middle = self.split.middle
        nodes = self.index - np.floor(np.rint(self.index).mean(0) if middle is None else middle)
        return nodes, nodes[self.corners].mean(1)

    @property
    def middle(self) -> np.ndarray:
        """The middle of the bounds of the whole body's nodes (dim,) [m]."""
        domain = self.split.domain
        return 0.5 * (domain.min(self.nodes.min(0)) + domain.max(self.nodes.max(0)))

    def places(self, length: float) -> np.ndarray:
        if self.mapped:
            return (self.nodes - self.middle) / length
        return self.centred[0] * self.steps(length) @ self.frame.axes.T

    def steps(self, length: float) -> np.ndarray:
        """The grid's steps (dim,) in units of `length` [m], exactly one where they are that."""
        return steps_in(self.frame.step, length)

    @property
    def neighbours(self) -> np.ndarray:
        """Per node and axis of the grid the nodes before and behind it in its own cells, itself where there is none,
        (n, dim, 2)."""
        return beside(self.corners, np.arange(len(self.nodes)), len(self.nodes))

    @property
    def off_cracks(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n, dim) and cells (c, dim) in grid coordinates, moved so that none lies on a crack: nodes slightly into
        their own cells, cells off their centres."""
        cells = self.index[self.corners].mean(1)
        own = np.repeat(np.arange(len(cells)), self.corners.shape[1])
        share = np.bincount(self.corners.ravel(), minlength=len(self.nodes))
        mean = [
            np.bincount(self.corners.ravel(), cells[own, k], len(self.nodes)) / share for k in range(cells.shape[1])
        ]
        # A crack's tip is in the middle of its own cells, and stays on the crack's line: it sees both sides.
        return self.index + 1e-3 * (np.stack(mean, 1) - self.index), cells + OFF_CENTRE[: self.index.shape[1]]


@dataclass(frozen=True)
class Held:
    """The part of a lattice that is made: its `slab`, which part of the whole that is (`split`), and how many nodes the
    whole has in its layers (l + 1,) before cracks part them."""

    slab: Slab
    split: Split
    nodes: np.ndarray

    def before(self, layer: int) -> int:
        """Nodes of the whole in front of a layer."""
        return int(self.nodes[:layer].sum())


def on_grid(geometry: Geometry) -> Lattice:
    """A geometry as the lattice that it is. Raises TypeError for one that no grid has cut."""
    if not isinstance(geometry, Lattice):
        raise TypeError("this body has cells of no grid")
    return geometry


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
    held: Held | None = None,
) -> Lattice:
    """Cut `shape` into cells of edge `spacing` [m], one number or one for each axis.

    `jitter` moves every node by up to that fraction of the spacing along each axis, those on a face within their face;
    cells follow as the centroids of their corners. `cracks` are (from, to) [m]; with `split` they have to run along lines
    of the grid, and part the nodes on them. `map` takes positions (n, dim) [m] to where the nodes are to be. `held`: the
    part of it that is made. Raises ValueError where spacing or cracks do not fit, or the map turns a cell inside out.
    """
    dim, grid = shape.dim, plan(shape, spacing, lattice_rotate)
    slab, owned = (held and held.slab), (held and held.split)
    domain = owned.domain if owned else WHOLE
    layers = (0, int(grid.count[0])) if slab is None else slab.around(int(grid.count[0]))
    inside, offsets = cells_in(shape, grid, layers), np.array(list(product((0, 1), repeat=dim)))
    if not inside.any():
        raise ValueError(f"{grid.step.min():g} m leaves no cell inside the shape")
    index, (corners, node_index) = places_of(inside, layers[0]), corners_of(inside, offsets, layers[0])
    cuts = tuple(Crack(*grid.coordinates(np.array(ends, float))) for ends in cracks)
    cut = np.zeros((dim, *inside.shape), bool)
    for crack in cuts:
        if split:
            cut_faces(crack, cut, shape, grid, layers[0])
        if not any_of(domain, parts_cells(crack, inside, index, layers[0])):
            raise ValueError(f"from and to {_ends(crack, grid)} part no cells of the body")
    every = find_faces(inside, cut)
    shift = np.zeros((len(node_index) if jitter else 0, dim))
    if jitter:
        shift = _jittered(jitter, seed, len(node_index), dim, 0 if held is None else held.before(layers[0]))
        on, axis = face_nodes(corners[every[0]], offsets, *every[1:3]), every[1]
        for k in range(dim):
            shift[np.unique(on[axis == k]), k] = 0.0
    cell, axis, sign, whole = every if slab is None else _of_slab(every, index, slab)
    if cut.any():
        parted, owner = part_nodes(corners, node_index, inside, cut, offsets, layers[0])
        corners = parted.astype(np.int32)
        node_index, shift = node_index[owner], shift[owner] if jitter else shift
    turn = shape.axes.T @ grid.axes
    name, way = face_names(turn, axis, sign), sign[:, None] * np.eye(dim)[axis]
    outer = whole & ~shape.covers(grid.points(index[cell] + 0.5 + way))
    middle = (index[cell] + 0.5 + 0.5 * way) * grid.step
    last = outermost(name, outer, turn, axis, middle, grid.step, domain)
    on = face_nodes(corners[cell], offsets, axis, sign)
    share = np.repeat((np.prod(grid.step) / grid.step[axis] / on.shape[1])[:, None], on.shape[1], 1)
    outward = sign[:, None] * grid.axes.T[axis]
    vector = share[:, :, None] * outward[:, None]
    patches = StairPatches(shape, grid.points(index[cell] + 0.5 + 0.5 * way), outward, float(grid.step.min()))
    faces = Faces(on, cell, axis, sign, share, vector, name, outer, last, patches)
    nodes = grid.points(node_index)
    # One number for all cells that are alike.
    cell_volume = np.broadcast_to(float(np.prod(grid.step)), len(index))
    if jitter:
        nodes = nodes + (shift * grid.step) @ grid.axes.T
        cell_volume = cell_volume * cell_volumes((node_index + shift)[corners], offsets)
    edges = (float(grid.step.min()), float(grid.step.max()))
    bent, straight = False, nodes
    if map is not None:
        nodes = map(nodes)
        bent = any_of(domain, bool((nodes != straight).any()))
        cell_volume, edges = mapped_cells(nodes[corners], offsets)
        edges = (float(domain.min(np.array(edges[0]))), float(domain.max(np.array(edges[1]))))
    if jitter or map is not None:
        share, vector = face_shares(nodes[faces.nodes], nodes[corners[faces.cell]].mean(1))
        faces = replace(faces, share=share, vector=vector)
    node_volume, part = np.zeros(len(nodes)), cell_volume / 2**dim
    for k in reversed(range(2**dim)):  # the cells of a node in their order
        node_volume[corners[:, k]] += part
    placed = node_index + shift if jitter else node_index
    made = Lattice(nodes, node_volume, cell_volume, faces, edges, grid, placed, corners, cuts, bent, owned)
    return made if slab is None else _within(made, slab)


def _ends(crack: Crack, grid: Grid) -> str:
    """Where a crack begins and ends [m], in words."""
    ends = grid.points(np.stack([crack.start, crack.end]))
    return ", ".join(str([round(float(x), 12) for x in end]) for end in ends)


def _jittered(jitter: float, seed: int, count: int, dim: int, before: int) -> np.ndarray:
    """Shifts of nodes (count, dim) at random, in cells: those that stand in the whole body behind so many `before`."""
    numbers = np.random.PCG64(seed)
    numbers.advance(before * dim)  # one for each
    return np.random.Generator(numbers).uniform(-jitter, jitter, (count, dim))


def _of_slab(found: tuple[np.ndarray, ...], index: np.ndarray, slab: Slab) -> tuple[np.ndarray, ...]:
    """Of the faces of cells, as `find_faces` has them, those of a slab."""
    layer = index[found[0], 0]
    return tuple(rows[(layer >= slab.layers[0]) & (layer < slab.layers[1])] for rows in found)


def _within(made: Lattice, slab: Slab) -> Lattice:
    """The nodes, cells and faces of a slab, of a lattice that has layers more on either side."""
    node = np.rint(made.index[:, 0]).astype(np.int64)
    cell = node[made.corners[:, 0]]
    start, cells = np.searchsorted(node, slab.layers[0]), np.searchsorted(cell, slab.layers)
    nodes, mine = slice(start, np.searchsorted(node, slab.layers[1], side="right")), slice(*cells)
    faces = replace(made.faces, nodes=made.faces.nodes - start, cell=made.faces.cell - cells[0])
    return replace(
        made,
        nodes=made.nodes[nodes],
        node_volume=made.node_volume[nodes],
        cell_volume=made.cell_volume[mine],
        faces=faces,
        index=made.index[nodes],
        corners=made.corners[mine] - np.int32(start),
    )


def slab_of(
    shape: Shape,
    spacing: float | tuple[float, ...],
    jitter: float,
    seed: int,
    domain: Domain,
    reach: Reach,
    *,
    who: str,
    loads: np.ndarray | None = None,
    lattice_rotate: Rotation,
    cracks: tuple[tuple[tuple[float, ...], tuple[float, ...]], ...],
    split: bool,
    map: Callable[[np.ndarray], np.ndarray] | None,
) -> Lattice:
    """The part of a lattice that a process of a domain has; `reach`, `who` and `loads` as of `wsph.ranks.slabs.slabs`, the
    rest as of `lattice`. None makes more of the lattice than its part."""
    grid, dim = plan(shape, spacing, lattice_rotate), shape.dim
    count = int(grid.count[0]) + 1
    first, end = (count * k // domain.size for k in (domain.rank, domain.rank + 1))
    mine = layers_of(shape, grid, first, end)
    plain = domain.joined(mine[:, 0])
    if cracks and split:
        _part_layers(
            mine, shape, grid, (first, end), [Crack(*grid.coordinates(np.array(ends, float))) for ends in cracks]
        )
    layers = domain.joined(mine)
    nodes, cells = layers[:, 0], layers[:-1, 1]
    if not cells.sum():
        raise ValueError(f"{grid.step.min():g} m leaves no cell inside the shape")
    cutting = Cutting(Counts.of_cells(nodes, cells, dim), domain.size, reach, who, loads)
    middle = layers[:, 2 : 2 + dim].sum(0) / nodes.sum()
    some = layers[nodes > 0]
    low = some[:, 2 + dim : 2 + 2 * dim].min(0)

    def made(every: list[Slab], window: tuple[int, int], around: tuple[int, int]) -> Lattice:
        right = every[domain.rank].over(window, nodes, cells)
        held = right.over(reach.around(right.layers), nodes, cells).over(around, nodes, cells)
        part = Split(
            domain, held.nodes, held.cells, middle, low, right.layers, held.layers, right.within(held), work_of(every)
        )
        found = given(held=Held(held, part, plain))
        return replace(found, widened=partial(made, every), recut=(cutting, cut))

    def cut(visits: np.ndarray | None = None) -> Lattice:
        return made(cutting.slabs(visits), NOTHING, NOTHING)

    given = partial(
        lattice, shape, spacing, jitter, seed, lattice_rotate=lattice_rotate, cracks=cracks, split=split, map=map
    )
    return cut()


def _part_layers(layers: np.ndarray, shape: Shape, grid: Grid, ends: tuple[int, int], cracks: Sequence[Crack]) -> None:
    """Put into `layers`, as `layers_of` has them from one up to another, the nodes that there are where cracks part them."""
    dim, around = shape.dim, (max(ends[0] - 1, 0), min(ends[1], int(grid.count[0])))
    inside, offsets = cells_in(shape, grid, around), np.array(list(product((0, 1), repeat=dim)))
    cut = np.zeros((dim, *inside.shape), bool)
    for crack in cracks:
        cut_faces(crack, cut, shape, grid, around[0])
    corners, node = corners_of(inside, offsets)
    parted = node[part_nodes(corners, node, inside, cut, offsets, 0)[1]] if cut.any() else node
    for k in range(*ends):
        here = parted[parted[:, 0] == k - around[0]].astype(np.int64)
        here[:, 0] += around[0]
        layers[k - ends[0], 0], layers[k - ends[0], 2 : 2 + dim] = len(here), here.sum(0)
