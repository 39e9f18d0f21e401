"""Layers of bodies that no grid has cut: nodes and points stand one layer after the other along a direction of the body.

Layers are as thick as what a point sees is long, so that a point in one sees nodes of it and of the next alone, as the cells
of a grid do: a part of the body between two layers is a range of nodes and a range of points (`wsph.ranks.slabs`).
"""

# pyright: strict

from dataclasses import dataclass, replace

import numpy as np

from wsph.geometry.cells import edge_lengths
from wsph.geometry.meshes.mesh import Mesh
from wsph.ranks.cuts import Counts

EASED = 1e-6
"""Part of a layer by which the first begins before the first node, so that nodes on the lines of a grid are in one."""

ROUNDED = 1.0 + 1e-12
"""Height of a layer over what has to fit in it, so that rounding leaves nothing over."""


@dataclass(frozen=True)
class Layers(Counts):
    """Layers of a `height` [m] along the unit vector `axis` (dim,), from `start` [m] on. A point is in the layer of the
    first of the nodes that it sees, and is followed by the nodes of the next."""

    axis: np.ndarray
    start: float
    height: float

    def across(self, places: np.ndarray) -> np.ndarray:
        """Where places (n, dim) [m] are across the layers, (n,): whole numbers where one begins."""
        return (places @ self.axis - self.start) / self.height


def layer_of(along: np.ndarray, height: float) -> tuple[np.ndarray, float]:
    """The layers (n,) int of places `along` (n,) [m] an axis, the first of which is 0, and where that begins [m]."""
    first, before = float(along.min()), EASED * height
    # Far from the origin, too, what is no more than a layer apart is in the same one or the next.
    return np.floor((along - first + before) / height).astype(np.int64), first - before


def longest_axis(places: np.ndarray) -> np.ndarray:
    """The coordinate axis along which places (n, dim) reach farthest, the first of equal ones, (dim,)."""
    sides = np.ptp(places, axis=0)
    return np.eye(places.shape[1])[int(np.argmax(sides > (1.0 - 1e-9) * sides.max()))]


def numbered(mesh: Mesh, axis: np.ndarray) -> tuple[Mesh, np.ndarray, float, float]:
    """A mesh with its nodes and cells layer after layer along an axis, those of a layer in the order that they have; the
    layers of its nodes (n,), the height of layers and where the first begins [m]. Points on edges see the nodes of all cells
    there, which may reach twice as far as a cell."""
    nodes, dim = mesh.nodes, mesh.nodes.shape[1]
    along = nodes @ axis
    height = 0.0
    for corners in mesh.blocks:
        reach = float(np.ptp(along[corners], axis=1).max()) * (2.0 if corners.shape[1] == dim + 1 else 1.0)
        height = max(height, reach, edge_lengths(nodes, corners))
    height *= ROUNDED
    layer, start = layer_of(along, height)
    order = np.argsort(layer, kind="stable")
    number = inverse(order)
    sorted_blocks: list[np.ndarray] = []
    cell_number: list[np.ndarray] = []
    before = 0
    for corners in mesh.blocks:
        cells = np.argsort(layer[corners].min(1), kind="stable")
        sorted_blocks.append(number[corners[cells]])
        cell_number.append(before + inverse(cells))
        before += len(corners)
    cells = np.concatenate(cell_number)
    boxes = mesh.boxes
    if boxes is not None:
        at, places = cells[: len(boxes.corners)], number[: len(boxes.index)]
        rows, seen = np.argsort(at), np.argsort(places)
        corners = number[boxes.corners[rows]]
        boxes = replace(boxes, corners=corners, index=boxes.index[seen], rows=at[rows], nodes=places[seen])
    made = replace(
        mesh,
        nodes=nodes[order],
        blocks=tuple(sorted_blocks),
        sides=number[mesh.sides],
        side_cell=cells[mesh.side_cell],
        boxes=boxes,
    )
    return made, layer[order], height, start


def inverse(order: np.ndarray) -> np.ndarray:
    """Where each of what was in an order is now."""
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    return number
