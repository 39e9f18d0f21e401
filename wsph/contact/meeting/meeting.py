"""The law of two surfaces that meet, or of one with itself.

Every vertex of each surface is held against the faces of the other (`wsph.contact.meeting.touch`), with half of the
stiffness each way, and in 3D edges against edges (`wsph.contact.meeting.crossing`). The stiffness K eps of the penalty is K
times that of half a cell of each body in series: waves pass through a contact as through another cell.
"""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wsph.backend.arrays import Arrays, host
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.space import Array, Space
from wsph.contact.meeting.edges import Crossings
from wsph.contact.meeting.forces import forgetting
from wsph.contact.meeting.ridges import Ridges, ridges
from wsph.contact.meeting.ways import Met, Numbers, Places, Way
from wsph.contact.surfaces.laws import Ground, Law
from wsph.contact.surfaces.surface import Surface
from wsph.scene.scene import Scene
from wsph.scene.touch.contact import STICKY, Contact

SOFT = 0.5
"""Damping of the rate c is divided by 1 + SOFT c dt, so that it never needs a shorter step than none."""


OWN = 1.0
"""The largest stiffness that the time step may choose, in that of a cell, or less where a body has no waves for it. A
stiffer contact moves faster than all waves of the bodies: of rods that bounce less comes back (.985 with 4, .990 with 1),
contacts open and close inside of steps, and blocks that slide at mu = .5 on a floor of twice their spacing hum from 2 on."""


class SurfaceMesh(Protocol):
    """The mesh of a surface in the reference configuration: vertices (n, dim), faces (m, dim), their normals (m, dim)."""

    @property
    def X(self) -> np.ndarray: ...

    @property
    def faces(self) -> np.ndarray: ...

    @property
    def N(self) -> np.ndarray: ...


class Meets(Met, Protocol):
    """A surface as the law of meeting sees it (`wsph.contact.surfaces.surface.Surface`)."""

    wave_speed: float
    modulus: float
    impedance: float
    carries: float
    least_side: float

    @property
    def mesh(self) -> SurfaceMesh: ...

    def square(self, stiffness: np.ndarray) -> float: ...


@dataclass(frozen=True)
class ContactNumbers:
    """Of a contact, as a scene gives them.

    stiffness  # K, of half a cell of each body in series; `automatic`: the step may choose another
    friction   # Coulomb's coefficient
    damping    # zeta, of the impedances of the bodies in series; `soft`: less where the step needs it
    memory     # of friction, in the time that a wave takes over a spacing; 0 for none, None by the sizes of the bodies
    edges      # whether edges meet edges, in 3D
    """

    stiffness: float = 1.0
    friction: float = 0.0
    damping: float = 0.0
    memory: float | None = None
    edges: bool = True
    automatic: bool = False
    soft: bool = True


class Meeting(Law):
    """`one` meets `other`, which is the same surface for contact of a body with itself."""

    def __init__(
        self,
        name: str,
        one: Meets,
        other: Meets,
        contact: ContactNumbers,
        space: Space,
        clock: Clock,
        domain: Domain = WHOLE,
    ):
        self.name, self.one, self.other, self._contact = name, one, other, contact
        self._space, self._clock = space, clock
        width, speed = max(one.spacing, other.spacing), min(one.wave_speed, other.wave_speed)
        relax = forgetting(contact.memory, width, min(one.least_side, other.least_side), speed)
        series = 2.0 * one.impedance * other.impedance / (one.impedance + other.impedance)
        self._numbers = Numbers(
            0.0, contact.damping * series, 0.0, contact.friction, relax, contact.edges and space.dim == 3
        )
        self._drag = self._numbers.impedance * self._per_mass(np.ones(1))
        self._numbers.softening = SOFT * self._drag if contact.soft else 0.0
        self._arrays = Arrays(clock.device)
        ways = ((one, other), (other, one))[: len(self.sides)]
        self.ways = [
            Way(own, against, self._numbers, space, clock, self._arrays.part(_called(own, against)), domain)
            for own, against in ways
        ]
        self.crossings: Crossings | None = None
        if self._numbers.edges:
            lines = _ridges(one), _ridges(other)
            self.crossings = Crossings(one, other, lines, self._numbers, space, clock, self._arrays.part("edges"))
        self._set(contact.stiffness)

    @property
    def sides(self) -> tuple[Meets, ...]:
        """The surfaces that it acts on: one of a body that meets itself."""
        return (self.one,) if self.one is self.other else (self.one, self.other)

    def _set(self, stiffness: float) -> None:
        one, other = self.one, self.other
        self._numbers.stiffness = stiffness / (0.5 * one.spacing / one.modulus + 0.5 * other.spacing / other.modulus)

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness K where the scene leaves it open; whether it does."""
        if self._contact.automatic:
            self._set(min(stiffness, OWN, *(side.carries for side in self.sides)))
        return self._contact.automatic

    def renew(self, surface: Met, rows: NDArray[np.int64]) -> None:
        """One of the surfaces was remade: `rows` (old n,) are those of its old vertices, -1 where they are gone."""
        for way in self.ways:
            way.renew(surface, rows)
        if self.crossings is not None:
            self.crossings.renew(_ridges(self.one), _ridges(self.other))

    @property
    def _parts(self) -> list[Way | Crossings]:
        return [*self.ways, *([self.crossings] if self.crossings else [])]

    def find(self, places: Places, skin: float) -> None:
        """Find, on the host, what may be met before the surfaces have come nearer by `skin`."""
        for part in self._parts:
            part.find(places, skin)

    def near(self) -> dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Of every surface, by the body's name, the vertices that kernels read or write, and the faces whose normals they
        read."""
        found: dict[str, tuple[list[NDArray[np.int64]], list[NDArray[np.int64]]]] = {}
        for part in self._parts:
            for side, vertices, faces in part.near:
                kept = found.setdefault(side.name, ([], []))
                kept[0].append(vertices)
                kept[1].append(faces)
        return {name: (np.concatenate(vertices), np.concatenate(faces)) for name, (vertices, faces) in found.items()}

    def start(self) -> None:
        """Take the depths that there are at the start as none (launches)."""
        for way in self.ways:
            way.start()

    def act(self) -> None:
        """Add the forces to those of the surfaces (launches): at a vertex what acts on it, whoever has found that, before
        what acts back, so that sums have the bits of one process."""
        for way in self.ways:
            way.touch()
        for way in self.ways:
            way.tell()
        for way in self.ways:
            way.answer()
        if self.crossings is not None:
            self.crossings.act()

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (launches)."""
        for part in self._parts:
            part.close()

    def _per_mass(self, stiffness: NDArray[np.float64]) -> float:
        """A bound of omega^2 of springs of a `stiffness` per area between the surfaces: those of both bodies add, since they
        move against each other; of a surface with itself, two of its particles do."""
        sizes = [stiffness * vertex_areas(side, self._space.dim) for side in self.sides]
        each = [side.square(size) for side, size in zip(self.sides, sizes, strict=True)]
        return sum(each) * (2.0 if len(each) == 1 else 1.0)

    def bound(self, surface: Meets) -> tuple[float, float]:
        """Bounds of omega^2 and of the rate of damping that it adds to the body of a surface, nondimensional."""
        if all(surface is not side for side in self.sides):
            return 0.0, 0.0
        square = 0.0
        for side in self.sides:
            stiffness = self._numbers.stiffness * vertex_areas(side, self._space.dim)
            if self.crossings:
                for own, lines in zip((self.one, self.other), self.crossings.lines, strict=True):
                    if own is side and len(lines.line):
                        stiffness[np.unique(lines.ends)] += self.crossings.stiffness
            square += side.square(stiffness)
        square *= 2.0 if len(self.sides) == 1 else 1.0
        return square, 0.0 if self._contact.soft else self._drag

    @property
    def stored(self) -> float:
        """Energy that it holds now, nondimensional."""
        return sum(part.memory.stored for part in self._parts)

    @property
    def dissipated(self) -> float:
        """Energy that friction and damping have taken so far, nondimensional."""
        return sum(part.memory.lost for part in self._parts)

    @property
    def pushes(self) -> list[tuple[Array, float]]:
        """Arrays of forces, with the factors that make their sum that on the first surface."""
        if self.one is self.other:
            return []
        return [
            (part.record.force, float(part.own is self.one) - float(part.other is self.one)) for part in self._parts
        ]

    @property
    def energies(self) -> list[Array]:
        """What is stored and dissipated, by contact."""
        return [part.memory[name] for part in self._parts for name in ("stored", "sprung", "lost")]

    def surface_gaps(self, surface: Meets) -> NDArray[np.float64]:
        """Gaps of a surface's vertices at the end of the last step, NaN where there is nothing to meet, (n,)."""
        found = np.full(surface.n, np.nan)
        for way in self.ways:
            if way.own is surface:
                found = np.fmin(found, way.memory.gaps(way.known))
        return found

    def force(self, surface: Meets) -> NDArray[np.float64]:
        """The sum of its forces on a surface at the last evaluation, nondimensional (dim,)."""
        self.gather()
        total = np.zeros(self._space.dim)
        for part in self._parts:
            acts = host(part.record.force).sum(0, dtype=np.float64)
            total += acts * (int(part.own is surface) - int(part.other is surface))
        return total

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        return self._arrays.kept

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has."""
        found: dict[str, Share] = {}
        for way in self.ways:
            found |= way.memory.shares(_called(way.own, way.other))
        return found

    def gather(self) -> None:
        """Have `pushes` and `energies` whole (on the host)."""
        for part in self._parts:
            part.gather()


def _called(own: Met, against: Met) -> str:
    return f"{own.name}-{against.name}"


def vertex_areas(side: Met, dim: int) -> NDArray[np.float64]:
    """Every vertex's share of the faces around it, in the reference configuration, (n,)."""
    faces, size = host(side.struct.faces).ravel(), host(side.struct.size).astype(np.float64)
    return np.bincount(faces, np.repeat(size / dim, dim), side.n).astype(np.float64)


def _ridges(side: Meets) -> Ridges:
    mesh = side.mesh
    return ridges(np.asarray(mesh.X, float), np.asarray(mesh.faces, np.int64), np.asarray(mesh.N, float))


def meetings(scene: Scene, surface: Callable[[str], Surface], ground: Ground) -> list[Meeting]:
    """The contacts of a scene between surfaces."""
    return [
        Meeting(
            part.name,
            surface(part.names[0]),
            surface(part.names[-1]),
            _numbers(part),
            ground.space,
            ground.clock,
            ground.domain,
        )
        for part in scene.contact
        if part.law == "surface"
    ]


def _numbers(part: Contact) -> ContactNumbers:
    return ContactNumbers(
        stiffness=part.number or 1.0,
        friction=part.friction,
        damping=part.damping,
        memory=part.memory,
        edges=part.edges,
        automatic=part.number is None,
        soft=part.friction <= STICKY,
    )
