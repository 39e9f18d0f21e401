"""Faces of a body, found from its cells alone: a cell face that belongs to one cell is a face, whatever the shape.

A face by name is one rule on every shape. "+x" are the cell faces whose outward normal is nearest to the shape's +x,
before its rotation and before any map, and which lie less than a cell behind the outermost of these. So it is the whole
side of a box and of a turned lattice in it, the flat of cells at the end of a disc, the end of a cylinder, the outer
sides of an L; and never the side of a hole, a step further in, or the cell faces of a staircase that look across
another axis.
"""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Domain

FACES = ("-x", "+x", "-y", "+y", "-z", "+z")
"""Names of faces, in the order of their numbers."""

WHOLE = 1e-6
"""A face this near to a whole cell behind another, in cells, is a cell behind it."""


@dataclass(frozen=True)
class Faces:
    """Faces of a body, one row a cell face.

    `nodes` (m, 2^(dim-1)), `cell` (m,), `axis` (m,) of the body that it lies across, -1 for none, `sign` of the outward
    normal along it (m,), `share` (m, 2^(dim-1)), the part of its area that each of its nodes stands for [m^(dim-1)], the
    integral of N_j, and `vector` (m, 2^(dim-1), dim), that of N_j n, n outward, which a pressure acts by; `name` (m,) int:
    2k for the shape's -x, -y, -z and 2k + 1 for +x, +y, +z, before its rotation; `outer` (m,) bool: not a side of a hole or
    of a crack; `last` (m,) bool: less than a cell behind the outermost of the outer ones of its name; `patches` by their
    names, rows.
    """

    nodes: np.ndarray
    cell: np.ndarray
    axis: np.ndarray
    sign: np.ndarray
    share: np.ndarray
    vector: np.ndarray
    name: np.ndarray
    outer: np.ndarray
    last: np.ndarray
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
        """Rows of the face "+x", "-x", ..., (m,) bool."""
        return self.outer & self.last & (self.name == 2 * "xyz".index(name[1]) + (name[0] == "+"))

    @property
    def names(self) -> list[str]:
        """The names of the faces that there are."""
        return [FACES[k] for k in np.unique(self.name[self.outer & self.last]).tolist()]

    def parts(self, rows: np.ndarray) -> dict[str, float]:
        """The area of some faces, `rows` (m,) bool, by their names [m^(dim-1)]."""
        area = np.bincount(self.name[rows], self.area[rows], len(FACES))
        return {name: float(area[k]) for k, name in enumerate(FACES) if area[k] > 0.0}


def find_faces(inside: np.ndarray, cut: np.ndarray) -> tuple[np.ndarray, ...]:
    """Cell, axis, sign of every cell face with no neighbour behind it, and whether it is not the side of a cut. `inside`
    says which cells of a grid there are, `cut` [axis, lower cell] which of its faces are cut."""
    rows: list[tuple[np.ndarray, ...]] = []
    for axis in range(inside.ndim):
        # What is below and above, of cells along the axis.
        last = inside.shape[axis] - 1
        lower, upper = (slice(None),) * axis + (slice(0, last),), (slice(None),) * axis + (slice(1, None),)
        for sign in (-1, 1):
            here, there = (upper, lower) if sign < 0 else (lower, upper)
            alone, parted = np.ones_like(inside), np.zeros_like(inside)
            alone[here] = ~inside[there]
            parted[here] = cut[axis][lower]
            whole = alone[inside]
            cell = np.flatnonzero(whole | parted[inside])
            rows.append((cell, np.full(len(cell), axis), np.full(len(cell), sign), whole[cell]))
    cell, axis, sign, whole = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    return cell, axis, sign, whole


def face_nodes(corners: np.ndarray, offsets: np.ndarray, axis: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Nodes of faces: those of the cell's corners (m, 2^dim) on the face's side, (m, 2^(dim-1))."""
    on = offsets.T[axis] == ((sign + 1) // 2)[:, None]
    return corners[on].reshape(len(corners), corners.shape[1] // 2)


def face_names(turn: np.ndarray, axis: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Numbers of the names of faces across `axis` (m,), with `sign` (m,) of their outward normal, of a grid whose
    directions are the columns of `turn` (dim, dim) in the axes of the shape."""
    normal = sign[:, None] * turn[:, axis].T
    nearest = np.abs(np.round(normal, 9)).argmax(1)
    return 2 * nearest + (normal[np.arange(len(axis)), nearest] > 0.0)


def outermost(name: np.ndarray, outer: np.ndarray, turn: np.ndarray, axis: np.ndarray, centre: np.ndarray, step:
np.ndarray, domain: Domain) -> np.ndarray:  # fmt: skip
    """Which faces lie less than a cell behind the outermost of the `outer` ones of their name, (m,) bool. `centre` (m,
    dim) of the faces along the grid's axes, and its `step` (dim,) [m]; `domain`: where the others of the body are."""
    along = turn[name // 2]
    height = np.einsum("mk,mk->m", along, centre) * np.where(name % 2, 1.0, -1.0)
    reach = np.abs(along[np.arange(len(axis)), axis]) * step[axis] * (1.0 - WHOLE)
    highest = np.full(len(FACES), -np.inf)
    np.maximum.at(highest, name[outer], height[outer])
    return height > domain.max(highest)[name] - reach
