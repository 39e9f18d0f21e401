"""Threads that share the launches of a step on the CPU.

A step is, for every thread, a list of segments. Every thread has a range of each shared launch. Launches of up to a
millisecond stand in captured graphs, one a thread; the first thread's has the launches that are not shared too. In a launch
that takes longer every thread goes through its range in pieces, ever smaller ones, and then takes what is last in others':
so cores of unequal speed, or ranges of unequal work, end together. Of parts whose launches do not take of each other's
(`Clock.apart`) each thread has its own. Before and after a shared launch, and such parts, the threads meet, and wait for
each other awake: on a shared machine a core that goes to sleep between two launches is back late, by a tenth of a step of a
hundred thousand particles. A thread that has waited a few microseconds offers its core to others between looks.

Every row is computed as it is in one piece: results are the same bits for any number of threads.
"""

import contextlib
import ctypes
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache, partial
from itertools import groupby
from queue import SimpleQueue
from typing import Any

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.launch import HostCall, Launch, captured

ALONE_SECONDS = 2e-5
"""A launch that takes less is the first thread's alone: a meeting takes a microsecond, and one cache has the data."""

LONG_SECONDS = 1e-3
"""A launch that takes one thread longer is gone through in pieces."""

PIECE_SECONDS = 1e-4
"""The shortest piece: taking one costs a few microseconds."""

PIECE_SHARE = 0.7
"""The part that a piece takes of the rows that a thread has still to do."""

LINE = 16
"""Distance between counters, in int64: no two of them share a cache line."""

LOOKS = 2000
"""Looks of a waiting thread, over a few microseconds, before it offers its core to others."""

GONE = 1 << 62
"""The count of a thread that nobody is to wait for any more."""


def cores() -> list[int]:
    """The cores that this process may use."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else list(range(os.cpu_count() or 1))


def keep_to(those: Iterable[int]) -> None:
    """The calling thread on those cores alone, where the system lets it."""
    if hasattr(os, "sched_setaffinity"):
        with contextlib.suppress(OSError):
            os.sched_setaffinity(threading.get_native_id(), those)


@cache
def barrier() -> wp.Kernel:
    """Barrier, as a kernel: thread `me` waits until each of `threads` has arrived as often as it has."""

    @wp.func_native(f"""
        const int64_t times = met.data[me * {LINE}] + 1;
        __atomic_store_n(&met.data[me * {LINE}], times, __ATOMIC_RELEASE);
        for (int32_t other = 0; other < threads; ++other)
            for (int32_t looks = 0; __atomic_load_n(&met.data[other * {LINE}], __ATOMIC_ACQUIRE) < times;)
                if (++looks > {LOOKS} && give_way) {{ looks = {LOOKS}; ((void (*)())give_way)(); }}
    """)
    def come(met: wp.array(dtype=wp.int64), me: int, threads: int, give_way: wp.uint64): ...

    @kernel()
    def meet(me: int, threads: int, give_way: wp.uint64, met_out: wp.array(dtype=wp.int64)):
        come(met_out, me, threads, give_way)

    return meet


def _give_way() -> int:
    """Address of `sched_yield`, which offers the caller's core to others; 0 without one: a waiting thread keeps its core."""
    function = getattr(ctypes.CDLL(None), "sched_yield", None) if os.name == "posix" else None
    return ctypes.cast(function, ctypes.c_void_p).value or 0 if function is not None else 0


def _next(take: Callable[[], wp.Graph]) -> wp.Graph | None:
    """The next graph of a queue, by `take`; None where the queue is empty."""
    try:
        return take()
    except IndexError:
        return None


class Sharing(Enum):
    """How the threads share a launch."""

    ALONE = "the first thread's"
    RANGES = "a range each"
    PARTS = "one thread's, of which others have theirs"
    PIECES = "in pieces"


def share(launch: Launch, seconds: float) -> Sharing:
    """How a launch that takes `seconds` [s], or its whole group, is shared."""
    if seconds <= ALONE_SECONDS or not (launch.group or launch.divisible):
        return Sharing.ALONE
    if launch.group:
        return Sharing.PARTS
    return Sharing.PIECES if seconds > LONG_SECONDS else Sharing.RANGES


def _together(launches: list[Launch], seconds: list[float]) -> list[float]:
    """What each of the launches takes [s], and those of a group what all of it takes."""
    sums: dict[int, float] = {}
    for launch, each in zip(launches, seconds, strict=True):
        sums[launch.group] = sums.get(launch.group, 0.0) + each
    return [sums[launch.group] if launch.group else each for launch, each in zip(launches, seconds, strict=True)]


@dataclass(frozen=True)
class Segment:
    """A part of a step between two meetings: a graph for each thread, or the pieces of one launch, by thread, or what the
    host does, by the first."""

    graphs: list[wp.Graph]
    pieces: list[list[wp.Graph]]
    host: HostCall | None = None


class ThreadTeam:
    """The threads that share the steps: the caller and `threads` - 1 more, on the cores `on`, which are all where none are
    given. `_met` (threads LINE,) int64 counts the meetings that each thread has arrived at, one counter every LINE."""

    def __init__(self, threads: int, on: Sequence[int] = ()):
        self.threads = threads
        self._all = cores()
        self._cores = on or self._all
        self._met = wp.zeros(threads * LINE, dtype=wp.int64, device="cpu")
        self._address = wp.uint64(_give_way())
        self._meetings = [captured(partial(self._meet, number)) for number in range(threads)]
        self._jobs: list[SimpleQueue[Any]] = [SimpleQueue() for _ in range(threads - 1)]
        self._failed: list[BaseException] = []
        self._threads = [
            threading.Thread(target=self._work, args=each, daemon=True) for each in enumerate(self._jobs, 1)
        ]
        for thread in self._threads:
            thread.start()

    def segments(self, step: list[Launch | HostCall], seconds: list[float]) -> list[Segment]:
        """The segments of a step, from its launches and the measured `seconds` of each [s]. Kernels are loaded."""
        found: list[Segment] = []
        begin, left = 0, list(seconds)
        for end in [k for k, each in enumerate(step) if isinstance(each, HostCall)] + [len(step)]:
            launches = [each for each in step[begin:end] if isinstance(each, Launch)]
            found += self._between(launches, left[: len(launches)])
            left, begin = left[len(launches) :], end + 1
            found += [Segment([], [], each) for each in step[end : end + 1] if isinstance(each, HostCall)]
        return found

    def _between(self, launches: list[Launch], seconds: list[float]) -> list[Segment]:
        """The segments of launches between which the host has no part."""
        found: list[Segment] = []
        planned = [
            (launch, each, share(launch, each))
            for launch, each in zip(launches, _together(launches, seconds), strict=True)
        ]
        for cut, group in groupby(planned, lambda each: each[2] is Sharing.PIECES):
            if cut:
                found += [Segment([], self._pieces(launch, each)) for launch, each, _ in group]
            else:
                plan = [(launch, how) for launch, _, how in group]
                parts = [partial(self._part, plan, number) for number in range(self.threads)]
                found.append(Segment([captured(part) for part in parts], []))
        return found

    def _range(self, n: int, number: int) -> tuple[int, int]:
        return n * number // self.threads, n * (number + 1) // self.threads

    def _pieces(self, launch: Launch, seconds: float) -> list[list[wp.Graph]]:
        """The pieces of every thread's range."""
        least = max(int(PIECE_SECONDS / seconds * launch.n), 1)
        found: list[list[wp.Graph]] = []
        for number in range(self.threads):
            low, end = self._range(launch.n, number)
            found.append([])
            while low < end:
                high = min(low + max(int(PIECE_SHARE * (end - low)), least), end)
                found[-1].append(captured(partial(launch.run, low, high)))
                low = high
        return found

    def _part(self, plan: list[tuple[Launch, Sharing]], number: int) -> None:
        """A thread's part of launches."""
        before = None  # at the start of a segment all have met
        for launch, how in plan:
            # One thread has its launches in their order, be they the first's or those of a part.
            now = (how, launch.group if how is Sharing.PARTS else 0)
            if before is not None and (now != before or how is Sharing.RANGES):
                self._meet(number)
            before = now
            if how is Sharing.RANGES:
                launch.run(*self._range(launch.n, number))
            elif number == (launch.part % self.threads if how is Sharing.PARTS else 0):
                launch.run()
        self._meet(number)

    def _meet(self, number: int) -> None:
        wp.launch(barrier(), 1, inputs=[number, self.threads, self._address], outputs=[self._met], device="cpu")

    def _pin(self, number: int) -> None:
        """Pin the calling thread to core `number`: unpinned, two threads sometimes share a core."""
        keep_to({self._cores[number % len(self._cores)]})

    def _work(self, number: int, jobs: "SimpleQueue[Any]") -> None:
        self._pin(number)
        while (job := jobs.get()) is not None:
            try:
                self._replay(number, *job)
            except BaseException as error:
                self._failed.append(error)
                self._leave(number)
            job = None  # it would keep arrays that have been replaced

    def _replay(self, number: int, segments: list[Segment], left: list[list[list[deque[wp.Graph]]]]) -> None:
        """A thread's part of steps; `left` holds for each step, segment and thread which pieces are left."""
        for step in left:
            for segment, pieces in zip(segments, step, strict=True):
                if segment.graphs:
                    wp.capture_launch(segment.graphs[number])
                    continue
                if segment.host is not None:
                    if number == 0:
                        segment.host.run()
                else:
                    self._go_through(number, pieces)
                wp.capture_launch(self._meetings[number])

    def _go_through(self, number: int, pieces: list[deque[wp.Graph]]) -> None:
        """Its own pieces of a launch, and then those that others have left."""
        for take in (pieces[number].popleft, *(each.pop for each in pieces)):
            while (piece := _next(take)) is not None:
                wp.capture_launch(piece)

    def _leave(self, number: int) -> None:
        self._met.numpy()[number * LINE] = GONE

    @contextlib.contextmanager
    def at_work(self) -> Iterator[None]:
        """The caller on a core of its own too, as long as it takes part."""
        self._pin(0)
        try:
            yield
        finally:
            keep_to(self._all)

    def run(self, segments: list[Segment], times: int) -> None:
        """Run the step `times` times. A fault in any thread is raised, and ends the team."""
        left = [[[deque(pieces) for pieces in segment.pieces] for segment in segments] for _ in range(times)]
        try:
            for jobs in self._jobs:
                jobs.put((segments, left))
            self._replay(0, segments, left)
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
