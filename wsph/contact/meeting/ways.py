"""Vertices of one surface against faces of another: one of the two ways in which two surfaces meet."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import warp as wp
from numpy.typing import NDArray

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain
from wsph.backend.space import Array, Space
from wsph.contact.meeting.candidates import none, rows_of_pairs
from wsph.contact.meeting.memory import ENERGIES, Memory
from wsph.contact.meeting.structs import Faces, law_struct, record_struct
from wsph.contact.meeting.touch import add_kernel, answer_kernel, ease_kernel, touch_kernel
from wsph.contact.surfaces.meshing.sparse import among
from wsph.contact.surfaces.struct import SurfaceArrays
from wsph.sph.pairs import find_pairs

Places = Mapping[str, NDArray[np.float64]]
"""Where the vertices of surfaces are, by the bodies' names, (n, dim), nondimensional."""

DEPTH = 1.0
"""From a face, in spacings, at which a vertex does not meet it any more. Corners that hit each other head on go in by three
quarters of one."""

SLACK = 1.2
"""Faces may grow by this from one search to the next."""

TANGENT = 0.7
"""Stiffness of stick in that of depth: about that of a half-space under a patch, 2 (1 - nu)/(2 - nu) with nu = .45
(Mindlin 1949)."""


class RecordArrays(Protocol):
    """What acts on vertices or edges, as kernels take it: the `force` on each, and more."""

    force: Array


class Pushes(RecordArrays, Protocol):
    """What acts on vertices (`wsph.contact.meeting.structs.record_struct`)."""

    count: Array
    faces: Array


class Met(Protocol):
    """A surface as laws of meeting see it (`wsph.contact.surfaces.surface.Surface`)."""

    name: str
    n: int
    m: int
    spacing: float
    struct: SurfaceArrays
    force: Array
    here: NDArray[np.bool_]
    """Which vertices the motion of particles that are here depends on, (n,)."""

    def meets(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray: ...


@dataclass
class Numbers:
    """Of the law of two surfaces, both ways together, nondimensional.

    stiffness  # pressure per depth
    impedance  # of the damper, pressure per speed
    softening  # rate: the impedance is divided by 1 + softening dt
    friction   # Coulomb's coefficient
    relax      # rate of friction's memory, 0 for none
    edges      # whether edges meet edges
    """

    stiffness: float
    impedance: float
    softening: float
    friction: float
    relax: float
    edges: bool = False


class Way:
    """The vertices of `own` against the faces of `other`, which may be the same surface.

    Each way has half of the stiffness. What acts on the vertices is found first, then what acts back is gathered at the
    vertices of the faces, in ascending order: sums have the same bits for any number of threads.

    Processes deal the vertices out, and tell each other what acts on them; what acts back each finds where it has particles.
    """

    def __init__(
        self,
        own: Met,
        other: Met,
        numbers: Numbers,
        space: Space,
        clock: Clock,
        arrays: Arrays,
        domain: Domain = WHOLE,
    ):
        self.own, self.other, self.numbers = own, other, numbers
        self._space, self._clock, self._device, self._arrays = space, clock, clock.device, arrays
        self.width = max(own.spacing, other.spacing)
        self.memory = Memory(own.n, space, clock, arrays, domain)
        self._make()

    def _make(self) -> None:
        own, other, space, arrays = self.own, self.other, self._space, self._arrays
        self.faces: NDArray[np.int64] = other.struct.faces.numpy().astype(np.int64).reshape(other.m, space.dim)
        record: Any = record_struct(space)()
        record.force = arrays.zeros("force", own.n, space.vec)
        record.count, record.faces = arrays.zeros("count", own.n, wp.int32), arrays.zeros("faces", own.n, Faces)
        self.record: Pushes = record
        self._span, self._met = 0.0, np.zeros(0, np.int64)
        self.rows, self._back, self._told = (none(self._device) for _ in range(3))
        self.known, self._read = np.zeros(0, np.int64), np.zeros(0, np.int64)

    def renew(self, surface: Met, rows: NDArray[np.int64]) -> None:
        """One of the two surfaces was remade: `rows` (old n,) are those of its old vertices, -1 where they are gone."""
        if surface is self.own:
            self.memory.renew(surface.n, rows)
        if surface in (self.own, self.other):
            self._make()

    def find(self, places: Places, skin: float) -> None:
        """Find the candidates: faces whose centre is within reach of a vertex, further away than any that it may meet
        before something has gone half of `skin`."""
        own, other = self.own, self.other
        corners = places[other.name][self.faces]
        centre = corners.mean(1)
        radius = SLACK * float(np.linalg.norm(corners - centre[:, None], axis=2).max())
        self._span, reach, dealt = 2.0 * radius, radius + DEPTH * self.width + skin, self.memory.dealt
        self.memory.deal(_within(places[own.name], centre, reach))
        pairs = find_pairs(places[own.name][dealt.own], centre, reach, self._device)
        vertices, faces = pairs.rows().astype(np.int64) + dealt.own.start, pairs.indices.numpy().astype(np.int64)
        if own is other:
            may = own.meets(vertices, faces)
            vertices, faces = vertices[may], faces[may]
        self.rows, self._met = rows_of_pairs(vertices, faces, self._device), among(other.m, faces)
        self._answered(*dealt.joined(np.stack([vertices, faces], 1)).T)
        self.record.force.zero_()
        self.record.count.zero_()

    def _answered(self, vertices: NDArray[np.int64], faces: NDArray[np.int64]) -> None:
        """Take the pairs (p,) of all processes: what acts back, and what the others find that is needed here."""
        own, other, dealt, device = self.own, self.other, self.memory.dealt, self._device
        near = among(own.n, vertices)
        self.memory.release(near)
        answers = np.logical_or.reduce(other.here[self.faces], axis=1)
        felt, may = near[own.here[near]], answers[faces]
        self.known = among(own.n, self.rows.which, felt, vertices[may])
        dealt.ask(self.known)
        told = felt[~dealt.share.owns(felt)]
        self._told = rows_of_pairs(told, told, device)
        around, by = self.faces[faces[may]].ravel(), np.repeat(vertices[may], self._space.dim)
        here = other.here[around]
        self._back, self._read = rows_of_pairs(around[here], by[here], device), among(other.n, around)

    @property
    def near(self) -> list[tuple[Met, NDArray[np.int64], NDArray[np.int64]]]:
        """Of each of the two surfaces, the vertices and the faces that kernels read or write."""
        return [(self.own, self.known, np.zeros(0, np.int64)), (self.other, self._read, self._met)]

    @property
    def law(self) -> object:
        """The numbers that kernels take."""
        real, numbers = self._space.scalar, self.numbers
        law: Any = law_struct(self._space)()
        law.stiffness, law.impedance = real(0.5 * numbers.stiffness), real(0.5 * numbers.impedance)
        law.softening, law.relax = real(numbers.softening), real(numbers.relax)
        law.friction, law.tangent = real(numbers.friction), real(TANGENT)
        law.depth, law.width, law.span = real(DEPTH * self.width), real(self.own.spacing), real(self._span)
        law.edges = real(float(numbers.edges))
        return law

    def start(self) -> None:
        """Take the depths that there are as none (a launch)."""
        if self.rows.count:
            inputs = [self.law, self.rows.struct, self.own.struct, self.other.struct]
            self._clock.launch(ease_kernel(self._space), self.rows.count, inputs, [self.memory["ease"]])

    def touch(self) -> None:
        """Find what acts on the vertices, and add it to the forces on them (a launch)."""
        if self.rows.count:
            own, other = self.own.struct, self.other.struct
            inputs = [self.law, self.rows.struct, own, other, self._clock.time, self.memory.kept]
            outputs = [self.memory.trial, self.record, self.own.force]
            self._clock.launch(touch_kernel(self._space), self.rows.count, inputs, outputs)

    def tell(self) -> None:
        """Have of what other processes have found what is needed here (a message), and add it to the forces on the vertices
        (a launch)."""
        record = self.record
        self.memory.dealt.tell(record.force, record.count, record.faces, self.memory["gap"])
        if self._told.count:
            inputs = [self._told.struct.which, record.force]
            self._clock.launch(add_kernel(self._space), self._told.count, inputs, [self.own.force])

    def answer(self) -> None:
        """Add what acts back to the forces on the other surface (a launch)."""
        if self._back.count:
            inputs = [self._back.struct, self.own.struct, self.other.struct, self.record]
            self._clock.launch(answer_kernel(self._space), self._back.count, inputs, [self.other.force])

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (a launch)."""
        self.memory.keep(self.rows)

    def gather(self) -> None:
        """Have what acts on all vertices, and their energies, of all processes (on the host)."""
        self.memory.dealt.gather(self.record.force, *(self.memory[name] for name in ENERGIES))


def _within(places: NDArray[np.float64], centre: NDArray[np.float64], reach: float) -> NDArray[np.int64]:
    """Which `places` (n, dim) are in a box about all that are within reach of a `centre` (m, dim), ascending."""
    low, high = centre.min(0) - reach, centre.max(0) + reach
    return np.flatnonzero(((places >= low) & (places <= high)).all(1))
