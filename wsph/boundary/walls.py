"""Walls: flat faces of a body behind which its particles have mirror images, in place of a first layer that is held.

A layer of particles that is held stands half a spacing inside of the face, and its neighbours miss what lies behind the
face: in a bar stress is off by a quarter there, however fine the lattice. A face is a wall where the component of the
velocity across it is prescribed, the same all over the face.
"""

# pyright: strict

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from wsph.boundary.programs.prescribed import Moved, nonzero, varies
from wsph.boundary.tables import Boundary
from wsph.doubts import doubt
from wsph.geometry.lattice import Lattice


@dataclass(frozen=True)
class Wall:
    """A flat face with prescribed velocities. `normal` (dim,) outward, `point` (dim,) [m] on it, `columns` (cells,) bool the
    cells that stand over it, `velocity` the prescribed components along the coordinate axes, and `owners` the numbers of the
    boundaries that they are of."""

    axis: int
    normal: np.ndarray
    point: np.ndarray
    columns: np.ndarray
    velocity: dict[int, Moved]
    owners: dict[int, int] = field(default_factory=dict[int, int])

    @property
    def driven(self) -> bool:
        """Whether it moves."""
        return any(nonzero(value) for value in self.velocity.values())


NEAR = 3
"""Cells: planes of one face nearer than this are its stairs, and what is narrower is a point and no face."""

Face = tuple[int, int, int]
"""A plane of cell faces: axis, sign of the normal, the line of the grid."""


@dataclass
class _Held:
    """Cells over which a face is held: velocities and the numbers of their boundaries, by component."""

    cells: np.ndarray
    velocity: dict[int, Moved] = field(default_factory=dict[int, Moved])
    owners: dict[int, int] = field(default_factory=dict[int, int])

    def take(self, velocity: dict[int, Moved], k: int) -> "_Held":
        self.velocity.update(velocity)
        self.owners.update(dict.fromkeys(velocity, k))
        return self


class Walls:
    """The walls of a body, found from its conditions one by one: those that prescribe the component across their face, and
    then those that prescribe others on the same."""

    def __init__(self, lattice: Lattice, body: str):
        self._lattice, self._body = lattice, body
        self._index = np.floor(lattice.index[lattice.corners].mean(1)).astype(int)
        self._planes: dict[Face, list[_Held]] = {}

    def take(
        self, k: int, condition: Boundary, particles: np.ndarray, rows: np.ndarray, velocity: dict[int, Moved]
    ) -> bool:
        """Take the condition of number `k` on `particles`, and `rows` of the faces, that prescribes `velocity`; whether it
        is a wall's. Warns of a face that cannot be one."""
        faces, frame, dim = self._lattice.faces, self._lattice.frame, self._index.shape[1]
        on = [axis for axis in range(dim) if np.isin(particles, faces.cell[rows & (faces.axis == axis)]).all()]
        if len(on) != 1 or not (len(velocity) == dim or on[0] in velocity or not frame.upright):
            return False
        chosen = self._cells(on[0], rows)
        if any(self._narrow(face, cells) for face, cells in chosen.items()):
            return False
        if why := self._fault(chosen, velocity):
            self._warn(condition, why)
            return False
        known = [(cells, held.cells) for face, cells in chosen.items() for held in self._planes.get(face, [])]
        if any(np.isin(cells, others).any() for cells, others in known):
            return self.join(k, on[0], rows, velocity)
        for face, cells in chosen.items():
            self._planes.setdefault(face, []).append(_Held(cells).take(velocity, k))
        return True

    def join(self, k: int, axis: int, rows: np.ndarray, velocity: dict[int, Moved]) -> bool:
        """Prescribe further components on walls that are there already; whether the faces are just these."""
        same = [
            [held for held in self._planes.get(face, []) if np.array_equal(held.cells, chosen)]
            for face, chosen in self._cells(axis, rows).items()
        ]
        if not same or not all(same) or not self._lattice.frame.upright:
            return False
        for given in same:
            given[0].take(velocity, k)
        return True

    def _cells(self, axis: int, rows: np.ndarray) -> dict[Face, np.ndarray]:
        """The cells of faces across an axis, by their planes."""
        faces = self._lattice.faces
        rows = np.flatnonzero(rows & (faces.axis == axis))
        line = self._index[faces.cell[rows], axis] + (faces.sign[rows] > 0)
        found: dict[Face, np.ndarray] = {}
        for sign, at in np.unique(np.stack([faces.sign[rows], line], 1), axis=0).tolist():
            found[axis, sign, at] = np.sort(faces.cell[rows[(faces.sign[rows] == sign) & (line == at)]])
        return found

    def _narrow(self, face: Face, cells: np.ndarray) -> bool:
        """Whether some cells on a face are fewer in a direction than a face's are."""
        across = [k for k in range(self._index.shape[1]) if k != face[0]]
        wide, whole = (np.ptp(index[:, across], axis=0) + 1 for index in (self._index[cells], self._index))
        return bool((wide < np.minimum(whole, NEAR)).any())

    def _fault(self, chosen: dict[Face, np.ndarray], velocity: dict[int, Moved]) -> str:
        """Why faces cannot be walls, or ""."""
        if self._lattice.cracks:
            return "the body is cracked"
        if len(velocity) < len(self._lattice.frame.step) and not self._lattice.frame.upright:
            return "it is turned and some components of its velocity are free"
        if any(varies(value) for value in velocity.values()):
            return "its velocity is not the same all over the face"
        lines = sorted((sign, at) for _, sign, at in chosen)
        if any(one[0] == other[0] and other[1] - one[1] < NEAR for one, other in pairwise(lines)):
            return "it is not flat"
        return ""

    def _warn(self, condition: Boundary, why: str) -> None:
        where = f"face {condition.face!r}" if condition.face else f"where {condition.where!r}"
        text = (
            f"body {self._body!r}, {where}: {why}, so that its first layer of particles is held in place of it: within three"
            ' spacings of it the stress is off by up to a quarter; formulation = "stress-points" has particles on the face'
        )
        doubt(text, stacklevel=2)

    def found(self) -> list[Wall]:
        """The walls that all conditions together make."""
        return [
            self._wall(axis, sign, plane, held)
            for (axis, sign, plane), entries in self._planes.items()
            for held in entries
        ]

    def _wall(self, axis: int, sign: int, plane: int, held: _Held) -> Wall:
        cells, lattice, index = held.cells, self._lattice, self._index
        columns = np.delete(index, axis, 1)
        _, key = np.unique(columns, axis=0, return_inverse=True)
        inside = index[:, axis] < plane if sign > 0 else index[:, axis] >= plane
        on = index[cells[0]].astype(float) + 0.5
        on[axis] = plane
        point = lattice.frame.points(on[None])[0]
        return Wall(
            axis,
            sign * lattice.frame.axes[:, axis],
            point,
            inside & np.isin(key, key[cells]),
            held.velocity,
            held.owners,
        )
