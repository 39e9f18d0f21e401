"""Where particles sit: nodes and cells of a lattice inside a shape, and the faces of the body.

Two-set methods put real particles at the nodes (faces, edges and corners included) and virtual ones at the cell centres;
one-set methods put theirs at the cell centres. Faces are found from the cells alone: a cell face that belongs to one cell
is a face of the body, whatever the shape. Everything here is numpy, in metres.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from wsph.shapes import Shape


@dataclass(frozen=True)
class Faces:
    """Faces of a body, one row a cell face.

    `nodes` (m, 2^(dim-1)), `cell` (m,), `axis` (m,), `sign` of the outward normal (m,), `area` (m,) [m^(dim-1)].
    """

    nodes: np.ndarray
    cell: np.ndarray
    axis: np.ndarray
    sign: np.ndarray
    area: np.ndarray

    def named(self, name: str) -> np.ndarray:
        """Rows whose outward normal is "+x", "-x", ..., (m,) bool."""
        return (self.axis == "xyz".index(name[1])) & (self.sign == (1 if name[0] == "+" else -1))


@dataclass(frozen=True)
class Lattice:
    """A body cut into cells: `nodes` (n, dim), `cells` (c, dim) [m], `corners` (c, 2^dim) node ids, volumes [m^dim].

    `spacing` [m] is the edge of a cell along x; `step` (dim,) [m] along every axis, equal to it up to the fit of the box.
    """

    spacing: float
    step: np.ndarray
    grid: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    corners: np.ndarray
    node_volume: np.ndarray
    cell_volume: np.ndarray
    faces: Faces

    def scaled(self, length: float) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n, dim) and cells (c, dim) in units of `length` about the middle of the body.

        From the lattice's integers, not from the positions: differences of positions lose a digit for every decade of
        cells, and a scheme that is exact at Courant number 1 shows it.
        """
        factor = self.step / length
        factor = np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor)
        nodes = (self.grid - np.floor(self.grid.mean(0))) * factor
        return nodes, nodes[self.corners].mean(1)

    @property
    def on_face(self) -> np.ndarray:
        """Nodes on any face, (n,) bool."""
        mask = np.zeros(len(self.nodes), bool)
        mask[self.faces.nodes.ravel()] = True
        return mask


def lattice(shape: Shape, spacing: float, jitter: float = 0.0, seed: int = 0) -> Lattice:
    """Cut `shape` into cells of edge `spacing` [m].

    `jitter` moves every node by up to that fraction of the spacing along each axis, those on a face within their face;
    cells follow as the centroids of their corners. Raises ValueError where the spacing does not fit a box.
    """
    dim = shape.dim
    count = shape.cells(spacing)
    low, high = shape.bounds()
    # An edge divided by its count, not the spacing again: the last node must be the shape's corner to the last bit.
    step = (high - low) / count
    index = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), -1).reshape(-1, dim)
    index = index[shape.contains(low + (index + 0.5) * step)]
    inside = np.zeros(tuple(count), bool)
    inside[tuple(index.T)] = True

    offsets = np.array(list(product((0, 1), repeat=dim)))
    strides = np.array([int(np.prod(count[k + 1 :] + 1)) for k in range(dim)])
    flat = ((index[:, None, :] + offsets) * strides).sum(-1)
    used, corners = np.unique(flat, return_inverse=True)
    corners = corners.reshape(flat.shape)
    node_index = (used[:, None] // strides) % (count + 1)
    nodes, grid = np.where(node_index == count, high, low + node_index * step), node_index.astype(float)

    cell_volume = np.full(len(index), float(np.prod(step)))
    node_volume = np.bincount(corners.ravel(), np.repeat(cell_volume, 2**dim) / 2**dim, len(nodes))
    faces = _faces(inside, index, corners, offsets, step)
    if jitter:
        shift = np.random.default_rng(seed).uniform(-jitter, jitter, nodes.shape)
        for axis in range(dim):
            shift[np.unique(faces.nodes[faces.axis == axis]), axis] = 0.0
        nodes, grid = nodes + shift * step, grid + shift
    return Lattice(float(step[0]), step, grid, nodes, nodes[corners].mean(1), corners, node_volume, cell_volume, faces)


def _faces(inside: np.ndarray, index: np.ndarray, corners: np.ndarray, offsets: np.ndarray, step: np.ndarray) -> Faces:
    rows: list[tuple[np.ndarray, ...]] = []
    padded = np.pad(inside, 1)
    for axis in range(len(step)):
        for sign in (-1, 1):
            beside = index + 1
            beside[:, axis] += sign
            cell = np.flatnonzero(~padded[tuple(beside.T)])
            nodes = corners[cell][:, offsets[:, axis] == (sign + 1) // 2]
            area = np.full(len(cell), np.prod(np.delete(step, axis)))
            rows.append((nodes, cell, np.full(len(cell), axis), np.full(len(cell), sign), area))
    return Faces(*[np.concatenate(parts) for parts in zip(*rows, strict=True)])
