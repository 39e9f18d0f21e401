"""The state of a run between two steps: fields read, written, and shared without copies; and the numbers of its ledger."""

# pyright: strict
# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from wsph.backend.space import Array
from wsph.output import fields
from wsph.simulation.composing.composition import BodyRun


class BodyState:
    """A body between two steps. Fields are read by their names, as attributes or keys, in SI units: copies, (n, components)
    of vectors and (n, 6) of the stress, xx, yy, zz, xy, yz, xz."""

    def __init__(self, run: BodyRun, taken: Callable[[float], None]):
        self._run, self._taken = run, taken

    @property
    def name(self) -> str:
        """Its name in the scene."""
        return self._run.body.name

    @property
    def position(self) -> np.ndarray:
        """Where its particles are, (n, dim) [m]; where they were, where the form does not move them."""
        return self._run.reading.current_positions

    @property
    def reference(self) -> np.ndarray:
        """Where its particles were at the start, (n, dim) [m]."""
        return self._run.reading.positions

    def __getitem__(self, name: str) -> np.ndarray:
        """A field of its particles, as frames have it. Raises KeyError for one that it does not have."""
        reading = self._run.reading
        base = fields.primitive(name)
        if base not in reading.names:
            raise KeyError(f"body {self.name!r} has no field {name!r}; there is {', '.join(self.fields)}")
        return fields.shown(name, reading.si(base), reading.labels)

    def __getattr__(self, name: str) -> np.ndarray:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(str(error)) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.fields]

    @property
    def fields(self) -> tuple[str, ...]:
        """The names of its fields."""
        return tuple(name for name in self._run.reading.names if name != fields.DEFORMATION)

    def unit(self, name: str) -> str:
        """The SI unit of a field."""
        return self._run.reading.unit(fields.primitive(name))

    @property
    def velocity(self) -> np.ndarray:
        """Velocities of the state itself, (n, dim) [m/s], a copy, where `self["velocity"]` is what frames show of them; set
        them to change the motion: prescribed components are what they were."""
        return self._run.system.state.read("velocity") * self._run.system.scales.velocity

    @velocity.setter
    def velocity(self, values: np.ndarray) -> None:
        system = self._run.system
        given = np.asarray(values, float)
        wanted = (system.count, self._run.constitutive.space.dim)
        if given.shape != wanted:
            raise ValueError(f"velocities of body {self.name!r} are {wanted}, not {given.shape}")
        if not np.isfinite(given).all():
            raise ValueError(f"velocities of body {self.name!r} are to be finite numbers")
        before = self._run.diagnostics.measure(system.state).kinetic
        system.state.write("velocity", given / system.scales.velocity)
        self._taken(before - self._run.diagnostics.measure(system.state).kinetic)

    def array(self, name: str) -> Array:
        """The Warp array of a field of the state itself, on the device, without a copy: nondimensional, one of its units is
        `scale(name)` in SI. It is what steps read and write: look, and change it only between steps; changes are no part of
        the energy ledger. `wp.to_torch`, `.numpy()` on a CPU and DLPack share its memory."""
        return getattr(self._run.system.state.struct, self._stored(name))

    def scale(self, name: str) -> float:
        """SI units in one unit of `array(name)`."""
        self._stored(name)
        return self._run.reading.fields[name].scale

    def _stored(self, name: str) -> str:
        reading = self._run.reading
        if name not in reading.fields or reading.fields[name].stored != name:
            own = [each for each, field in reading.fields.items() if field.stored == each]
            raise KeyError(f"{name!r} is no array of the state of body {self.name!r}; there is {', '.join(own)}")
        return name

    def __repr__(self) -> str:
        return f"<body {self.name!r}: {self._run.system.count} particles; fields {', '.join(self.fields)}>"


@dataclass(frozen=True)
class State:
    """A run between two steps: the `step` that has ended, its `time` [s], the length `dt` of the next [s], and the bodies by
    name. It is the run itself: it changes with the next step."""

    step: int
    time: float
    dt: float
    bodies: dict[str, BodyState]
    _read: Callable[[], dict[str, float]] = field(repr=False)

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The columns of history.csv at this step [SI]: step, time, energies, momentum, reactions, forces of contacts and
        tools, sections. They are read when they are asked for first."""
        return self._read()

    def __getitem__(self, name: str) -> BodyState:
        if name not in self.bodies:
            raise KeyError(f"no body is named {name!r}; there is {', '.join(self.bodies)}")
        return self.bodies[name]

    def __repr__(self) -> str:
        return f"<step {self.step}, t = {self.time:.6g} s, bodies {', '.join(self.bodies)}>"
