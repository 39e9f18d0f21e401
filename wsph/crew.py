"""Threads that share the launches of a step on the CPU.

Every thread has a core and a captured graph of its own: its range of each launch that is shared, the first thread also the
launches that are not. Between launches they meet, and wait for each other awake: on a shared machine a core that goes to
sleep between two launches is back late, by a tenth of a step of a hundred thousand particles. Who has waited a few
microseconds offers its core to others between looks.

Every row of a range is computed as it is in one piece: results are the same bits for any number of threads.
"""

import contextlib
import ctypes
import os
import threading
from collections.abc import Callable, Iterator
from functools import cache
from queue import SimpleQueue
from typing import Any

import warp as wp

from wsph.clock import Clock, takes_ranges

LINE = 16
"""Counters stand so many int64 apart, so that no two of them share a cache line."""
LOOKS = 2000
"""So often, a few microseconds long, who waits looks without offering its core."""
GONE = 1 << 62
"""The count of a thread that nobody is to wait for any more."""


def cores() -> list[int]:
    """The cores that this process may use."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


@cache
def meeting() -> wp.Kernel:
    """The kernel by which thread `me` of `threads` waits until all have come as often as it has."""

    @wp.func_native(f"""
        const int64_t times = met.data[me * {LINE}] + 1;
        __atomic_store_n(&met.data[me * {LINE}], times, __ATOMIC_RELEASE);
        for (int32_t other = 0; other < threads; ++other)
            for (int32_t looks = 0; __atomic_load_n(&met.data[other * {LINE}], __ATOMIC_ACQUIRE) < times;)
                if (++looks > {LOOKS} && give_way) {{ looks = {LOOKS}; ((void (*)())give_way)(); }}
    """)
    def come(met: wp.array(dtype=wp.int64), me: int, threads: int, give_way: wp.uint64): ...

    @wp.kernel(module="unique", enable_backward=False)
    def meet(me: int, threads: int, give_way: wp.uint64, met: wp.array(dtype=wp.int64)):
        come(met, me, threads, give_way)

    return meet


def _give_way() -> int:
    """Address of what offers the caller's core to others; 0 where there is none, and who waits keeps its core."""
    function = getattr(ctypes.CDLL(None), "sched_yield", None) if os.name == "posix" else None
    return ctypes.cast(function, ctypes.c_void_p).value or 0 if function is not None else 0


class Crew:
    """The caller and `threads` - 1 more."""

    def __init__(self, threads: int):
        self.threads = threads
        self._cores = cores()
        self._met = wp.zeros(threads * LINE, dtype=wp.int64, device="cpu")
        self._address = wp.uint64(_give_way())
        self._jobs: list[SimpleQueue[Any]] = [SimpleQueue() for _ in range(threads - 1)]
        self._failed: list[BaseException] = []
        for number, jobs in enumerate(self._jobs, 1):
            threading.Thread(target=self._work, args=(number, jobs), daemon=True).start()

    def graphs(self, step: Callable[[], None], clock: Clock, shared: list[bool]) -> list[wp.Graph]:
        """A captured graph of `step` for each thread; `shared` says of every launch, in order, whether it is worth it. The
        kernels are loaded."""
        found = []
        for me in range(self.threads):
            with wp.ScopedCapture(device="cpu", force_module_load=False) as capture:
                self._capture(step, clock, shared, me)
            found.append(capture.graph)
        return found

    def _capture(self, step: Callable[[], None], clock: Clock, shared: list[bool], me: int) -> None:
        worth = iter(shared)
        apart = False  # whether others than the first thread may be at a launch

        def take(kernel: wp.Kernel, *launch: Any) -> None:
            nonlocal apart
            share = next(worth) and takes_ranges(kernel)
            if share or apart:
                self._meet(me)
            if share:
                clock.launch_part(kernel, *launch, part=me, parts=self.threads)
            elif me == 0:
                clock.launch_part(kernel, *launch)
            apart = share

        clock.taken(step, take)
        self._meet(me)

    def _meet(self, me: int) -> None:
        wp.launch(meeting(), 1, inputs=[me, self.threads, self._address, self._met], device="cpu")

    def _pin(self, number: int) -> None:
        """Unpinned, two threads sometimes share a core."""
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(threading.get_native_id(), {self._cores[number % len(self._cores)]})

    def _work(self, number: int, jobs: "SimpleQueue[Any]") -> None:
        self._pin(number)
        while (job := jobs.get()) is not None:
            try:
                self._replay(number, *job)
            except BaseException as error:
                self._failed.append(error)
                self._leave(number)

    def _replay(self, number: int, graphs: list[wp.Graph], times: int) -> None:
        for _ in range(times):
            wp.capture_launch(graphs[number])

    def _leave(self, number: int) -> None:
        self._met.numpy()[number * LINE] = GONE

    @contextlib.contextmanager
    def at_work(self) -> Iterator[None]:
        """The caller on a core of its own too, as long as it takes part."""
        self._pin(0)
        try:
            yield
        finally:
            if hasattr(os, "sched_setaffinity"):
                os.sched_setaffinity(threading.get_native_id(), self._cores)

    def run(self, graphs: list[wp.Graph], times: int) -> None:
        """Replay the threads' graphs so often. After a fault in any thread the crew is of no more use."""
        for jobs in self._jobs:
            jobs.put((graphs, times))
        try:
            self._replay(0, graphs, times)
        except BaseException:
            self._leave(0)
            raise
        if self._failed:
            raise self._failed[0]

    def dismiss(self) -> None:
        """End the threads."""
        for jobs in self._jobs:
            jobs.put(None)
