"""Threads that share the launches of a step on the CPU.

A step is, for every thread, a list of stretches. Launches of a few microseconds to a millisecond stand in captured graphs,
one a thread: its range of each, the first thread also the launches that are not shared. A launch that takes longer is cut
into pieces that the threads take one after the other, so that cores of unequal speed, or ranges of unequal work, end
together. After every shared launch the threads meet, and wait for each other awake: on a shared machine a core that goes to
sleep between two launches is back late, by a tenth of a step of a hundred thousand particles. Who has waited a few
microseconds offers its core to others between looks.

Every row is computed as it is in one piece: results are the same bits for any number of threads.
"""

import contextlib
import ctypes
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from queue import SimpleQueue
from typing import Any

import warp as wp

from wsph.clock import Launch

ALONE_SECONDS = 2e-5
"""A launch shorter than this is the first thread's alone: a meeting takes a microsecond, and one cache has the data."""
PIECE_SECONDS = 2.5e-4
"""About so long takes a piece of a launch that is cut: taking one costs some microseconds."""
MOST_PIECES = 8
"""More a thread make ends no more even."""

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


@dataclass(frozen=True)
class Stretch:
    """What the threads do between two points of a step: a graph each, or the pieces of one launch, whoever is free."""

    graphs: list[wp.Graph]
    pieces: list[Any]


class Crew:
    """The caller and `threads` - 1 more."""

    def __init__(self, threads: int):
        self.threads = threads
        self._cores = cores()
        self._met = wp.zeros(threads * LINE, dtype=wp.int64, device="cpu")
        self._address = wp.uint64(_give_way())
        self._meetings = [self._meet(number, record=True) for number in range(threads)]
        self._jobs: list[SimpleQueue[Any]] = [SimpleQueue() for _ in range(threads - 1)]
        self._failed: list[BaseException] = []
        self._threads = [
            threading.Thread(target=self._work, args=each, daemon=True) for each in enumerate(self._jobs, 1)
        ]
        for thread in self._threads:
            thread.start()

    def pieces(self, launch: Launch, seconds: float) -> int:
        """Into how many pieces a launch of `seconds` [s] goes: 1 that of the first thread alone, one a thread, or more."""
        if not launch.divisible or seconds <= ALONE_SECONDS:
            return 1
        return max(min(int(seconds / PIECE_SECONDS), MOST_PIECES * self.threads, launch.n), self.threads)

    def stretches(self, launches: list[Launch], pieces: list[int]) -> list[Stretch]:
        """What the threads do with the launches of a step, in so many pieces. Kernels are loaded."""
        found = []
        for cut, group in groupby(zip(launches, pieces, strict=True), lambda each: each[1] > self.threads):
            if cut:
                found += [
                    Stretch([], [launch.run(k, parts, record=True) for k in range(parts)]) for launch, parts in group
                ]
            else:
                planned = list(group)
                found.append(Stretch([self._captured(planned, number) for number in range(self.threads)], []))
        return found

    def _captured(self, planned: list[tuple[Launch, int]], number: int) -> wp.Graph:
        """The graph of a thread."""
        with wp.ScopedCapture(device="cpu", force_module_load=False) as capture:
            shared = False
            for launch, parts in planned:
                if shared or parts > 1:
                    self._meet(number)
                shared = parts > 1
                if shared:
                    launch.run(number, parts)
                elif number == 0:
                    launch.run()
            self._meet(number)
        return capture.graph

    def _meet(self, number: int, record: bool = False) -> Any:
        inputs = [number, self.threads, self._address, self._met]
        return wp.launch(meeting(), 1, inputs=inputs, device="cpu", record_cmd=record)

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

    def _replay(self, number: int, stretches: list[Stretch], left: list[list[Iterator[Any]]]) -> None:
        """A thread's part of steps; `left` holds for each what is left of every stretch's pieces."""
        for each in left:
            for stretch, pieces in zip(stretches, each, strict=True):
                if stretch.graphs:
                    wp.capture_launch(stretch.graphs[number])
                else:
                    for piece in pieces:
                        piece.launch()
                    self._meetings[number].launch()

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

    def run(self, stretches: list[Stretch], times: int) -> None:
        """Go through a step so often. After a fault in any thread the crew is of no more use."""
        left = [[iter(stretch.pieces) for stretch in stretches] for _ in range(times)]
        for jobs in self._jobs:
            jobs.put((stretches, left))
        try:
            self._replay(0, stretches, left)
        except BaseException as error:
            self._failed.insert(0, error)
            self._leave(0)
        if self._failed:
            # The others may still be at work in arrays that are about to be dropped.
            self.dismiss()
            for thread in self._threads:
                thread.join()
            raise self._failed[0]

    def dismiss(self) -> None:
        """End the threads."""
        for jobs in self._jobs:
            jobs.put(None)
