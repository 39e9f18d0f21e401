"""Cuts: which faces they run along, and how they part nodes and pairs."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.faces import Faces
from wsph.geometry.grid import FIT, Grid
from wsph.geometry.shapes.combined import Shape

OFF_CENTRE = 1e-7 * np.array([1.0, 2.3, 3.7])
"""Shift of the centres of cells [cells], so that none lies on a crack."""


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

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which of points (n, dim) lie on the crack, its ends left out, (n,) bool."""
        way = self.end - self.start
        off = points - self.start
        if len(way) == 2:
            along = off @ way / (way @ way)
            return (np.linalg.norm(off - along[:, None] * way, axis=1) < FIT) & (along > FIT) & (along < 1.0 - FIT)
        flat = np.abs(way) < FIT
        low, high = np.minimum(way, 0.0) + FIT, np.maximum(way, 0.0) - FIT
        on: np.ndarray = np.where(flat, np.abs(off) < FIT, (off > low) & (off < high))
        return np.asarray(on.all(1))


def parts_cells(crack: Crack, inside: np.ndarray, index: np.ndarray, first: int = 0) -> bool:
    """Whether a crack passes between two neighbouring cells of the body. `index` (c, dim) of those that are `inside` an
    array of the grid's shape, from its `first` layer on."""
    padded, low = np.pad(inside, 1), first * np.eye(inside.ndim, dtype=int)[0]
    for axis in range(inside.ndim):
        step = np.eye(inside.ndim, dtype=int)[axis]
        both = index[padded[tuple((index - low + 1 + step).T)]]
        centres = both + 0.5 + OFF_CENTRE[: inside.ndim]
        if len(both) and crack.crosses(centres, centres + step).any():
            return True
    return False


def cut_faces(crack: Crack, cut: np.ndarray, shape: Shape, grid: Grid, first: int = 0) -> None:
    """Mark in `cut` [axis, lower cell], of the grid's shape from its `first` layer on, the faces that a crack runs along.
    Raises ValueError off the grid's lines."""
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
    span[0] = slice(max(span[0].start - first, 0), max(span[0].stop - first, 0))
    cut[(axis, *span)] = True


def parted(index: np.ndarray, faces: Faces) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs of nodes that a crack parts: the node below, the node above it and the axis of the grid across it, each
    (pairs,). `index` (n, dim) are the nodes in grid coordinates."""
    place = np.unique(index, axis=0, return_inverse=True)[1].reshape(-1)
    pairs: list[np.ndarray] = []
    for axis in range(index.shape[1]):
        # The outward normal of the side below points up.
        below, above = (np.unique(faces.nodes[(faces.axis == axis) & (faces.sign == sign)]) for sign in (1, -1))
        _, low, high = np.intersect1d(place[below], place[above], return_indices=True)
        found = np.stack([below[low], above[high], np.full(len(low), axis)], 1)
        pairs.append(found[found[:, 0] != found[:, 1]])
    both = np.concatenate(pairs)
    return both[:, 0], both[:, 1], both[:, 2]


def part_nodes(corners: np.ndarray, node_index: np.ndarray, inside: np.ndarray, cut: np.ndarray,
          offsets: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Nodes once for each group of cells around them that no cut parts: new corners, and the old node of each new one.
    Cells are `inside` an array of the grid's shape, from its `first` layer on."""
    dim = inside.ndim
    around, solid = np.pad(inside, 1), len(offsets)
    slot = {tuple(o): k for k, o in enumerate(offsets)}
    blocked = np.pad(cut, [(0, 0), *[(1, 1)] * dim])
    # Cell of slot o around a node stands at node - 1 + o, or node + o in the padded arrays.
    place = (node_index - first * np.eye(dim, dtype=int)[0])[:, None, :] + offsets
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
