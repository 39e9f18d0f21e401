"""The clock of a run on the device: time, time step and step number, so that a step has no host numbers and can be captured
once and replayed; and the one place that every launch of a step goes through."""

from collections.abc import Callable, Sequence
from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.launch import HostCall, Launch
from wsph.backend.space import Array

T, DT, FIRST_T, FIRST_STEP = range(4)
"""Indices into `Clock.time`: t and dt, and the t and the step number at which dt began."""


@wp.func
def time_of(clock: wp.array(dtype=wp.float64)) -> wp.float64:
    """t at the start of the step, from `Clock.time`."""
    return clock[T]


@wp.func
def dt_of(clock: wp.array(dtype=wp.float64)) -> wp.float64:
    """dt, from `Clock.time`."""
    return clock[DT]


@cache
def _advance() -> wp.Kernel:
    @kernel()
    def advance(step_out: wp.array(dtype=wp.int64), time_out: wp.array(dtype=wp.float64)):
        step = step_out[0] + wp.int64(1)
        step_out[0] = step
        # Multiplied, not added up: a million additions would drift by a million roundings.
        since = wp.float64(step - wp.int64(time_out[FIRST_STEP]))
        time_out[T] = time_out[FIRST_T] + since * time_out[DT]

    return advance


class Clock:
    """Step number and inner time on the device: `step` (1,) int64, and `time` (4,) float64, which kernels take whole and
    read by `time_of` and `dt_of`.

    Every launch of a step goes through `launch`, so what a step is made of can be listed without running it. While it is
    `still` its time stands: steps are those of a relaxation, under what is prescribed at that time.
    """

    still = False
    ahead = 0.0
    """The part of a step by which prescribed values are ahead of a clock that is still."""

    def __init__(self, dt: float, device: str):
        self.device = device
        self._listed: list[Launch | HostCall] | None = None
        self._groups, self._part = 0, (0, 0)
        """Groups so far, and the group and the part of it that launches are of."""
        self.step: Array = wp.zeros(1, dtype=wp.int64, device=device)
        self._none: Array = wp.full(1, -1, dtype=wp.int64, device=device)
        self.time: Array = wp.array([0.0, dt, 0.0, 0.0], dtype=wp.float64, device=device)

    @property
    def dt(self) -> float:
        """The time step of the steps to come."""
        return float(self.time.numpy()[DT])

    @property
    def counted(self) -> Array:
        """The number of the step in progress, (1,) int64: -1 for all steps while it is still, which are none of the run."""
        return self._none if self.still else self.step

    @property
    def listed(self) -> int:
        """Launches in the list that is being made so far, 0 where none is."""
        return sum(isinstance(each, Launch) for each in self._listed or ())

    def shorten(self, factor: float) -> None:
        """Steps from the current one on are shorter by a factor."""
        t, dt, _, _ = self.time.numpy()
        self.time.assign([t, dt * factor, t, float(self.step.numpy()[0])])

    def launch(
        self, kernel: wp.Kernel, n: int, inputs: Sequence[object], outputs: Sequence[object], first: int = 0
    ) -> None:
        """Launch a kernel at once, or put it into the list that is being made. `first`: a ranged one does the n rows from
        there on."""
        launch = Launch(kernel, n, list(inputs), list(outputs), self.device, *self._part, first)
        if self._listed is None:
            launch.run()
        else:
            self._listed.append(launch)

    def apart(self, parts: Sequence[Callable[[], None]]) -> None:
        """Do parts whose launches do not take of each other's: threads that share a step need not wait between them."""
        self._groups += 1
        for number, part in enumerate(parts):
            self._part = (self._groups, number) if len(parts) > 1 else (0, 0)
            part()
        self._part = (0, 0)

    def host(self, call: Callable[[], None]) -> None:
        """Have the host do something between launches, at once or in the list that is being made: what is captured ends
        before it."""
        if self._listed is None:
            call()
        else:
            self._listed.append(HostCall(call))

    def listing(self, step: Callable[[], None]) -> list[Launch | HostCall]:
        """All that `step` does, in order, without doing it."""
        self._listed = found = []
        try:
            step()
        finally:
            self._listed = None
        return found

    def launches(self, step: Callable[[], None]) -> list[Launch]:
        """The launches of `step`, in order, without running them."""
        return [each for each in self.listing(step) if isinstance(each, Launch)]

    def part(self, c: float | tuple[float, float]) -> float | tuple[float, float]:
        """The part of a step, or the two whose mean is meant, of prescribed values: while it is still, its start."""
        return self.ahead if self.still else c

    def advance(self) -> None:
        """t += dt (a launch), unless it is still."""
        if not self.still:
            self.launch(_advance(), 1, [], [self.step, self.time])
