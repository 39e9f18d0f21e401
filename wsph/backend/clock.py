"""The clock of a run on the device: time, time step and step number, so that a step has no host numbers and can be captured
once and replayed; and the one place that every launch of a step goes through."""

from collections.abc import Callable
from functools import cache
from typing import Any

import warp as wp

from wsph.backend.launch import Launch


@cache
def _advance() -> wp.Kernel:
    @wp.kernel(module="unique", enable_backward=False)
    def advance(step_out: wp.array(dtype=wp.int64), time_out: wp.array(dtype=wp.float64)):
        step = step_out[0] + wp.int64(1)
        step_out[0] = step
        # Multiplied, not added up: a million additions would drift by a million roundings.
        time_out[0] = time_out[2] + wp.float64(step - wp.int64(time_out[3])) * time_out[1]

    return advance


class Clock:
    """Step number and inner time on the device: `step` (1,) int64, `time` (4,) float64: t and dt, and t and the step at
    which dt began.

    Every launch of a step goes through `launch`, so what a step is made of can be listed without running it.
    """

    def __init__(self, dt: float, device: str):
        self.device = device
        self._listed: list[Launch] | None = None
        self.step = wp.zeros(1, dtype=wp.int64, device=device)
        self.time = wp.array([0.0, dt, 0.0, 0.0], dtype=wp.float64, device=device)

    @property
    def dt(self) -> float:
        """The time step of the steps to come."""
        return float(self.time.numpy()[1])

    def shorten(self, factor: float) -> None:
        """Steps from the current one on are shorter by a factor."""
        t, dt, _, _ = self.time.numpy()
        self.time.assign([t, dt * factor, t, float(self.step.numpy()[0])])

    def launch(self, kernel: wp.Kernel, n: int, inputs: list[Any], outputs: list[Any]) -> None:
        """A `Launch`, at once, or into the list that is being made."""
        launch = Launch(kernel, n, list(inputs), list(outputs), self.device)
        if self._listed is None:
            launch.run()
        else:
            self._listed.append(launch)

    def launches(self, step: Callable[[], None]) -> list[Launch]:
        """What `step` would launch, in order."""
        self._listed = found = []
        try:
            step()
        finally:
            self._listed = None
        return found

    def advance(self) -> None:
        """t += dt (a launch)."""
        self.launch(_advance(), 1, [], [self.step, self.time])
