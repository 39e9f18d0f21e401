"""Steps as programs: the clock on the device, and a fixed list of launches run many times.

Time, time step and step number live in a device clock, so a step has no host numbers and can be recorded once and
replayed. Small scenes on the CPU and all on CUDA replay a captured graph (.2 us a launch). Larger ones on the CPU replay
recorded launches; those that were found to take long are split over index ranges, one a core. Every row of a range is
computed as it is in one piece: results are the same bits for any number of threads.
"""

import contextlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise
from queue import SimpleQueue
from typing import Any

import warp as wp

GRAPH_PAIRS = 200_000
"""Above this many pairs a launch takes long enough that a captured graph saves nothing on the CPU, and cores can share
it."""

BLOCKS = (256, 32, 4, 1)
"""Steps in one captured graph: any number of steps is a few replays of these."""

SPLIT_SECONDS = 2e-4
"""A launch shorter than this stays in one piece: handing it over costs 10 to 90 us."""


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
        self._take: Callable[..., None] = self._run
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

    def _run(self, kernel: wp.Kernel, n: int, inputs: list[Any], outputs: list[Any]) -> None:
        wp.launch(kernel, n, inputs=_ranged(kernel, 0, inputs), outputs=outputs, device=self.device)

    def _taken(self, step: Callable[[], None], take: Callable[..., None]) -> None:
        """`step`, whose launches go to `take`."""
        self._take = take
        try:
            step()
        finally:
            self._take = self._run

    def timed(self, step: Callable[[], None]) -> list[float]:
        """Run `step` and time its launches [s], in order."""
        seconds: list[float] = []

        def take(*launch: Any) -> None:
            started = time.perf_counter()
            self._run(*launch)
            seconds.append(time.perf_counter() - started)

        self._taken(step, take)
        return seconds

    def recorded(self, step: Callable[[], None], pieces: list[int]) -> list[list[Any]]:
        """The launches of `step`, not run, each in so many pieces as `pieces` says where its kernel takes ranges."""
        commands: list[list[Any]] = []

        def take(kernel: wp.Kernel, n: int, inputs: list[Any], outputs: list[Any]) -> None:
            count = pieces[len(commands)] if _takes_ranges(kernel) else 1
            commands.append([
                wp.launch(kernel, high - low, inputs=_ranged(kernel, low, inputs), outputs=outputs, device=self.device,
                          record_cmd=True)
                for low, high in pairwise(n * k // count for k in range(count + 1))
            ])  # fmt: skip

        self._taken(step, take)
        return commands

    def list_launches(self, step: Callable[[], None]) -> list[wp.Kernel]:
        """The kernels that `step` would launch, in order."""
        kernels: list[wp.Kernel] = []
        self._taken(step, lambda kernel, *_: kernels.append(kernel))
        return kernels

    def advance(self) -> None:
        """t += dt (a launch)."""
        self.launch(_advance(), 1, [], [self.step, self.time])


def _takes_ranges(kernel: wp.Kernel) -> bool:
    return kernel.adj.args[0].label == "first"


def _ranged(kernel: wp.Kernel, first: int, inputs: list[Any]) -> list[Any]:
    """The inputs of a kernel whose range begins at `first`."""
    return [first, *inputs] if _takes_ranges(kernel) else inputs


def cores() -> list[int]:
    """The cores that this process may use."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


class Crew:
    """Threads that each take a piece of a launch, every one on a core of its own: unpinned they sometimes share one."""

    def __init__(self, threads: int):
        self._cores = cores()
        self._jobs: list[SimpleQueue[Any]] = [SimpleQueue() for _ in range(threads - 1)]
        self._done: SimpleQueue[BaseException | None] = SimpleQueue()
        for number, jobs in enumerate(self._jobs, 1):
            threading.Thread(target=self._work, args=(number, jobs), daemon=True).start()

    def _pin(self, number: int) -> None:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(threading.get_native_id(), {self._cores[number % len(self._cores)]})

    def _work(self, number: int, jobs: "SimpleQueue[Any]") -> None:
        self._pin(number)
        while (job := jobs.get()) is not None:
            try:
                job.launch()
                self._done.put(None)
            except BaseException as error:
                self._done.put(error)

    @contextlib.contextmanager
    def at_work(self) -> Iterator[None]:
        """The caller on a core of its own too, as long as it takes part."""
        self._pin(0)
        try:
            yield
        finally:
            if hasattr(os, "sched_setaffinity"):
                os.sched_setaffinity(threading.get_native_id(), self._cores)

    def run(self, pieces: list[Any]) -> None:
        """Run the pieces of a launch side by side."""
        for jobs, piece in zip(self._jobs, pieces[1:], strict=False):
            jobs.put(piece)
        pieces[0].launch()
        failed = [error for error in (self._done.get() for _ in pieces[1:]) if error is not None]
        if failed:
            raise failed[0]

    def dismiss(self) -> None:
        """End the threads."""
        for jobs in self._jobs:
            jobs.put(None)


class Program:
    """A step as a list of launches. `run(n)` runs it n times."""

    def __init__(
        self,
        step: Callable[[], None],
        clock: Clock,
        pairs: int,
        threads: int = 0,
        before: Callable[[], bool] | None = None,
    ):
        """`pairs` measures the work of a step; `threads` 0 means all cores; `before`, run on the host before every step,
        says whether it changed what the step's launches take."""
        self.step, self._clock, self._before, self._device = step, clock, before, clock.device
        self._graphs: dict[int, wp.Graph] = {}
        on_cuda = wp.get_device(self._device).is_cuda
        self.captured = pairs <= GRAPH_PAIRS or on_cuda
        self.followed = before is not None
        self.threads = 1 if on_cuda or pairs <= GRAPH_PAIRS else threads or len(cores())
        self._pieces: list[int] | None = None
        self._commands: list[list[Any]] | None = None
        self._crew: Crew | None = None

    def __del__(self) -> None:
        crew = getattr(self, "_crew", None)
        if crew is not None:
            crew.dismiss()

    def prepare(self, steps: int) -> None:
        """Capture what `run(steps)` replays: about 1 ms per captured step, once."""
        if self.captured and self._before is None:
            for block in BLOCKS:
                if steps >= block:
                    self._graph(block)
                    steps %= block

    def run(self, steps: int, stop: Callable[[], bool] = lambda: False) -> int:
        """Run `steps` steps, fewer where `stop()` asks for it between launches of the program; returns how many."""
        if self.captured and self._before is not None:
            return self._followed(steps, stop)
        if self.captured:
            done = 0
            for block in BLOCKS:
                while steps - done >= block and not stop():
                    wp.capture_launch(self._graph(block))
                    done += block
            return done
        if self._crew is None and self.threads > 1:
            self._crew = Crew(self.threads)
        with self._crew.at_work() if self._crew is not None else contextlib.nullcontext():
            for done in range(steps):
                if stop():
                    return done
                self._advance()
        return steps

    def _followed(self, steps: int, stop: Callable[[], bool]) -> int:
        """Single captured steps, captured anew where what the host does before one has changed its launches."""
        for done in range(steps):
            if stop():
                return done
            if self._before is not None and self._before():
                self._graphs.clear()
            wp.capture_launch(self._graph(1))
        return steps

    def _advance(self) -> None:
        """One step: timed the first time, recorded the second, replayed from then on."""
        if self._before is not None and self._before():
            self._commands = None
        if self._pieces is None:
            seconds = self._clock.timed(self.step)
            self._pieces = [self.threads if s > SPLIT_SECONDS else 1 for s in seconds]
            return
        if self._commands is None:
            self._commands = self._clock.recorded(self.step, self._pieces)
        for pieces in self._commands:
            if len(pieces) > 1 and self._crew is not None:
                self._crew.run(pieces)
            else:
                pieces[0].launch()

    def compile(self, kernels: list[wp.Kernel]) -> None:
        """Compile and load the kernels that are not loaded yet.

        One after the other: each compiling thread would first spend 2 s on a precompiled header of its own.
        """
        modules = list(dict.fromkeys(kernel.module for kernel in kernels))
        if modules:
            wp.force_load(self._device, modules=modules, max_workers=0)

    def _graph(self, block: int) -> wp.Graph:
        if block not in self._graphs:
            with wp.ScopedCapture(device=self._device, force_module_load=False) as capture:
                for _ in range(block):
                    self.step()
            self._graphs[block] = capture.graph
        return self._graphs[block]
