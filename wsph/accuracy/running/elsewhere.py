"""Rows of a search on the workers of an executor of `concurrent.futures`, on whatever machines these are.

A worker runs a row as this process would. Its result comes back as it is; its files are written by the worker, in a folder
of its own inside of the search's, which workers have to see. There stands a word as long as the search goes on: a worker
that does not find it sees another folder, and one that finds it gone runs for nobody, and ends. Clocks of machines are
taken to agree: by them a row that is due is ended where it runs.
"""

# pyright: strict

import math
import shutil
import socket
import tempfile
import time
import uuid
from collections.abc import Iterable
from concurrent.futures import BrokenExecutor, Executor
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

from wsph.accuracy.planning.cost import composed
from wsph.accuracy.planning.watch import Due, Watch
from wsph.accuracy.running.order import Order, Ran, Unfit, timed
from wsph.accuracy.running.task import Lost, Task
from wsph.accuracy.running.wanted import Wanted
from wsph.doubts import doubt
from wsph.errors import OutputError, Refused
from wsph.output.files import write_text
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.run import ONE_RUN, Progress, run
from wsph.simulation.summary import plugins_of

GRACE = 5.0
"""How much later than it has to end a row may come back [s]."""

_Made = tuple[Ran, Path | None]
"""A row, and the folder that it is in."""


class OtherVersion(Refused, Unfit):
    """A worker that has something else installed than the search."""


class NotSeen(OutputError, Unfit):
    """A worker that does not see the folder of the search."""


class Elsewhere:
    """The workers of an executor, which stays its owner's."""

    takes_composed = False

    def __init__(self, executor: Executor):
        self._executor = executor
        self._tasks: dict[Scene, Task[_Made]] = {}
        self._word: Path | None = None

    def refuse(self, scene: Scene) -> None:
        """What one process can run a worker can."""

    def ahead(self, orders: Iterable[Order]) -> int:
        """Send rows, all at once: scenes are set up to find out what they are to be, which is no time to run any."""
        every = list(orders)
        for order in every:
            with suppress(BrokenExecutor):  # which is said when its turn comes
                self._tasks[order.scene] = self._sent(order)
        return len(every)

    def run(self, order: Order, progress: Progress | None, composed: Composition | None) -> Ran:
        """Wait for a row, which is sent where it is not yet. Its seconds are those where it ran: how long it waited for a
        worker, or was on the way, says nothing of the next."""
        task = self._tasks.get(order.scene)
        if task is None:
            task = self._tasks[order.scene] = self._sent(order)
        until = order.begun + order.due.until + order.due.slack + GRACE
        ran, folder = task.result(lambda: None if until == math.inf else until - time.perf_counter())
        del self._tasks[order.scene]
        for words in ran.result.summary["findings"]:
            doubt(words, stacklevel=2)
        if order.out is not None and folder is not None:
            try:
                shutil.rmtree(order.out, ignore_errors=True)
                folder.rename(order.out)
            except OSError as error:
                raise OutputError(f"{folder}: cannot be moved to {order.out}: {error.strerror or error}") from error
        return ran

    def end(self) -> None:
        """Drop what nobody waits for; what is being run ends by itself, at the latest when it is done."""
        for task in self._tasks.values():
            task.cancel()
        self._tasks.clear()
        if self._word is not None:
            self._word.unlink(missing_ok=True)

    def _sent(self, order: Order) -> Task[_Made]:
        if self._word is None and order.out is not None:
            self._word = order.out.parent.resolve() / f"{uuid.uuid4().hex}.search"
            self._word.parent.mkdir(exist_ok=True)
            write_text(self._word, f"{socket.gethostname()}\n")
        # By the clock of the day: that of a process is of no meaning in another.
        begun = time.time() - (time.perf_counter() - order.begun)
        made = partial(_made, order.scene, order.due, begun, self._word, _versions(order.scene))
        return Task(self._executor, made)


def _versions(scene: Scene) -> dict[str, str]:
    """Of what the bits of a row follow from, as far as it has one."""
    return {"wsph": version("wsph"), "Warp": version("warp-lang"), **plugins_of(scene)}


def _made(scene: Scene, due: Due, begun: float, word: Path | None, versions: dict[str, str]) -> _Made:
    """What a worker does: run a scene of a search that was `begun` at a time of `time.time`, into a folder beside the word
    of that."""
    for name, own in _versions(scene).items():
        if own != versions[name]:
            raise OtherVersion(
                f"a worker on {socket.gethostname()} has {name} {own}, the search {versions[name]}: rows are of one"
            )
    out = None
    if word is not None:
        if not word.is_file():
            raise NotSeen(
                f"{word.parent.parent}: a worker on {socket.gethostname()} does not see it, and rows are written where they"
                " are run: choose with -o a folder that all workers share; from Python rows need none"
            )
        out = Path(tempfile.mkdtemp(dir=word.parent))
    watch, wanted = Watch(due, begun, clock=time.time), Wanted(word)

    def enough() -> bool:
        return watch.late() or wanted.gone()

    with ONE_RUN:
        started = time.perf_counter()
        ready = composed(scene)
        composing = time.perf_counter() - started
        if word is not None and not word.is_file():  # the search is over, and its folder may be gone
            raise Lost("nobody waits for it any more")
        made = timed(
            watch,
            lambda: run(
                scene, out, overwrite=True, throw=False, progress=watch.progress, composed=ready, enough=enough
            ),
        )
    if made.result.status == "interrupted" and not made.ended and not wanted.gone():
        raise BrokenExecutor("its worker was asked to end")
    return replace(made, wall_seconds=composing + made.wall_seconds, composing=composing), out
