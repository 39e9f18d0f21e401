"""The runs of a study, over any executor of `concurrent.futures`: each row is kept when it ends.

Left to itself a study makes the coarsest row where it is, which fills the cache of kernels once and tells how long a row
takes; the others go to processes where that is worth their start. A process that is lost takes along its row alone.
"""

# pyright: strict

import time
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, CancelledError, Executor, as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import warp as wp

from wsph.backend.device import pick_device
from wsph.backend.threads import cores
from wsph.errors import Refused, is_out_of_memory
from wsph.scene.scene import Scene
from wsph.study.plan import Planned, planned
from wsph.study.rows import Made, Row, make
from wsph.study.tables import Study
from wsph.study.workers import Workers

SPREAD_SECONDS = 5.0
"""Estimated time after the first run [s] below which a study stays in its process: another takes two seconds to start."""

Keep = Callable[[int, Made], None]
"""Called with the number of a row and the row, when it is made."""


@dataclass
class Outcome:
    """What became of a study: its rows by their number, and those that are `lost`, with the reason. Lost rows can be made
    another time."""

    made: dict[int, Made]
    lost: dict[int, str]

    @property
    def rows(self) -> list[Row]:
        """The rows that there are, in order."""
        return [self.made[place].row for place in sorted(self.made)]


def run_study(
    study: Study,
    scene: Scene,
    folder: Path,
    executor: Executor | None = None,
    *,
    workers: int = 1,
    known: Mapping[int, Made] | None = None,
    keep: Keep | None = None,
) -> Outcome:
    """Run a study whose files are in `folder`: one row of plain data a run. What is refused or unstable is a row that says
    so.

    `executor`: where rows are made, each with one thread where the scene leaves their number open; `folder` has to be there
    as well. Without one, with more than one of `workers` (0: as many as there are cores for), rows go to processes where
    that is worth it: the same rows, but for their seconds. `known` rows are not made again; `keep` is called when a row
    ends, in the order in which they end. An interrupt ends the study (KeyboardInterrupt). Raises SceneError before the
    first run for an answer that cannot be compared with.
    """
    plan = planned(study, scene)
    if study.oracle is not None:
        for each in plan:
            study.oracle.check(each.scene, folder)
    found = Outcome(dict(known or {}), {})
    todo = {place: each for place, each in enumerate(plan) if place not in found.made}

    def note(place: int, made: Made) -> None:
        found.made[place] = made
        if keep is not None:
            keep(place, made)

    row = partial(make, study, folder)
    if executor is not None:
        found.lost.update(_spread(executor, todo, partial(row, threads=1, alone=False), note))
    elif todo:
        found.lost.update(_here_or_spread(todo, row, workers, note))
    return found


def _here_or_spread(todo: dict[int, Planned], row: Callable[..., Made], workers: int, note: Keep) -> dict[int, str]:
    """Make rows in this process, or those after the first in others; returns those that are lost."""
    scenes = [each.scene for each in todo.values()]
    each_takes = max(1, *(scene.run.threads for scene in scenes)) if len(scenes) > 1 else 1
    workers = min(workers or len(cores()) // each_takes, len(todo) - 1)
    if any(_on_cuda(scene) for scene in scenes):
        workers = 1
    threads = 1 if workers > 1 else None
    # The coarsest, which no lack of memory ends.
    first = max(todo, key=lambda place: todo[place].spacing or 0.0)
    begin, rest = todo[first], {place: each for place, each in todo.items() if place != first}
    started = time.perf_counter()
    note(first, row(begin, threads=threads))
    taken = time.perf_counter() - started
    if workers < 2 or sum(taken * _dearer(each, begin) for each in rest.values()) < SPREAD_SECONDS:
        for place, each in rest.items():
            note(place, row(each, threads=threads))
        return {}
    with Workers(workers, each_takes) as pool:
        return _spread(pool, rest, partial(row, threads=1, alone=False), note)


def _dearer(row: Planned, other: Planned) -> float:
    """How many times the work of another a row has, by their spacings."""
    return ((other.spacing or 1.0) / (row.spacing or other.spacing or 1.0)) ** (row.scene.dim + 1)


def _spread(executor: Executor, todo: dict[int, Planned], row: Callable[[Planned], Made], note: Keep) -> dict[int, str]:
    """Make rows by an executor; returns those that are lost with their process or with its memory."""
    futures = {executor.submit(row, each): place for place, each in todo.items()}
    lost: dict[int, str] = {}
    try:
        for future in as_completed(futures):
            try:
                note(futures[future], future.result())
            except (BrokenExecutor, CancelledError) as error:
                lost[futures[future]] = str(error) or type(error).__name__
            except (MemoryError, RuntimeError, OSError) as error:
                if not is_out_of_memory(error):
                    raise
                lost[futures[future]] = "out of memory"
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        raise
    return lost


def _on_cuda(scene: Scene) -> bool:
    try:
        return wp.get_device(pick_device(scene.run.device)).is_cuda
    except Refused:  # which its row will say
        return False
