"""Reading a body: its primitive fields by name, with their widths and units, for frames and probes."""

# pyright: strict

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.geometry.geometry import Geometry
from wsph.output.fields import DEFORMATION, ON_SURFACES
from wsph.plugins.traits import internal_units
from wsph.sph.averages import Averages
from wsph.units import Scales

DENSITY = "density"


class Readable(Protocol):
    """A system, as it is read."""

    @property
    def formulation(self) -> str: ...

    @property
    def state(self) -> State: ...

    @property
    def position(self) -> np.ndarray: ...

    @property
    def spacing(self) -> float: ...

    @property
    def density(self) -> float: ...

    @property
    def geometry(self) -> Geometry: ...

    @property
    def scales(self) -> Scales: ...

    @property
    def constitutive(self) -> Constitutive: ...

    @property
    def count(self) -> int:
        """Particles that carry the state."""
        ...

    @property
    def joined(self) -> bool:
        """Whether its particles are the corners of its cells."""
        ...

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, (n, width), nondimensional."""
        ...

    def current_density(self) -> np.ndarray:
        """Densities of the particles, (n,), nondimensional."""
        ...

    def current_position(self) -> np.ndarray:
        """Where the particles are, (n, dim) [m]."""
        ...

    def at_particles(self, particles: np.ndarray, name: str) -> list[Averages]:
        """How frames read the components of a field of the state at `particles` (m,)."""
        ...

    def sample(self, points: np.ndarray, name: str) -> list[Averages]:
        """How to read the components of a field of the state at `points` (m, dim) [m]."""
        ...


@dataclass(frozen=True)
class Field:
    """A primitive field: `width` components in the state's field `stored`, from `first` on; `unit` is its SI unit and
    `scale` what one inner unit is in it. `bounded`: it is read within the range of the values around."""

    name: str
    width: int
    unit: str
    scale: float
    stored: str
    first: int = 0
    bounded: bool = False


def _scale(unit: str, scales: Scales) -> float:
    """SI units in one inner unit."""
    usual = {"m": scales.length, "m/s": scales.velocity, "Pa": scales.stress, "": 1.0}
    return usual[unit] if unit in usual else scales.of(unit)


class Reading:
    """The fields of a body that frames and probes can read, in SI.

    `fields` by name are those of its state: the velocity, the stress, the displacement and the damage where the state has
    them, and the internals by their own names. The density is read beside them: it follows from the deformation.
    """

    def __init__(self, system: Readable):
        self._system = system
        self.on_surface: Mapping[str, Callable[[], np.ndarray]] = {}
        """Fields of its surface that contact has, by their names, (n, 1), SI."""

    @cached_property
    def fields(self) -> dict[str, Field]:
        """Every field of the state that can be read, by its name."""
        system, constitutive = self._system, self._system.constitutive
        found: dict[str, Field] = {}
        for field in system.state.layout.fields:
            if not field.hidden:
                scale = _scale(field.unit, system.scales)
                found[field.name] = Field(field.name, field.width, field.unit, scale, field.name, 0, field.bounded)
        if DEFORMATION in system.state.layout:
            found[DEFORMATION] = Field(DEFORMATION, system.state.layout[DEFORMATION], "", 1.0, DEFORMATION)
        places = {name: k for k, name in enumerate(constitutive.internals)}
        for name, unit in internal_units(constitutive.material).items():
            found[name] = Field(name, 1, unit, constitutive.internal_scales[name], "internals", places[name], True)
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all primitive fields."""
        return (*self.fields, DENSITY, *self.on_surface)

    @property
    def labels(self) -> tuple[str, ...]:
        """Components of the stress that are kept, in the order of its columns."""
        return self._system.constitutive.state.labels

    @property
    def count(self) -> int:
        """Particles that carry the state."""
        return self._system.count

    @property
    def positions(self) -> np.ndarray:
        """Where the particles are in the reference configuration, (n, dim) [m]."""
        return self._system.position

    @property
    def current_positions(self) -> np.ndarray:
        """Where the particles are, (n, dim) [m]: the reference configuration where nothing follows their displacement."""
        return self._system.current_position()

    def si(self, name: str) -> np.ndarray:
        """A primitive field of the particles as frames carry it, (n, width), SI. Raises KeyError for one that the body does
        not have."""
        system = self._system
        if name == DENSITY:
            return system.current_density()[:, None] * system.scales.density
        if name in self.on_surface:
            return self.on_surface[name]()
        field = self.fields[name]
        values = system.filtered(field.stored)
        return values[:, field.first : field.first + field.width] * field.scale

    @property
    def cells(self) -> tuple[np.ndarray, ...]:
        """Corners of the cells that its particles are the corners of, as `Geometry.blocks` has them; none where particles
        are but points."""
        return self._system.geometry.blocks if self._system.joined else ()

    @cached_property
    def _points_of_cells(self) -> tuple[np.ndarray, ...]:
        return self._system.geometry.points_of_cells

    def of_cells(self, name: str) -> np.ndarray:
        """A primitive field of the `cells`, block after block, (c, width), SI: of the point in each, as computed, or the
        mean of the points on its edges; of a field of the particles the mean of its corners. A particle that is but a point
        has its own."""
        if name == DENSITY or name in self.on_surface or not self.apart(name):
            values = self.si(name)
            return np.concatenate([values[corners].mean(1) for corners in self.cells]) if self.cells else values
        field = self.fields[name]
        values = self._system.state.read(field.stored)[:, field.first : field.first + field.width] * field.scale
        return np.concatenate([values[points].mean(1) for points in self._points_of_cells])

    def unit(self, name: str) -> str:
        """The SI unit of a primitive field, "1" of a plain number. Raises KeyError for one that the body does not have."""
        if name in self.on_surface:
            return ON_SURFACES[name]
        return "kg/m3" if name == DENSITY else self.fields[name].unit or "1"

    def apart(self, name: str) -> bool:
        """Whether a field stands at points of its own, inside the cells, and not at the particles."""
        system = self._system
        return system.state.counts.get(self.fields[name].stored, system.count) != system.count

    def where(self, name: str) -> np.ndarray:
        """Where a field of the state stands in the reference configuration, (m, dim) [m]."""
        return self._system.geometry.cells if self.apart(name) else self._system.position

    def volumes(self, name: str) -> np.ndarray:
        """The volumes of the places where a field of the state stands, (m,) [m^dim]."""
        geometry, position = self._system.geometry, self._system.position
        at_nodes = not self.apart(name) and np.array_equal(position, geometry.nodes)
        return geometry.node_volume if at_nodes else geometry.cell_volume

    def at_places(self, places: np.ndarray, name: str) -> list[Averages]:
        """How to read the components of a field at some of the places where it stands, (m,): of particles as frames do, of
        points of its own as computed."""
        field = self.fields[name]
        if self.apart(name):
            return [Averages.themselves(places)] * field.width
        return self._system.at_particles(places, field.stored)[field.first : field.first + field.width]

    def sample(self, points: np.ndarray, name: str) -> list[Averages]:
        """How to read the components of a field of the state at `points` (m, dim) [m]: of a particle as frames do. Raises
        ValueError for a point that has two values, on a crack."""
        field = self.fields[name]
        return self._system.sample(points, field.stored)[field.first : field.first + field.width]

    @property
    def buffers(self) -> tuple[Array, Array]:
        """The buffer of the state and the buffer of its derived fields. `index` counts through both, the second
        after the first. The same array twice where nothing is derived."""
        state = self._system.state
        return state.buffer, state.derived.buffer if state.derived is not None else state.buffer

    def index(self, name: str, particles: np.ndarray, component: int) -> np.ndarray:
        """Where a component of a field of particles, or of points of its own, stands in the `buffers`."""
        field = self.fields[name]
        return np.asarray(self._system.state.index(field.stored, particles, field.first + component))
