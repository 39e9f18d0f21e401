"""A call that an executor makes, once more where its worker is lost."""

# pyright: strict

import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Generic, TypeVar

T = TypeVar("T")


class Lost(BrokenExecutor):
    """A task whose workers were lost, one after the other: the executor has given it to others already."""


class Task(Generic[T]):
    """A call at an executor; call and result have to be picklable where that is elsewhere."""

    def __init__(self, executor: Executor, call: Callable[[], T]):
        """Raises BrokenExecutor where that takes no more."""
        self._executor, self._call = executor, call
        self._future = self._sent()

    def _sent(self) -> Future[T]:
        self._begun, self._ended = time.perf_counter(), 0.0
        future = self._executor.submit(self._call)
        future.add_done_callback(self._note)
        return future

    def _note(self, _: object) -> None:
        self._ended = time.perf_counter()

    @property
    def seconds(self) -> float:
        """From when it was sent, the last time, until its result was here, or until now [s]."""
        return (self._ended or time.perf_counter()) - self._begun

    def result(self) -> T:
        """What comes of it, waited for. Raises what the call raises, and BrokenExecutor where it is lost again."""
        try:
            return self._future.result()
        except Lost:
            raise
        except BrokenExecutor:
            self._future = self._sent()
        except CancelledError:
            raise Lost("its executor has dropped it") from None
        return self._future.result()

    def cancel(self) -> None:
        """Nobody waits for it any more: it is dropped where it has not begun."""
        self._future.cancel()
