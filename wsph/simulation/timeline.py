"""Times and lengths of the steps of a run, and the steps at which something is due."""

# pyright: strict
# pyright: reportUnknownMemberType=false

import math
from collections.abc import Sequence

import numpy as np

from wsph.backend.clock import Clock
from wsph.errors import Refused

MOST_STEPS = 1e12


class Timeline:
    """Times of steps [s]: pieces of constant time step, each (first step, its time, dt), that end at `end`."""

    def __init__(self, end: float, dt: float, pieces: list[tuple[int, float, float]] | None = None):
        self.end = end
        self.pieces = [(int(step), float(t), float(dt)) for step, t, dt in pieces or [(0, 0.0, dt)]]

    @property
    def dt(self) -> float:
        """The time step of the steps to come [s]."""
        return self.pieces[-1][2]

    @property
    def last(self) -> int:
        """The step of the first state at or after the end. Raises Refused beyond what can be counted."""
        steps = (self.end - self.pieces[-1][1]) / self.dt
        if not steps < MOST_STEPS:
            raise Refused(
                f"{self.end:g} s in steps of {self.dt:g} s are {steps:.3g} steps; at most {MOST_STEPS:.0e} can be run"
            )
        return self.at_or_after(self.end, 1)

    def time(self, step: int) -> float:
        """Time of a step [s]."""
        first, t, dt = next(piece for piece in reversed(self.pieces) if piece[0] <= step)
        return t + (step - first) * dt

    def times(self, steps: Sequence[int]) -> np.ndarray:
        """Times of many steps [s]."""
        first, t, dt = np.array(self.pieces).T
        piece = np.searchsorted(first, steps, side="right") - 1
        return t[piece] + (np.asarray(steps) - first[piece]) * dt[piece]

    def at_or_after(self, t: float, least: int = 0) -> int:
        """The first step of the last piece at or after a time, 1e-9 of a step early being in time; not below `least`."""
        first, begin, dt = self.pieces[-1]
        return max(first + math.ceil(min((t - begin) / dt, 2.0 * MOST_STEPS) - 1e-9), least)

    def shorten(self, step: int, dt: float) -> None:
        """From `step` on every step takes `dt`."""
        self.pieces.append((int(step), float(self.time(step)), float(dt)))


class UnsetClock(Clock):
    """A clock whose time step is still to be chosen. Launches go through it; asking for the step raises Refused."""

    def __init__(self, device: str, refusal: str):
        super().__init__(1.0, device)
        self._refusal = refusal

    @property
    def dt(self) -> float:
        """The time step of the steps to come. Raises Refused while there is none."""
        if self._refusal:
            raise Refused(self._refusal)
        return super().dt

    def choose(self, dt: float) -> None:
        """Set the step, nondimensional."""
        self.time.assign([0.0, dt, 0.0, 0.0])
        self._refusal = ""


class TimeStep:
    """The time step of a run, its one owner: on the host a timeline [s], on the device a clock in the run's own unit.

    What follows from it, such as a body's Courant number, is computed from it whenever it is asked for.
    """

    def __init__(self, clock: Clock, timeline: Timeline):
        self.clock, self.timeline = clock, timeline

    @property
    def dt(self) -> float:
        """The time step of the steps to come [s]."""
        return self.timeline.dt

    @property
    def first(self) -> float:
        """The time step that the run began with [s]."""
        return self.timeline.pieces[0][2]

    def shorten(self, step: int, factor: float) -> None:
        """From `step`, the current one, on steps are shorter by a factor."""
        self.clock.shorten(factor)
        self.timeline.shorten(step, self.dt * factor)

    def restore(self, pieces: Sequence[Sequence[float]]) -> None:
        """Put back the timeline of a checkpoint, whose arrays hold the clock."""
        self.timeline.pieces[:] = [(int(step), float(t), float(dt)) for step, t, dt in pieces]


class Events:
    """Steps at which something is due: the first state at or after each multiple of the cadence, and the last one."""

    def __init__(self, cadence: float | int | None, timeline: Timeline):
        self._cadence, self._timeline = cadence, timeline
        self.next = self._done = 0

    def advance(self) -> None:
        """Move on to the next due step."""
        self._done, self.next = self.next, self._after(self.next)

    def retimed(self) -> None:
        """Recompute the next due step: the timeline has changed."""
        if self.next > self._done:
            self.next = self._after(self._done)

    def _after(self, step: int) -> int:
        last, cadence, line = self._timeline.last, self._cadence, self._timeline
        if step >= last:
            return last + 1
        if cadence is None:
            return last
        if isinstance(cadence, int):
            return min((step // cadence + 1) * cadence, last)
        if cadence <= line.dt:
            return step + 1
        number = math.floor((line.time(step) + 1e-9 * line.dt) / cadence) + 1
        return min(max(line.at_or_after(number * cadence), step + 1), last)

    def skip(self, step: int) -> None:
        """Everything that was due up to `step` has been done."""
        while self.next <= step:
            self.advance()
