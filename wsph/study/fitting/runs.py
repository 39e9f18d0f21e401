"""Where the runs of a fit are made."""

# pyright: strict

import time
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor, Executor
from functools import partial

import numpy as np

from wsph.accuracy.running.task import Task
from wsph.backend.threads import cores
from wsph.scene.scene import Scene
from wsph.study.fitting.curves import Sample, computed
from wsph.study.workers import Workers

SPREAD_SECONDS = 0.5
"""Time of a run [s] below which runs stay in this process."""


class Runs:
    """Makes the columns of several scenes: in this process until a run turns out to be long, then in others."""

    def __init__(self, names: Sequence[str], times: np.ndarray, workers: int, executor: Executor | None = None):
        """`executor`: where runs are made, in place of processes."""
        self._names, self._times, self._workers, self._executor = names, times, workers, executor
        self._own: Executor | None = None
        self._seconds = 0.0

    def __enter__(self) -> "Runs":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._own is not None:
            self._own.shutdown(cancel_futures=kind is not None)

    def __call__(self, scenes: Sequence[Scene]) -> list[Sample]:
        if self._executor is None and len(scenes) > 1 and self._workers != 1 and self._seconds > SPREAD_SECONDS:
            self._executor = self._own = Workers(self._workers or len(cores()))
        if self._executor is None:
            started = time.perf_counter()
            made = [computed(self._names, self._times, scene) for scene in scenes]
            self._seconds = (time.perf_counter() - started) / max(len(scenes), 1)
            return made
        single = [scene if scene.run.threads else scene.with_(threads=1) for scene in scenes]
        tasks: list[Task[Sample]] = []
        try:
            tasks += (Task(self._executor, partial(computed, self._names, self._times, scene)) for scene in single)
            return [task.result() for task in tasks]
        except BrokenExecutor as error:
            raise OSError(f"a run of the fit is lost: {error}") from None
        finally:
            for task in tasks:
                task.cancel()
