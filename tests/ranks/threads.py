"""Threads of one process in the place of processes that MPI joins: for what is made of a scene, and runs no step."""

import threading
from collections.abc import Callable
from contextlib import nullcontext
from copy import deepcopy
from functools import cached_property
from queue import Queue
from typing import Any, TypeVar

import numpy as np
import pytest

from wsph.geometry.lattice import Lattice
from wsph.geometry.shapes.stair_patches import StairPatches
from wsph.ranks.mpi import Ranks

T = TypeVar("T")


class _Sent:
    def Wait(self) -> None:
        """It was put down."""


class _Awaited:
    def __init__(self, queue: "Queue[np.ndarray]", into: np.ndarray):
        self._queue, self._into = queue, into

    def Wait(self) -> None:
        self._into[...] = self._queue.get(timeout=60.0)


class Thread:
    """One of them, as a communicator."""

    def __init__(
        self, rank: int, size: int, said: list[Any], barrier: threading.Barrier, queues: dict[tuple[int, int], Any]
    ):
        self._rank, self._size, self._said, self._barrier, self._queues = rank, size, said, barrier, queues

    def Get_rank(self) -> int:
        return self._rank

    def Get_size(self) -> int:
        return self._size

    def allgather(self, sendobj: T) -> list[T]:
        self._said[self._rank] = deepcopy(sendobj)
        self._barrier.wait(60.0)
        found = list(self._said)
        self._barrier.wait(60.0)
        return found

    def Allgatherv(self, sendbuf: np.ndarray, recvbuf: list[Any]) -> None:
        recvbuf[0][...] = np.concatenate(self.allgather(sendbuf))

    def scatter(self, sendobj: Any, root: int) -> Any:
        return self.allgather(sendobj)[root][self._rank]

    def Isend(self, buf: np.ndarray, dest: int, tag: int) -> _Sent:
        self._queues[self._rank, dest].put(buf.copy())
        return _Sent()

    def Irecv(self, buf: np.ndarray, source: int, tag: int) -> _Awaited:
        return _Awaited(self._queues[source, self._rank], buf)


@pytest.fixture
def unlocked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before Python 3.12 a cached property of one object waits for that of another, and so would threads for each other."""
    for kind in (Lattice, StairPatches):
        for each in vars(kind).values():
            if isinstance(each, cached_property) and hasattr(each, "lock"):
                monkeypatch.setattr(each, "lock", nullcontext())


def together(size: int, of: Callable[[Ranks], T]) -> list[T]:
    """What a function gives in each of so many that run it together; the first error that one of them meets is raised."""
    barrier, said = threading.Barrier(size), [None] * size
    queues = {(a, b): Queue() for a in range(size) for b in range(size)}
    found: list[Any] = [None] * size
    errors: list[BaseException] = []

    def run(rank: int) -> None:
        domain = Ranks(Thread(rank, size, said, barrier, queues))  # type: ignore[arg-type]
        try:
            found[rank] = of(domain)
        except BaseException as error:
            errors.append(error)
            barrier.abort()

    threads = [threading.Thread(target=run, args=(rank,), name=str(rank)) for rank in range(size)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    if errors:
        raise next((each for each in errors if not isinstance(each, threading.BrokenBarrierError)), errors[0])
    return found
