"""Whether anybody waits for what a worker computes."""

# pyright: strict
# pyright: reportMissingImports=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import sys
import time
from collections.abc import Callable
from pathlib import Path

from wsph.accuracy.running.task import Lost
from wsph.scene.scene import Scene
from wsph.simulation.result import Result
from wsph.simulation.run import run

LOOK_SECONDS = 1.0
"""Time between two looks of a worker at whether anybody waits for its row [s]."""


class Wanted:
    """Whether the word of who waits still stands, where there is one, and a scheduler of Dask still asks for the task that
    this thread is at, where it is one; looked at now and then."""

    def __init__(self, word: Path | None = None):
        self._word, self._looked, self._gone = word, time.monotonic(), False
        self._dropped = _dropped_by_dask()

    @property
    def can_be_dropped(self) -> bool:
        """Whether this is something that somebody elsewhere waits for."""
        return self._word is not None or self._dropped is not None

    def gone(self) -> bool:
        """Whether nobody waits any more."""
        now = time.monotonic()
        if not self._gone and now - self._looked > LOOK_SECONDS:
            self._looked = now
            word, dropped = self._word, self._dropped
            self._gone = (word is not None and not word.exists()) or (dropped is not None and dropped())
        return self._gone


def _dropped_by_dask() -> Callable[[], bool] | None:
    """Asks whether a scheduler of Dask has dropped the task of this thread, whose client has cancelled it or is gone; None
    where this thread is at no task of Dask."""
    if "distributed" not in sys.modules:
        return None
    from distributed import get_worker

    try:
        worker = get_worker()
    except ValueError:  # this is no worker
        return None
    key, tasks = worker.get_current_task(), worker.state.tasks
    return lambda: key not in tasks or tasks[key].state == "cancelled"


def run_for_whom_waits(scene: Scene) -> Result:
    """Run a scene without a folder, on a worker as long as anybody waits for it. Raises Refused, KeyboardInterrupt where it
    is interrupted, and Lost where nobody waits."""
    wanted = Wanted()
    result = run(scene, throw=False, enough=wanted.gone if wanted.can_be_dropped else None)
    if result.status == "interrupted":
        if wanted.gone():
            raise Lost("nobody waits for it any more")
        raise KeyboardInterrupt
    return result
