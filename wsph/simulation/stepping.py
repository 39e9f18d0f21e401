"""A run that Python steps: states between its steps, callbacks at events, fields read, written, and without copies.

with wsph.Simulation("bar.toml") as sim:
    for state in sim.every("10 us"):
        print(state.time, state["bar"].velocity[:, 0].max())
sim.result.probes["end"]["stress_xx"]
"""

# pyright: strict
# pyright: reportUnknownMemberType=false

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
import warp as wp

from wsph.backend.space import Array
from wsph.errors import WsphError
from wsph.output import fields, formats
from wsph.output.claim import Claim
from wsph.output.interrupts import Interrupts
from wsph.plugins import integrators
from wsph.quantities import read_cadence
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import BodyRun, integrators_of
from wsph.simulation.result import Result
from wsph.simulation.run import ONE_RUN, Running, prepared
from wsph.simulation.timeline import Events


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

    def __getitem__(self, name: str) -> BodyState:
        if name not in self.bodies:
            raise KeyError(f"no body is named {name!r}; there is {', '.join(self.bodies)}")
        return self.bodies[name]

    def __repr__(self) -> str:
        return f"<step {self.step}, t = {self.time:.6g} s, bodies {', '.join(self.bodies)}>"


Callback = Callable[[State], object]


class Simulation:
    """A run of a scene, or of a scene file, that Python steps. With `out` its folder is written, as by `wsph.run`;
    `overrides` are those of `Scene.with_`.

    Iterating over it gives the state at every block of steps; `every(cadence)` at each multiple of a time ("10 us", or
    seconds) or of a number of steps; `at` has a function called there. It raises Unstable where the run left what it can
    vouch for; `result` is that of the run as far as it has come."""

    def __init__(
        self, scene: Scene | str | Path, out: str | Path | None = None, *, overwrite: bool = False, **overrides: object
    ):
        self.scene = prepared(scene, overrides)
        folder = Path(out) if out is not None else None
        self._claim = Claim(folder, overwrite) if folder is not None else None
        if self._claim is not None:
            self._claim.__enter__()
        started = time.perf_counter()
        try:
            if folder is not None:
                formats.check_installed(self.scene.output.formats)
            with ONE_RUN, np.errstate(over="ignore", invalid="ignore"):
                composition = compose(self.scene)
                composition.compile()
                if self._claim is not None:
                    self._claim.make()
                self._running = Running(composition, folder, started)
        except BaseException:
            self.close()
            raise
        self._timeline = composition.time_step.timeline
        self._interrupts = Interrupts()
        self._events: list[tuple[Events, Callback]] = []
        self._blocks = self._running.blocks(self._interrupts, None, self._due)
        self._changed = False
        self._result: Result | None = None
        self._step = self._advance()

    @property
    def state(self) -> State:
        """The state that the run has come to."""
        bodies = {run.body.name: BodyState(run, self._taken) for run in self._running.composition.bodies}
        return State(self._step, self.time, self._timeline.dt, bodies)

    @property
    def time(self) -> float:
        """The time that the run has come to [s]."""
        return self._timeline.time(self._step)

    @property
    def steps(self) -> int:
        """Steps done so far."""
        return self._step

    @property
    def steps_total(self) -> int:
        """Steps of the whole run, from the start to the end, at the present time step."""
        return self._timeline.last

    @property
    def done(self) -> bool:
        """Whether it has come to its end."""
        return self._step >= self._timeline.last or self._result is not None

    def __iter__(self) -> Iterator[State]:
        """The states between blocks of steps, as the program makes them, from the present one to the end."""
        yield self.state
        while self._go_on():
            yield self.state

    def every(self, cadence: str | float | int) -> Iterator[State]:
        """The state now, and at every multiple of a cadence to the end: an int counts steps, a float is seconds, a string
        has its unit."""
        events = self._make(cadence)
        yield self.state
        while not self.done:
            if not self._go_on_to(events):
                return
            yield self.state

    def at(self, cadence: str | float | int, call: Callback) -> None:
        """Have `call(state)` called at every multiple of a cadence from now on."""
        self._events.append((self._make(cadence), call))

    def step(self, count: int = 1) -> State:
        """Run `count` steps, fewer where the end comes before; the state there."""
        goal = min(self._step + count, self._timeline.last)
        self._goals = [goal]
        try:
            while self._step < goal and self._go_on():
                pass
        finally:
            self._goals = []
        return self.state

    def run(self) -> Result:
        """Run to the end; the result."""
        while self._go_on():
            pass
        return self.result

    @property
    def result(self) -> Result:
        """The result as far as the run has come: it ends there, and that state is the last of its records."""
        if self._result is None:
            with ONE_RUN:
                if self._running.failure is None and (self._changed or not self.done):
                    self._begin_anew()
                    self._running.record()
                self._result = self._running.end(self._interrupts)
            self.close()
        return self._result

    def close(self) -> None:
        """Let go of the folder."""
        if self._claim is not None:
            self._claim.__exit__(None, None, None)
            self._claim = None

    def __enter__(self) -> "Simulation":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or not issubclass(kind, WsphError):
            _ = self.result
        self.close()

    def __repr__(self) -> str:
        said = f"step {self._step} of {self._timeline.last}, t = {self.time:.6g} s"
        return f"<simulation {self.scene.title or ', '.join(b.name for b in self.scene.bodies)}: {said}>"

    _goals: Sequence[int] = ()

    def _make(self, cadence: str | float | int) -> Events:
        events = Events(read_cadence(cadence), self._timeline)
        events.skip(self._step)
        return events

    def _due(self) -> Sequence[int]:
        return [*self._goals, *(events.next for events, _ in self._events)]

    def _go_on_to(self, events: Events) -> bool:
        """Run to the next of some events; False where the run ended before."""
        events.retimed()
        try:
            while self._step < events.next:
                self._goals = [events.next]
                if not self._go_on():
                    return False
                events.retimed()
        finally:
            self._goals = []
        events.advance()
        return True

    def _go_on(self) -> bool:
        """Run a block of steps, and what is due at its end; False where there is none left. Raises Unstable."""
        if self._result is not None:
            raise WsphError("this simulation has ended: its result was taken; make another")
        before, self._step = self._step, self._advance()
        for events, call in self._events:
            events.retimed()
            if events.next <= self._step > before:
                call(self.state)
                events.skip(self._step)
        return self._step > before

    def _advance(self) -> int:
        with ONE_RUN, np.errstate(over="ignore", invalid="ignore"), warnings.catch_warnings():
            self._begin_anew()
            step = next(self._blocks, None)
            wp.synchronize_device(self._running.composition.device)
        if (failure := self._running.failure) is not None:
            raise failure
        return step if step is not None else self._step

    def _begin_anew(self) -> None:
        """Have integrators make what they keep from a state that was changed."""
        if self._changed:
            self._changed = False
            for each in integrators_of(self._running.composition.bodies):
                integrators.begin(each)

    def _taken(self, energy: float) -> None:
        """Note that a change from outside has taken energy, nondimensional."""
        self._running.ledger.taken += energy
        self._changed = True
