"""Steps as programs: the clock on the device, and a fixed list of launches run many times.

Time, time step and step number live in a device clock, so a step has no host numbers and can be captured once and
replayed. Small scenes on the CPU and all on CUDA replay a captured graph (.2 us a launch); larger ones launch directly,
where a launch is negligible beside its work.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import warp as wp

GRAPH_PARTICLES = 20_000
"""Above this many particles a launch takes long enough that a captured graph saves nothing on the CPU."""

BLOCKS = (256, 32, 4, 1)
"""Steps in one captured graph: any number of steps is a few replays of these."""


@cache
def _advance() -> wp.Kernel:
    @wp.kernel(module="unique", enable_backward=False)
    def advance(step_out: wp.array(dtype=wp.int64), time_out: wp.array(dtype=wp.float64)):
        step = step_out[0] + wp.int64(1)
        step_out[0] = step
        # Multiplied, not added up: a million additions would drift by a million roundings.
        time_out[0] = wp.float64(step) * time_out[1]

    return advance


class Clock:
    """Step number and inner time on the device: `step` (1,) int64, `time` (2,) float64: t and dt.

    Every launch of a step goes through `launch`, so what a step is made of can be listed without running it.
    """

    def __init__(self, dt: float, device: str):
        self.dt, self.device = dt, device
        self._listed: list[wp.Kernel] | None = None
        self.step = wp.zeros(1, dtype=wp.int64, device=device)
        self.time = wp.array([0.0, dt], dtype=wp.float64, device=device)

    def launch(self, kernel: wp.Kernel, n: int, inputs: list[Any], outputs: list[Any]) -> None:
        """Launch `kernel` over `n` threads."""
        if self._listed is not None:
            self._listed.append(kernel)
            return
        wp.launch(kernel, n, inputs=inputs, outputs=outputs, device=self.device)

    def list_launches(self, step: Callable[[], None]) -> list[wp.Kernel]:
        """The kernels that `step` would launch, in order."""
        self._listed = []
        try:
            step()
            return self._listed
        finally:
            self._listed = None

    def advance(self) -> None:
        """t += dt (a launch)."""
        self.launch(_advance(), 1, [], [self.step, self.time])


class Program:
    """A step as a list of launches. `run(n)` runs it n times."""

    def __init__(self, step: Callable[[], None], particles: int, device: str, hosted: bool = False):
        """`hosted`: the step does something on the host, so it cannot be captured."""
        self.step, self._device = step, device
        self._graphs: dict[int, wp.Graph] = {}
        self.captured = not hosted and (particles <= GRAPH_PARTICLES or wp.get_device(device).is_cuda)

    def prepare(self, steps: int) -> None:
        """Capture what `run(steps)` replays: about 1 ms per captured step, once."""
        if self.captured:
            for block in BLOCKS:
                if steps >= block:
                    self._graph(block)
                    steps %= block

    def run(self, steps: int, stop: Callable[[], bool] = lambda: False) -> int:
        """Run `steps` steps, fewer where `stop()` asks for it between launches of the program; returns how many."""
        done = 0
        for block in BLOCKS if self.captured else (1,):
            while steps - done >= block and not stop():
                if self.captured:
                    wp.capture_launch(self._graph(block))
                else:
                    self.step()
                done += block
        return done

    def compile(self, kernels: list[wp.Kernel]) -> None:
        """Compile and load the kernels that are not loaded yet.

        One after the other: each compiling thread would first spend 2 s on a precompiled header of its own.
        """
        wp.force_load(self._device, modules=list(dict.fromkeys(kernel.module for kernel in kernels)), max_workers=0)

    def _graph(self, block: int) -> wp.Graph:
        if block not in self._graphs:
            with wp.ScopedCapture(device=self._device, force_module_load=False) as capture:
                for _ in range(block):
                    self.step()
            self._graphs[block] = capture.graph
        return self._graphs[block]
