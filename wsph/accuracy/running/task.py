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

    def result(self) -> T:
        """What comes of it, waited for. Raises what the call raises, and BrokenExecutor where it is lost again."""
        try:
            return self._future.result()
        except Lost:
            raise
        except BrokenExecutor:
            self._future = self._executor.submit(self._call)
        except CancelledError:
            raise Lost("its executor has dropped it") from None
        return self._future.result()

    def cancel(self) -> None:
        """Nobody waits for it any more: it is dropped where it has not begun."""
        self._future.cancel()
