"""Surfaces of plain meshes whose vertices a test moves itself, for laws of meeting without a body."""

from typing import Any

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.meeting.meeting import Meeting
from wsph.contact.surfaces.struct import surface_struct

SMOOTH = 0.64


class PlainMesh:
    """Vertices X (n, dim) and faces (m, dim), outward by their order."""

    def __init__(self, places: np.ndarray, faces: np.ndarray):
        self.X, self.faces = np.asarray(places, float), np.asarray(faces, np.int64)
        areas = area_vectors(self.X, self.faces)
        self.A = np.linalg.norm(areas, axis=1)
        self.N = areas / self.A[:, None]


def area_vectors(x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Outward area vectors of the faces, in 2D and 3D."""
    if x.shape[1] == 2:
        along = x[faces[:, 1]] - x[faces[:, 0]]
        return np.stack([along[:, 1], -along[:, 0]], axis=1)
    return 0.5 * np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])


def polygon(corners: np.ndarray, spacing: float) -> PlainMesh:
    """The outline of a polygon, corners against the clock, in segments of about a spacing."""
    corners = np.asarray(corners, float)
    pieces = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        k = max(1, round(float(np.linalg.norm(b - a)) / spacing))
        pieces.append(a + (b - a) * np.arange(k)[:, None] / k)
    places = np.concatenate(pieces)
    n = len(places)
    return PlainMesh(places, np.stack([np.arange(n), (np.arange(n) + 1) % n], axis=1))


def square(side: float, spacing: float, centre: tuple[float, float] = (0.0, 0.0), turn: float = 0.0) -> PlainMesh:
    """A square, turned by `turn` [radians]."""
    c, s = np.cos(turn), np.sin(turn)
    corners = 0.5 * side * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ np.array([[c, s], [-s, c]])
    return polygon(corners + np.array(centre), spacing)


def circle(radius: float, count: int, centre: tuple[float, float] = (0.0, 0.0), first: float = 0.0) -> PlainMesh:
    """A circle in `count` chords, the first vertex at the angle `first`."""
    angle = first + 2.0 * np.pi * np.arange(count) / count
    places = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1) + np.array(centre)
    return PlainMesh(places, np.stack([np.arange(count), (np.arange(count) + 1) % count], axis=1))


def box(size: tuple[float, float, float], spacing: float, turn: np.ndarray | None = None,
        centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> PlainMesh:  # fmt: skip
    """The surface of a box in triangles, turned by a matrix (3, 3) about its centre."""
    counts = [max(1, round(s / spacing)) for s in size]
    index: dict[tuple[int, ...], int] = {}
    faces: list[tuple[int, int, int]] = []

    def vertex(at: tuple[int, ...]) -> int:
        return index.setdefault(at, len(index))

    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, counts[axis]):
            for i in range(counts[b]):
                for j in range(counts[c]):
                    corners = []
                    for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        at = [0, 0, 0]
                        at[axis], at[b], at[c] = end, i + p, j + q
                        corners.append(vertex(tuple(at)))
                    if end == 0:
                        corners = corners[::-1]
                    faces += [(corners[0], corners[1], corners[2]), (corners[0], corners[2], corners[3])]
    places = np.array(list(index), float) / np.array(counts) * np.array(size) - 0.5 * np.array(size)
    if turn is not None:
        places = places @ turn.T
    return PlainMesh(places + np.array(centre), np.array(faces))


class Standin:
    """A surface whose vertices are at `mesh.X` + what a test gives, of unit modulus, impedance and wave speed."""

    def __init__(self, name: str, mesh: PlainMesh, spacing: float, space: Space, clock: Clock):
        self.name, self.mesh, self.spacing, self._clock, self._space = name, mesh, spacing, clock, space
        self.n, self.m, self.here = len(mesh.X), len(mesh.faces), np.ones(len(mesh.X), bool)
        self.modulus = self.impedance = self.wave_speed = self.carries = self.least_side = 1.0
        dim, device = space.dim, clock.device
        at = mesh.faces.ravel()
        order = np.argsort(at, kind="stable")
        starts = np.concatenate([[0], np.cumsum(np.bincount(at, minlength=self.n))])
        around = order // dim
        self._groups, sharp = [], np.zeros(self.n, np.int32)
        for f in range(self.m):
            for v in mesh.faces[f]:
                here = around[starts[v] : starts[v + 1]]
                near = mesh.N[here] @ mesh.N[f] > SMOOTH
                sharp[v] |= not near.all()
                self._groups.append(here[near])
        self.struct: Any = surface_struct(space)()
        for name in ("x", "moved", "speed"):
            setattr(self.struct, name, wp.zeros(self.n, dtype=space.vec, device=device))
        self.struct.area = wp.zeros(self.m, dtype=space.vec, device=device)
        self.struct.normal = wp.zeros(self.m * dim, dtype=space.vec, device=device)
        self.struct.size = wp.array(mesh.A, dtype=space.scalar, device=device)
        self.struct.faces = wp.array(mesh.faces, dtype=wp.int32, device=device)
        self.struct.starts = wp.array(starts, dtype=wp.int32, device=device)
        self.struct.around = wp.array(around, dtype=wp.int32, device=device)
        self.struct.sharp = wp.array(sharp, dtype=wp.int32, device=device)
        self.force = wp.zeros(self.n, dtype=space.vec, device=device)
        self._x = self._before = mesh.X
        self.place()
        self.close()

    def place(self, moved: np.ndarray | float = 0.0) -> None:
        """Vertices at their places in the mesh and `moved` (n, dim) or (dim,) beyond them; forces are zero."""
        self._x = self.mesh.X + moved
        areas = area_vectors(self._x, self.mesh.faces)
        normal = np.array([areas[group].sum(0) for group in self._groups])
        s = self.struct
        s.x.assign(self._x)
        s.moved.assign(self._x - self._before)
        s.speed.assign((self._x - self._before) / self._clock.dt)
        s.area.assign(areas)
        s.normal.assign(normal / np.linalg.norm(normal, axis=1, keepdims=True))
        self.force.zero_()

    def close(self) -> None:
        """Ways begin where the vertices are."""
        self._before = self._x

    def places(self) -> np.ndarray:
        return self._x

    def square(self, stiffness: np.ndarray) -> float:
        """Of vertices of unit mass."""
        return float(np.max(stiffness))

    def meets(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        return ~(self.mesh.faces[faces] == np.asarray(vertices)[:, None]).any(1)

    @property
    def total(self) -> np.ndarray:
        """The sum of the forces, (dim,)."""
        return self.force.numpy().sum(0)


def advance(law: Meeting, one: Standin, other: Standin, to: Any, place: Any = 0.0) -> None:
    """A step: `one` goes to `place`, `other` `to` where it is to be, both beyond their meshes. Forces stay to be read."""
    one.place(place)
    other.place(to)
    law.act()
    law.close()
    one.close()
    other.close()
