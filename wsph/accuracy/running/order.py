"""A row that is to be run, what became of it, and who runs it."""

# pyright: strict

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from wsph.accuracy.planning.watch import Due, Watch
from wsph.errors import WsphError
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.result import Result
from wsph.simulation.run import Progress


@dataclass(frozen=True)
class Order:
    """A `scene` to be run, the folder that it writes, over what was there (`out`), and when it has to end (`due`) in the
    seconds of a search that was `begun` at a time of `time.perf_counter`."""

    scene: Scene
    out: Path | None
    due: Due
    begun: float


@dataclass(frozen=True)
class Ran:
    """What became of a row: its `result`, wall seconds, and those of all threads of a process; of the wall seconds those of
    `composing`, where it was not composed before. Whether its watch has `ended` it, as it was `early` or late."""

    result: Result
    wall_seconds: float
    cpu_seconds: float
    composing: float = 0.0
    ended: bool = False
    early: bool = False


class Unfit(WsphError):
    """A worker that cannot run rows of a search, whatever they are: it needs another worker, and not another row."""


class Runner(Protocol):
    """Who runs the rows of a search."""

    @property
    def takes_composed(self) -> bool:
        """Whether what is composed here, for a plan, is run."""
        ...

    def refuse(self, scene: Scene) -> None:
        """Raise SceneError for what of a scene it cannot run."""
        ...

    def ahead(self, orders: Iterable[Order]) -> int:
        """Begin with rows that do not depend on each other, where there is more than one place for them; returns how many
        were. They are `run` in whatever order; those that are not are dropped at the end."""
        ...

    def run(self, order: Order, progress: Progress | None, composed: Composition | None) -> Ran:
        """Run a row, which may be `composed` already. Raises what `wsph.run` raises but for Unstable, and BrokenExecutor
        for one that is lost."""
        ...

    def end(self) -> None:
        """The search is over."""
        ...


def timed(watch: Watch, run: Callable[[], Result]) -> Ran:
    """Run what a watch looks at."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = run()
    return Ran(
        result,
        time.perf_counter() - wall,
        time.process_time() - cpu,
        ended=watch.ended,
        early=watch.early,
    )
