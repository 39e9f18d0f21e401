"""A call that an executor makes, once more where its worker is lost."""

# pyright: strict

from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from typing import Generic, TypeVar

T = TypeVar("T")


class Lost(BrokenExecutor):
    """A task whose workers were lost, one after the other: the executor has given it to others already."""


class Task(Generic[T]):
    """A call at an executor; call and result have to be picklable where that is elsewhere."""

    def __init__(self, executor: Executor, call: Callable[[], T]):
        """Raises BrokenExecutor where that takes no more."""
        self._executor, self._call = executor, call
        self._future = executor.submit(call)

    def result(self, left: Callable[[], float | None] = lambda: None) -> T:
        """What comes of it, waited for as long as there is time `left` [s], without end where that says None. Raises what
        the call raises, and BrokenExecutor where it is lost again or does not come in time."""
        try:
            return self._waited(left())
        except Lost:
            raise
        except BrokenExecutor:
            self._future = self._executor.submit(self._call)
        return self._waited(left())

    def _waited(self, seconds: float | None) -> T:
        try:
            return self._future.result(None if seconds is None else max(seconds, 0.0))
        except CancelledError:
            raise Lost("its executor has dropped it") from None
        except TimeoutError:
            if self._future.done():  # the call's own
                raise
            self._future.cancel()
            raise Lost("no worker was done with it in the time that there is") from None

    def cancel(self) -> None:
        """Nobody waits for it any more: it is dropped where it has not begun."""
        self._future.cancel()
