"""The clock of a run on the device: time, time step and step number, so that a step has no host numbers and can be captured
once and replayed; and the one place that every launch of a step goes through."""

import time
from collections.abc import Callable
from functools import cache
from typing import Any

import warp as wp


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
        self._take: Callable[..., None] = self.launch_part
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
        """Launch `kernel` over `n` threads. A kernel whose first argument is `first`, which is not among the inputs, can be
        launched in ranges that begin there."""
        self._take(kernel, n, inputs, outputs)

    def launch_part(self, kernel: wp.Kernel, n: int, inputs: list[Any], outputs: list[Any], part: int = 0, parts: int = 1) -> None:  # fmt: skip
        """Part `part` of `parts` of a launch, at once; a kernel that takes no ranges has one."""
        low, high = n * part // parts, n * (part + 1) // parts
        if takes_ranges(kernel):
            inputs = [low, *inputs]
        wp.launch(kernel, high - low, inputs=inputs, outputs=outputs, device=self.device)

    def taken(self, step: Callable[[], None], take: Callable[..., None]) -> None:
        """`step`, whose launches go to `take`, with what `launch` is given."""
        self._take = take
        try:
            step()
        finally:
            self._take = self.launch_part

    def timed(self, step: Callable[[], None]) -> list[float]:
        """Run `step` and time its launches [s], in order."""
        seconds: list[float] = []

        def take(*launch: Any) -> None:
            started = time.perf_counter()
            self.launch_part(*launch)
            seconds.append(time.perf_counter() - started)

        self.taken(step, take)
        return seconds

    def list_launches(self, step: Callable[[], None]) -> list[wp.Kernel]:
        """The kernels that `step` would launch, in order."""
        kernels: list[wp.Kernel] = []
        self.taken(step, lambda kernel, *_: kernels.append(kernel))
        return kernels

    def advance(self) -> None:
        """t += dt (a launch)."""
        self.launch(_advance(), 1, [], [self.step, self.time])


def takes_ranges(kernel: wp.Kernel) -> bool:
    """Whether a launch of it can be in parts."""
    return kernel.adj.args[0].label == "first"
