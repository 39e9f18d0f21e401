"""Faces of a body, found from its cells alone: a cell face that belongs to one cell is a face, whatever the shape."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Faces:
    """Faces of a body, one row a cell face.

    `nodes` (m, 2^(dim-1)), `cell` (m,), `axis` (m,) of the body that it lies across, -1 for none, `sign` of the outward
    normal along it (m,), `share` (m, 2^(dim-1)), the part of its area that each of its nodes stands for [m^(dim-1)], the
    integral of N_j, and `vector` (m, 2^(dim-1), dim), that of N_j n, n outward, which a pressure acts by; `name` (m,) int:
    2k for the shape's -x, -y, -z and 2k + 1 for +x, +y, +z, before its rotation; `outer` (m,) bool: not a side of a hole or
    of a crack; `patches` by their names, rows.
    """

    nodes: np.ndarray
    cell: np.ndarray
    axis: np.ndarray
    sign: np.ndarray
    share: np.ndarray
    vector: np.ndarray
    name: np.ndarray
    outer: np.ndarray
    patches: Mapping[str, np.ndarray]

    @property
    def area(self) -> np.ndarray:
        """Areas (m,) [m^(dim-1)]."""
        return self.share.sum(1)

    @property
    def normal(self) -> np.ndarray:
        """Mean outward normals (m, dim), of length 1."""
        whole = self.vector.sum(1)
        return whole / np.linalg.norm(whole, axis=1, keepdims=True)

    def shares(self, on: np.ndarray) -> np.ndarray:
        """The parts of the areas that the particles `on` the faces (m, k) stand for: the nodes, or one for a whole face."""
        return self.share if on.shape[1] == self.share.shape[1] else self.area[:, None]

    def of_patch(self, name: str) -> np.ndarray:
        """Rows of the faces of a patch, (m,) bool. Raises KeyError for one that there is not."""
        mask = np.zeros(len(self.cell), bool)
        mask[self.patches[name]] = True
        return mask

    def named(self, name: str) -> np.ndarray:
        """Rows of the outer faces whose normal is nearest to "+x", "-x", ... before the shape's rotation, (m,) bool."""
        return self.outer & (self.name == 2 * "xyz".index(name[1]) + (name[0] == "+"))


def find_faces(inside: np.ndarray, cut: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, ...]:
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


def face_nodes(corners: np.ndarray, offsets: np.ndarray, axis: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Nodes of faces: those of the cell's corners (m, 2^dim) on the face's side, (m, 2^(dim-1))."""
    on = offsets.T[axis] == ((sign + 1) // 2)[:, None]
    return corners[on].reshape(len(corners), -1)
