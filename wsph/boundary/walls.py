"""Walls: flat faces of a body behind which its particles have mirror images, in place of a first layer that is held.

A layer of particles that is held stands half a spacing inside of the face, and its neighbours miss what lies behind the
face: in a bar stress is off by a quarter there, however fine the lattice. A face is a wall where the component of the
velocity across it is prescribed, the same all over the face.
"""

# pyright: strict

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from wsph.backend.domain import anywhere
from wsph.boundary.programs.prescribed import Moved, nonzero, varies
from wsph.boundary.tables import Boundary
from wsph.doubts import doubt
from wsph.geometry.lattice import Lattice


@dataclass(frozen=True)
class Wall:
    """A flat face with prescribed velocities. `face`, the plane that it is on; `over` (k, dim) the cells beside it, of the
    whole body, by their places in the grid; `normal` (dim,) outward, `point` (dim,) [m] on it, `columns` (cells,) bool the
    cells of this part of the body that stand over it, `velocity` the prescribed components along the coordinate axes, and
    `owners` the numbers of the boundaries that they are of."""

    face: "Face"
    over: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    columns: np.ndarray
    velocity: dict[int, Moved]
    owners: dict[int, int] = field(default_factory=dict[int, int])

    @property
    def axis(self) -> int:
        """The axis of the grid that it is across."""
        return self.face[0]

    def of(self, lattice: Lattice) -> "Wall":
        """The same of another part of the body."""
        return replace(self, columns=_columns(self.face, self.over, cell_index(lattice)))

    @property
    def driven(self) -> bool:
        """Whether it moves."""
        return any(nonzero(value) for value in self.velocity.values())


NEAR = 3
"""Cells: planes of one face nearer than this are its stairs, and what is narrower is a point and no face."""

Face = tuple[int, int, int]
"""A plane of cell faces: axis, sign of the normal, the line of the grid."""


def cell_index(lattice: Lattice) -> np.ndarray:
    """The places of the cells in the grid, (cells, dim) int."""
    return np.floor(lattice.index[lattice.corners].mean(1)).astype(int)


def _columns(face: Face, over: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Which of the cells at `index` (n, dim) stand over a face with the cells `over` (k, dim) beside it, (n,) bool."""
    axis, sign, plane = face
    inside = index[:, axis] < plane if sign > 0 else index[:, axis] >= plane
    beside, mine = (np.delete(each, axis, 1) for each in (over, index))
    return inside & row_in(mine, beside)


def row_in(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Which rows of integers (n, k) are among others (m, k), (n,) bool."""
    _, key = np.unique(np.concatenate([others, rows]), axis=0, return_inverse=True)
    return np.isin(key[len(others) :], key[: len(others)])


@dataclass(frozen=True)
class _Cells:
    """Cells of the whole body beside a face, by their `number` (k,), ascending, and their places in the grid (k, dim)."""

    number: np.ndarray
    index: np.ndarray


@dataclass
class _Held:
    """Cells over which a face is held: velocities and the numbers of their boundaries, by component."""

    cells: _Cells
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
        self._lattice, self._body, self._domain = lattice, body, lattice.split.domain
        self._index = cell_index(lattice)
        self._extent = self._domain.max(self._index.max(0)) - self._domain.min(self._index.min(0)) + 1
        self._planes: dict[Face, list[_Held]] = {}

    def across(self, particles: np.ndarray, rows: np.ndarray) -> list[int]:
        """The axes across which each of some particles has one of some `rows` of the faces, in all parts of the body."""
        faces, dim = self._lattice.faces, self._index.shape[1]
        apart = [not np.isin(particles, faces.cell[rows & (faces.axis == axis)]).all() for axis in range(dim)]
        return np.flatnonzero(~anywhere(self._domain, np.array(apart))).tolist()

    def take(
        self, k: int, condition: Boundary, particles: np.ndarray, rows: np.ndarray, velocity: dict[int, Moved]
    ) -> bool:
        """Take the condition of number `k` on `particles`, and `rows` of the faces, that prescribes `velocity`; whether it
        is a wall's. Warns of a face that cannot be one."""
        frame, dim = self._lattice.frame, self._index.shape[1]
        on = self.across(particles, rows)
        if len(on) != 1 or not (len(velocity) == dim or on[0] in velocity or not frame.upright):
            return False
        chosen = self._cells(on[0], rows)
        if any(self._narrow(face, cells) for face, cells in chosen.items()):
            return False
        if why := self._fault(chosen, velocity):
            self._warn(condition, why)
            return False
        known = [(cells, held.cells) for face, cells in chosen.items() for held in self._planes.get(face, [])]
        if any(np.isin(cells.number, others.number).any() for cells, others in known):
            return self.join(k, on[0], rows, velocity)
        for face, cells in chosen.items():
            self._planes.setdefault(face, []).append(_Held(cells).take(velocity, k))
        return True

    def join(self, k: int, axis: int, rows: np.ndarray, velocity: dict[int, Moved]) -> bool:
        """Prescribe further components on walls that are there already; whether the faces are just these."""
        same = [
            [held for held in self._planes.get(face, []) if np.array_equal(held.cells.number, chosen.number)]
            for face, chosen in self._cells(axis, rows).items()
        ]
        if not same or not all(same) or not self._lattice.frame.upright:
            return False
        for given in same:
            given[0].take(velocity, k)
        return True

    def _cells(self, axis: int, rows: np.ndarray) -> dict[Face, _Cells]:
        """The cells of faces across an axis, of all parts of the body, by their planes."""
        faces, first = self._lattice.faces, self._lattice.split.points.first
        rows = np.flatnonzero(rows & (faces.axis == axis) & self._lattice.own_faces)
        cell, sign = faces.cell[rows], faces.sign[rows]
        line = self._index[cell, axis] + (sign > 0)
        mine = np.column_stack([sign, line, first + cell, self._index[cell]])
        every = self._domain.joined(mine.astype(np.int64))
        every = every[np.argsort(every[:, 2], kind="stable")]
        found: dict[Face, _Cells] = {}
        for way, at in np.unique(every[:, :2], axis=0).tolist():
            some = every[(every[:, 0] == way) & (every[:, 1] == at)]
            found[axis, way, at] = _Cells(some[:, 2], some[:, 3:])
        return found

    def _narrow(self, face: Face, cells: _Cells) -> bool:
        """Whether some cells on a face are fewer in a direction than a face's are."""
        across = [k for k in range(self._index.shape[1]) if k != face[0]]
        wide = np.ptp(cells.index[:, across], axis=0) + 1
        return bool((wide < np.minimum(self._extent[across], NEAR)).any())

    def _fault(self, chosen: dict[Face, _Cells], velocity: dict[int, Moved]) -> str:
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
        return [self._wall(face, held) for face, entries in self._planes.items() for held in entries]

    def _wall(self, face: Face, held: _Held) -> Wall:
        (axis, sign, plane), over, frame = face, held.cells.index, self._lattice.frame
        on = over[0].astype(float) + 0.5
        on[axis] = plane
        columns = _columns(face, over, self._index)
        normal, point = sign * frame.axes[:, axis], frame.points(on[None])[0]
        return Wall(face, over, normal, point, columns, held.velocity, held.owners)
