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
from functools import cache
from pathlib import Path
from types import TracebackType

import numpy as np
import warp as wp

from wsph.errors import Unstable, WsphError
from wsph.output import formats
from wsph.output.claim import Claim
from wsph.output.interrupts import Interrupts
from wsph.plugins import integrators
from wsph.quantities import read_cadence
from wsph.scene.load import prepared
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import integrators_of
from wsph.simulation.result import Result
from wsph.simulation.run import ONE_RUN, Running
from wsph.simulation.stepping.conditions import Condition, condition
from wsph.simulation.stepping.state import BodyState, State
from wsph.simulation.timeline import Events

Callback = Callable[[State], object]


@dataclass(eq=False)
class Watch:
    """What is looked at between steps: `call` is called at the `events`, where there is a `condition` at those at which it
    has become true. Without events it is looked at after every block of steps."""

    call: Callback
    events: Events | None = None
    condition: Condition | None = None
    held: bool = False

    def look(self, step: int, state: Callable[[], State]) -> None:
        """Do what is due at a step."""
        if self.events is not None:
            self.events.retimed()
            if self.events.next > step:
                return
            self.events.skip(step)
        if self.condition is not None:
            held, self.held = self.held, bool(self.condition(state()))
            if held or not self.held:
                return
        self.call(state())


class Simulation:
    """A run of a scene, or of a scene file, that Python steps. With `out` its folder is written, as by `wsph.run`;
    `overrides` are those of `Scene.with_`.

    Iterating over it gives the state at every block of steps; `every(cadence)` at each multiple of a time ("10 us", or
    seconds) or of a number of steps; `at` has a function called there, `when` has it called at an event. It raises Unstable
    where the run left what it can vouch for; `result` is that of the run as far as it has come."""

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
        self._watches: list[Watch] = []
        self._last: dict[str, list[Watch]] = {"end": [], "error": []}
        self._stopped = False
        self._blocks = self._running.blocks(self._interrupts, None, self._due)
        self._changed = False
        self._result: Result | None = None
        self._step = self._advance()

    @property
    def state(self) -> State:
        """The state that the run has come to."""
        bodies = {run.body.name: BodyState(run, self._taken) for run in self._running.composition.bodies}
        return State(self._step, self.time, self._timeline.dt, bodies, self._running.numbers)

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
        return self._stopped or self._step >= self._timeline.last or self._result is not None

    @property
    def failure(self) -> Unstable | None:
        """What the run left that it can vouch for, where it did."""
        return self._running.failure

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

    def at(self, cadence: str | float | int, call: Callback) -> Callable[[], None]:
        """Have `call(state)` called at every multiple of a cadence from now on; what is returned ends that when called."""
        return _in(self._watches, Watch(call, self._make(cadence)))

    def when(
        self, event: str | Condition, call: Callback, *, every: str | float | int | None = None
    ) -> Callable[[], None]:
        """Have `call(state)` called whenever a condition has become true; what is returned ends that when called.

        `event` is a function of the state, or words: "BODY.FIELD > VALUE", "PROBE.COLUMN < VALUE" or a column of
        history.csv, with a unit; "contact" or "contact NAME"; "crack" or "crack BODY"; "end", when the run has come to its
        end; "error", before Unstable is raised. It is looked at after every block of steps, 100 or fewer, or at each
        multiple of a cadence, as of `every`; 1 is every step. Raises WsphError for words that name nothing in the run."""
        if isinstance(event, str) and event in self._last:
            return _in(self._last[event], Watch(call))
        said = condition(event, self._running, self.state)
        return _in(self._watches, Watch(call, None if every is None else self._make(every), said))

    def stop(self) -> None:
        """End the run at the step that it has come to: a call from a callback is the last of it."""
        self._stopped = True

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
                if self._running.failure is None and (self._changed or self._step < self._timeline.last):
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
        return [*self._goals, *(each.events.next for each in self._watches if each.events is not None)]

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
        if self._stopped:
            return False
        before, self._step = self._step, self._advance()
        if self._step == before:
            return False
        # Those of a list that callbacks may change.
        ending = self._last["end"] if self._step >= self._timeline.last else []
        now = cache(lambda: self.state)
        for each in [*self._watches, *ending]:
            each.look(self._step, now)
        return True

    def _advance(self) -> int:
        with ONE_RUN, np.errstate(over="ignore", invalid="ignore"), warnings.catch_warnings():
            self._begin_anew()
            step = next(self._blocks, None)
            wp.synchronize_device(self._running.composition.device)
        if (failure := self._running.failure) is not None:
            self._step = failure.step
            for each in list(self._last["error"]):
                each.call(self.state)
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


def _in(watches: list[Watch], watch: Watch) -> Callable[[], None]:
    """Put a watch in a list; what takes it out again."""
    watches.append(watch)

    def out() -> None:
        if watch in watches:
            watches.remove(watch)

    return out
