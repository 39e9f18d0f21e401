"""Prescribed loads on faces as forces on particles: rows that add up.

A row is a particle and a force per unit of one prescribed value. Every load is such rows, any number of them a particle:
components of a stress, tractions, loads that overlap or meet at a node or at an edge all add, and the resultant is the sum
of what was asked.
"""

# pyright: strict

import math
from dataclasses import dataclass, replace

import numpy as np

from wsph.boundary.programs.prescribed import Prescribed
from wsph.geometry.faces import Faces
from wsph.geometry.geometry import Geometry
from wsph.output.fields import AXES


@dataclass(frozen=True)
class FaceLoad:
    """One prescribed value [Pa] on faces of a body, by r rows: `particle` (r,), `push` (r, dim) the force per unit of the
    value [m^(dim-1)], of a total force a part of one, in the reference configuration, along the coordinate axes; `face`
    (r,) the row of the face that it comes from; `owner` the number of the boundary that it is of."""

    value: Prescribed
    particle: np.ndarray
    push: np.ndarray
    face: np.ndarray
    owner: int = -1

    def where(self, rows: np.ndarray) -> "FaceLoad":
        """Some of its rows, (r,) bool or the rows' numbers."""
        return replace(self, particle=self.particle[rows], push=self.push[rows], face=self.face[rows])


def face_load(faces: Faces, on: np.ndarray, face: np.ndarray, pushed: np.ndarray, value: Prescribed) -> FaceLoad:
    """A value that pushes the faces `face` (k,) along `pushed` (k, dim), per unit of area. `on` (m, c): the particles that
    stand for each face of the body."""
    share = faces.shares(on)[face]
    push = share[:, :, None] * pushed[:, None, :]
    return FaceLoad(value, on[face].ravel(), push.reshape(-1, pushed.shape[1]), face.repeat(on.shape[1]))


FORCE = {1: "N/m2", 2: "N/m", 3: "N"}
"""Units of total forces, by the dimension: of a bar per cross section, in the plane per depth."""


def traction_load(faces: Faces, on: np.ndarray, acting: np.ndarray, axis: str, value: Prescribed, dim: int) -> FaceLoad:
    """A traction along a coordinate axis on the faces `acting` (m,) bool."""
    face = np.flatnonzero(acting)
    return face_load(faces, on, face, np.tile(np.eye(dim)[AXES.index(axis)], (len(face), 1)), value)


def whole_area(geometry: Geometry, acting: np.ndarray) -> float:
    """The area of the faces `acting` (m,) bool of the whole body [m^(dim-1)], rounded once."""
    mine = geometry.sides.area[acting & geometry.own_faces]
    return math.fsum(geometry.split.domain.joined(mine).tolist())


def total_load(
    geometry: Geometry, on: np.ndarray, acting: np.ndarray, axis: str, value: Prescribed, dim: int
) -> FaceLoad:
    """A total force along a coordinate axis, in units of `FORCE`, in even parts of the area of the faces `acting` (m,) bool:
    its rows add up to it, whatever their area is."""
    load = traction_load(geometry.sides, on, acting, axis, value, dim)
    return replace(load, push=load.push / max(whole_area(geometry, acting), np.finfo(float).tiny))


def stress_load(
    faces: Faces, on: np.ndarray, acting: np.ndarray, label: str, value: Prescribed, geometry: Geometry
) -> FaceLoad:
    """A component of the nominal stress, along the axes of the grid, on those of the faces `acting` (m,) bool that it acts
    on: across either of its axes it pushes along the other."""
    first, second = (AXES.index(axis) for axis in label)
    face = np.flatnonzero(acting & np.isin(faces.axis, [first, second]))
    along = np.where(faces.axis[face] == first, second, first)
    return face_load(faces, on, face, faces.sign[face, None] * geometry.axes.T[along], value)
