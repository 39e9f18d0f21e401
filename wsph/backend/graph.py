"""Steps as programs: a fixed list of launches, captured once and replayed many times.

On CUDA and for small scenes on the CPU a graph holds many steps (0.2 us a launch). A larger scene on the CPU is timed for
one step, and its cores share the launches that are found to take long (`wsph.backend.threads`). Where the host has its part
in a step, as where processes exchange what they own, a step is stretches of launches between what the host does: the first
thread does that, and the others wait.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.launch import HostCall, Launch, captured
from wsph.backend.threads import Segment, ThreadTeam, barrier, cores

SMALL_PAIRS = 200_000
"""Up to this many pairs a step is not worth sharing."""

BLOCKS = (256, 32, 4, 1)
"""Steps in one captured graph of a small scene: any number of steps is a few replays of these."""

STRETCH_SECONDS = 0.01
"""Time that the threads of a team run between two looks at whether the run is to stop [s]."""


@dataclass(frozen=True)
class _Took:
    """What a launch of a kernel over `n` threads took [s]."""

    kernel: wp.Kernel
    n: int
    seconds: float


def _timed(step: list[Launch | HostCall]) -> list[_Took]:
    """Go through a step, and say how long each of its launches took."""
    found: list[_Took] = []
    graphs = [captured(each.run) if isinstance(each, Launch) else None for each in step]
    for each, graph in zip(step, graphs, strict=True):
        if graph is None or isinstance(each, HostCall):
            each.run()
            continue
        started = time.perf_counter()
        wp.capture_launch(graph)
        found.append(_Took(each.kernel, each.n, time.perf_counter() - started))
    return found


def _foreseen(step: list[Launch | HostCall], timed: list[_Took]) -> list[float]:
    """What each of the launches of a step takes [s], by the one that was `timed`, a thread: launches come and go, and grow
    and shrink, where contacts or pairs are found anew. A kernel that was not there takes what others do."""
    launches = [each for each in step if isinstance(each, Launch)]
    if [each.kernel for each in launches] == [each.kernel for each in timed]:
        return [took.seconds * each.n / max(took.n, 1) for each, took in zip(launches, timed, strict=True)]
    rates = {each.kernel: _rate([took for took in timed if took.kernel is each.kernel] or timed) for each in launches}
    return [rates[each.kernel] * each.n for each in launches]


def _rate(some: list[_Took]) -> float:
    return sum(each.seconds for each in some) / max(sum(each.n for each in some), 1)


def _run_all(launches: Sequence[Launch]) -> None:
    for launch in launches:
        launch.run()


def _stretches(step: list[Launch | HostCall], device: str) -> list[Callable[[], None]]:
    """A step as calls: graphs of the launches between what the host does, and that."""
    found: list[Callable[[], None]] = []
    left: list[Launch] = []

    def close() -> None:
        if left:
            found.append(partial(wp.capture_launch, captured(partial(_run_all, tuple(left)), device)))
            left.clear()

    for each in step:
        if isinstance(each, Launch):
            left.append(each)
        else:
            close()
            found.append(each.run)
    close()
    return found


class Program:
    """A step as a list of launches. `run(n)` runs it n times."""

    _team: ThreadTeam | None = None

    def __init__(
        self,
        step: Callable[[], None],
        clock: Clock,
        pairs: int,
        threads: int = 0,
        before: Callable[[], bool] | None = None,
        *,
        hosted: bool = False,
        on: Sequence[int] = (),
    ):
        """`pairs` measures the work of a step; `threads` 0 means all cores, those that it is to be `on`, or all there are;
        `before`, run on the host before every step, says whether it changed what the step's launches take; `hosted`: the
        host has its part in a step."""
        self.step, self._clock, self._before, self._device = step, clock, before, clock.device
        on_cuda = wp.get_device(self._device).is_cuda
        self.small = pairs <= SMALL_PAIRS or on_cuda
        self.followed = before is not None
        self.looked = self.small and not self.followed
        """Whether a run looks at its state after many steps alone."""
        self.hosted = hosted
        self.batched = self.looked and not hosted
        """Whether one graph may hold many steps."""
        self.asked, self.on = threads, on
        """The threads and the cores that were given."""
        self.threads = 1 if self.small else threads or len(on or cores())
        self._stretches: list[Callable[[], None]] = []
        self._timed: list[_Took] = []
        self._blocks = BLOCKS if self.batched else (1,)
        self._graphs: dict[int, wp.Graph] = {}
        self._segments: list[Segment] = []
        self._times = 1

    def __del__(self) -> None:
        if self._team is not None:
            self._team.dismiss()

    def forget(self) -> None:
        """Make the launches anew: what they take was changed by others than this program."""
        self._graphs, self._segments, self._stretches = {}, [], []

    def prepare(self, steps: int) -> None:
        """Capture what `run(steps)` replays: about 1 ms per captured step, once."""
        if self.batched:
            for block in self._blocks:
                if steps >= block:
                    self._captured(block)
                    steps %= block

    def run(self, steps: int, stop: Callable[[], bool] = lambda: False) -> int:
        """Run `steps` steps, fewer where `stop()` asks for it between replays; returns how many."""
        if self.threads > 1 and self._team is None:
            self._team = ThreadTeam(self.threads, self.on)
        done = 0
        with self._team.at_work() if self._team is not None else contextlib.nullcontext():
            while done < steps and not stop():
                if self._before is not None and self._before():
                    self.forget()
                if self._team is not None:
                    done += self._share(self._team, steps - done)
                elif self.hosted:
                    self._go_through()
                    done += 1
                else:
                    done += self._replay(steps - done)
        return done

    def _replay(self, most: int) -> int:
        """Replay one block of at most `most` steps; returns its steps."""
        block = next(block for block in self._blocks if block <= most)
        wp.capture_launch(self._captured(block))
        return block

    def _go_through(self) -> None:
        """Run a step, stretch by stretch."""
        if not self._stretches:
            self._stretches = _stretches(self._clock.listing(self.step), self._device)
        for stretch in self._stretches:
            stretch()

    def _share(self, team: ThreadTeam, most: int) -> int:
        """Run at most `most` steps by all threads; returns how many. The very first step is run by one thread, and timed."""
        if not self._segments:
            step = self._clock.listing(self.step)
            if not self._timed:
                self._timed = _timed(step)
                seconds = sum(each.seconds for each in self._timed)
                self._times = 1 if self.followed else 1 + int(STRETCH_SECONDS / seconds)
                return 1
            self._segments = team.segments(step, _foreseen(step, self._timed))
        times = min(self._times, most)
        try:
            team.run(self._segments, times)
        except BaseException:
            self._team, self._segments = None, []
            raise
        return times

    def compile(self, kernels: list[wp.Kernel]) -> None:
        """Compile and load the kernels that are not loaded yet.

        One after the other: each compiling thread would first spend 2 s on a precompiled header of its own.
        """
        needed = [*kernels, barrier()] if self.threads > 1 else kernels
        modules = list(dict.fromkeys(kernel.module for kernel in needed))
        if modules:
            wp.force_load(self._device, modules=modules, max_workers=0)

    def _captured(self, block: int) -> wp.Graph:
        """The graph of `steps` steps."""
        if block not in self._graphs:

            def steps() -> None:
                for _ in range(block):
                    self.step()

            self._graphs[block] = captured(steps, self._device)
        return self._graphs[block]
