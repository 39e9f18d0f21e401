"""Processes that run tasks, as an executor of `concurrent.futures`: one that is lost takes its own task along and no other.

Python's own pool of processes is broken as a whole where one of them ends, and does not tell which task it was.
"""

# pyright: strict

import multiprocessing
import os
import threading
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from queue import Empty, SimpleQueue
from typing import ParamSpec, TypeVar

from wsph.backend.threads import cores, keep_to

T = TypeVar("T")
P = ParamSpec("P")

_Task = Callable[[], object]
_SPAWN = multiprocessing.get_context("spawn")
"""Warp's threads and its devices do not outlive a fork."""


class WorkerLost(BrokenExecutor):
    """The process of a task ended before the task did."""


class Workers(Executor):
    """So many processes, each with `threads` cores of its own as far as there are some. A process is started with its first
    task and again after it was lost. Processes import the main module, which has to be importable."""

    def __init__(self, count: int, threads: int = 1):
        own = [cores()[k * threads : (k + 1) * threads] for k in range(max(len(cores()) // threads, 1))]
        self._tasks: SimpleQueue[tuple[Future[object], _Task] | None] = SimpleQueue()
        self._processes: list[SpawnProcess] = []
        self._ended = False
        self._lock = threading.Lock()
        serve = [partial(self._serve, own[k % len(own)]) for k in range(count)]
        self._servers = [threading.Thread(target=each, daemon=True) for each in serve]
        for server in self._servers:
            server.start()

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """As `Executor.submit`; task and result have to be picklable."""
        if self._ended:
            raise RuntimeError("the workers have been sent home")
        future: Future[T] = Future()
        self._tasks.put((future, partial(fn, *args, **kwargs)))  # type: ignore[arg-type]
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the processes end after what has been submitted; with `cancel_futures` end them now."""
        with self._lock:
            self._ended = True
            if cancel_futures:
                for process in self._processes:
                    process.kill()
        if cancel_futures:
            with suppress(Empty):
                while (task := self._tasks.get_nowait()) is not None:
                    task[0].cancel()
        for _ in self._servers:
            self._tasks.put(None)
        for server in self._servers if wait else ():
            server.join()

    def _serve(self, own: Sequence[int]) -> None:
        """Have tasks done by one process after the other."""
        worker: tuple[SpawnProcess, Connection] | None = None
        while (task := self._tasks.get()) is not None:
            future, call = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                worker = worker or self._start(own)
                future.set_result(_asked(*worker, call))
            except BaseException as error:
                if isinstance(error, WorkerLost):
                    worker = None
                future.set_exception(error)
        if worker is not None:
            worker[1].close()
            worker[0].join()

    def _start(self, own: Sequence[int]) -> tuple[SpawnProcess, Connection]:
        here, there = _SPAWN.Pipe()
        process = _SPAWN.Process(target=_work, args=(there, own), daemon=True)
        with self._lock:
            if self._ended and self._tasks.empty():
                raise WorkerLost("the study was ended")
            process.start()
            self._processes.append(process)
        there.close()
        return process, here


def _asked(process: SpawnProcess, line: Connection, call: _Task) -> object:
    """What a process answers to a task. Raises what it raises, WorkerLost where it ends."""
    try:
        line.send(call)
        done, answer = line.recv()
    except (EOFError, OSError):
        process.join()
        code = process.exitcode or 0
        how = f"was killed by signal {-code}, for lack of memory perhaps" if code < 0 else f"ended with code {code}"
        raise WorkerLost(f"its process {how}") from None
    if done:
        return answer
    raise answer


def _work(line: Connection, own: Sequence[int]) -> None:
    """What a process does, on cores of its own and with warnings off: the table reports them."""
    warnings.simplefilter("ignore")
    keep_to(own)
    while True:
        try:
            call: _Task = line.recv()
        except (EOFError, KeyboardInterrupt):
            return
        try:
            answer: tuple[bool, object] = True, call()
        except KeyboardInterrupt:
            os._exit(130)
        except BaseException as error:
            answer = False, error
        try:
            line.send(answer)
        except OSError:  # nobody waits any more
            return
        except Exception as error:
            line.send((False, RuntimeError(f"cannot be carried between processes: {error}; it was {answer[1]!r}")))
