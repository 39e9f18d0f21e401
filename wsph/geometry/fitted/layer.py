"""Cells from the grid, their outer sides, and the layer from there to the surface.

Sides have their nodes in the order of a lattice's cells, and such that the outward normal and their axes in order are
right-handed: it is to the right of a side in 2D, and the first axis times the second in 3D.
"""

# pyright: strict

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from wsph.geometry.cells import Boxes
from wsph.geometry.fitted.labels import side_neighbours
from wsph.geometry.fitted.planning import Plan

STILL = 1e-9
"""A node that has moved by less stands where the grid has it [spacings]."""


@dataclass(frozen=True)
class Cells:
    """Cells with `corners` (c, 2^dim) at `nodes` (n, dim) [m]; their outer `sides` (m, 2^(dim-1)), `owner` (m,) the cells
    that these belong to, `label` (m,) their patches."""

    nodes: np.ndarray
    corners: np.ndarray
    sides: np.ndarray
    owner: np.ndarray
    label: np.ndarray

    def on(self, patches: int) -> np.ndarray:
        """The patches that nodes lie on, those of the sides around them, (n, patches) bool."""
        labels = np.zeros((len(self.nodes), patches), bool)
        labels[self.sides.ravel(), np.repeat(self.label, self.sides.shape[1])] = True
        return labels


def grid_cells(kept: np.ndarray, plan: Plan) -> tuple[Cells, np.ndarray]:
    """The cells of a grid that stay, (count) bool, without labels, and the outward normals (m, dim) of their sides."""
    dim, index = kept.ndim, np.argwhere(kept)
    offsets = np.array(list(product((0, 1), repeat=dim)))
    strides = np.concatenate([np.cumprod((plan.count + 1)[::-1])[-2::-1], [1]])
    used, corners = np.unique((index[:, None] + offsets) @ strides, return_inverse=True)
    corners = corners.reshape(len(index), 2**dim)
    nodes = plan.points(np.stack(np.unravel_index(used, tuple(plan.count + 1)), 1))
    wide = np.pad(kept, 1)
    sides, owners, normals = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    for axis, sign in product(range(dim), (-1, 1)):
        beside = index + 1
        beside[:, axis] += sign
        owner = np.flatnonzero(~wide[tuple(beside.T)])
        on = np.flatnonzero(offsets[:, axis] == (sign > 0))
        # Of the axes across it, in order, the frame with the outward normal is right-handed or not.
        if sign * (-1) ** axis < 0:
            on = on[::-1] if dim == 2 else on[[0, 2, 1, 3]]
        sides.append(corners[owner][:, on])
        owners.append(owner)
        normals.append(np.repeat(sign * np.eye(dim)[axis][None], len(owner), 0))
    label = np.zeros(sum(map(len, owners)), int)
    cells = Cells(nodes, corners, np.concatenate(sides), np.concatenate(owners), label)
    return cells, np.concatenate(normals)


def with_layer(cells: Cells, layered: np.ndarray) -> Cells:
    """The cells with one more on every side whose patch is `layered` (patches,) bool; the nodes of its outer side are
    copies, where the old ones are."""
    sheet = layered[cells.label]
    if not sheet.any():
        return cells
    inner = cells.sides[sheet]
    old = np.unique(inner)
    copy = np.full(len(cells.nodes), -1)
    copy[old] = len(cells.nodes) + np.arange(len(old))
    added = np.concatenate([inner, copy[inner]], axis=1)
    numbers = len(cells.corners) + np.arange(len(added))
    rim, rim_owner, rim_label = _rim(cells, sheet, copy)
    return Cells(
        np.concatenate([cells.nodes, cells.nodes[old]]),
        np.concatenate([cells.corners, added]),
        np.concatenate([cells.sides[~sheet], copy[inner], rim]),
        np.concatenate([cells.owner[~sheet], numbers, len(cells.corners) + rim_owner]),
        np.concatenate([cells.label[~sheet], cells.label[sheet], rim_label]),
    )


def boxes_first(
    cells: Cells, nodes: np.ndarray, first: int, plan: Plan, axes: np.ndarray
) -> tuple[Cells, Boxes | None]:
    """The cells with those in front whose corners stand at `nodes` (n, dim) [m] where the grid of `plan` has them, and
    these as boxes along `axes`. Of the cells the `first` are those of the grid."""
    corners = cells.corners[:first]
    count = int(corners.max()) + 1
    index = np.rint((cells.nodes[:count] - plan.low) / plan.spacing)
    still = np.abs(nodes[:count] - plan.points(index)).max(1) < STILL * plan.spacing
    boxed = np.zeros(len(cells.corners), bool)
    boxed[:first] = still[corners].all(1)
    if not boxed.any():
        return cells, None
    order = np.argsort(~boxed, kind="stable")
    number = np.empty(len(order), int)
    number[order] = np.arange(len(order))
    made = replace(cells, corners=cells.corners[order], owner=number[cells.owner])
    step = np.full(nodes.shape[1], plan.spacing)
    return made, Boxes(made.corners[: int(boxed.sum())], index, step, axes)


def _rim(cells: Cells, sheet: np.ndarray, copy: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the layer ends: the outer sides of its last cells, their cells, numbered in the layer, and the patches, those
    of the sides that they continue."""
    number = np.cumsum(sheet) - 1
    side, beside = side_neighbours(cells.sides)
    ends = sheet[side] & ~sheet[beside]
    side, beside = side[ends], beside[ends]
    own, other = cells.sides[side], cells.sides[beside]
    shared = (own[:, :, None] == other[:, None, :]).any(2)
    if own.shape[1] == 2:
        node = own[shared]
        before = own[:, 0] == node
        rim = np.where(before[:, None], np.stack([node, copy[node]], 1), np.stack([copy[node], node], 1))
    else:
        # Counter-clockwise about the outward normal; along the edge between both, and outward, the new side goes on.
        around, shared = own[:, [0, 2, 3, 1]], shared[:, [0, 2, 3, 1]]
        start = (shared & np.roll(shared, -1, axis=1)).argmax(1)
        row = np.arange(len(own))
        a, b = around[row, start], around[row, (start + 1) % 4]
        rim = np.stack([a, copy[a], b, copy[b]], 1)
    return rim, number[side], cells.label[beside]
