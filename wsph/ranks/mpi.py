"""Processes that MPI joins, each with a part of a scene: the one room for what they say to each other.

Every collective call begins with a word of each process on how it is. One that has met an error says so instead, and all
the others raise it too: none waits for what another will not say.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false
# pyright: reportMissingImports=false

import platform
import sys
from collections.abc import Callable, Sequence
from typing import TypeVar, cast

import numpy as np

from wsph.backend.domain import Share, ending_together, failing_together
from wsph.backend.threads import cores
from wsph.errors import WsphError
from wsph.ranks.communicator import Communicator, Request
from wsph.ranks.exchange import ChosenExchange, Exchange

T = TypeVar("T")

FEW_BYTES = 2**14
"""Of an array that processes tell each other with the word on how they are."""

MOST_BYTES = 2**30
"""Of one message to the first process: larger arrays go in pieces."""


class Elsewhere(WsphError):
    """An error of another process, in words, that cannot be carried between processes."""


class Ranks:
    """The domain of a process among those of a communicator (`wsph.backend.domain.Domain`)."""

    def __init__(self, comm: Communicator):
        self._comm = comm
        self.rank, self.size = int(comm.Get_rank()), int(comm.Get_size())
        self._failed = False

    def sum(self, x: np.ndarray) -> np.ndarray:
        return self._reduced(x, lambda parts: parts.sum(0))

    def max(self, x: np.ndarray) -> np.ndarray:
        return self._reduced(x, lambda parts: parts.max(0))

    def min(self, x: np.ndarray) -> np.ndarray:
        return self._reduced(x, lambda parts: parts.min(0))

    def _reduced(self, x: np.ndarray, of: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        # Small arrays, put together by every process alike.
        return of(np.stack(self._hear(np.asarray(x))))

    def joined(self, rows: np.ndarray) -> np.ndarray:
        parts = self._hear(rows if rows.nbytes <= FEW_BYTES else None)
        known = [each for each in parts if each is not None]
        if len(known) == self.size:
            return np.concatenate(known)
        counts = self._comm.allgather(len(rows))
        whole = np.empty((sum(counts), *rows.shape[1:]), rows.dtype)
        self._comm.Allgatherv(np.ascontiguousarray(rows), [whole, _numbers(counts, rows), _type(rows)])
        return whole

    def gathered(self, rows: np.ndarray) -> np.ndarray:
        counts = self._hear(len(rows))
        if self.rank > 0:
            for piece in _pieces(np.ascontiguousarray(rows)):
                self._comm.Send(piece, 0, 1)
            return rows
        whole = np.empty((sum(counts), *rows.shape[1:]), rows.dtype)
        whole[: counts[0]] = rows
        ends = np.cumsum(counts).tolist()
        for other in range(1, self.size):
            for piece in _pieces(whole[ends[other - 1] : ends[other]]):
                self._comm.Recv(piece, other, 1)
        return whole

    def told(self, of: Callable[[], T], by: int = 0) -> T:
        found: T | None = None
        if self.rank == by:
            with failing_together(self):
                found = of()
        return cast(T, self._hear(found)[by])

    def dealt(self, of: Callable[[], Sequence[T]]) -> T:
        found: Sequence[T] | None = None
        if self.rank == 0:
            with failing_together(self):
                found = of()
        self._hear(None)
        with ending_together(self):  # the first may have no room to pack all parts, and the others wait for theirs
            return self._comm.scatter(found, 0)

    def passed(self, rows: Sequence[np.ndarray]) -> list[np.ndarray]:
        counts = np.array(self._hear([len(each) for each in rows]))
        found = [np.empty((int(n), *rows[0].shape[1:]), rows[0].dtype) for n in counts[:, self.rank]]
        found[self.rank] = rows[self.rank]
        others = [rank for rank in range(self.size) if rank != self.rank]
        waits: list[Request] = []
        for other in others:
            waits += [self._comm.Irecv(piece, other, 4) for piece in _pieces(found[other]) if piece.size]
        for other in others:
            sent = np.ascontiguousarray(rows[other])
            waits += [self._comm.Isend(piece, other, 4) for piece in _pieces(sent) if piece.size]
        for each in waits:
            each.Wait()
        return found

    def afresh(self) -> "Ranks":
        return Ranks(self._comm)

    def abort(self, error: BaseException) -> None:
        print(
            f"error: process {self.rank} of {self.size}: {type(error).__name__}: {error}", file=sys.stderr, flush=True
        )
        self._comm.Abort(1)

    def common(self, words: Sequence[str]) -> list[str]:
        everywhere = set(words).intersection(*self._hear(list(words)))
        return [each for each in words if each in everywhere]

    def fail(self, error: BaseException) -> None:
        if not self._failed:
            self._failed = True
            self._comm.allgather((_portable(error), None))

    def _hear(self, mine: T) -> list[T]:
        """What all processes say. Raises the error of the first that has met one."""
        if self._failed:
            raise Elsewhere("this process has failed before")
        said = self._comm.allgather((None, mine))
        found = next((error for error, _ in said if error is not None), None)
        if found is not None:
            self._failed = True
            raise found
        return [each for _, each in said]

    def cores(self) -> list[int]:
        # Launchers bind processes to cores of their own, or leave all of them to all: then these are dealt out.
        mine = platform.node(), cores()
        alike = [rank for rank, theirs in enumerate(self._hear(mine)) if theirs == mine]
        place, n = alike.index(self.rank), len(mine[1])
        return mine[1][place * n // len(alike) : (place + 1) * n // len(alike)]

    def place(self) -> int:
        machines = self._hear(platform.node())
        return machines[: self.rank].count(machines[self.rank])

    def halo(self, share: Share) -> Exchange:
        return Exchange(self._comm, self._hear(share), self.rank)

    def chosen_halo(self, share: Share) -> ChosenExchange:
        return ChosenExchange(self._comm, self, self._hear(share))


def _pieces(rows: np.ndarray) -> list[np.ndarray]:
    """Rows in pieces that one message can carry."""
    each = max(MOST_BYTES // max(rows[:1].nbytes, 1), 1)
    return [rows[k : k + each] for k in range(0, len(rows), each)]


def _numbers(counts: Sequence[int], rows: np.ndarray) -> list[int]:
    width = int(np.prod(rows.shape[1:], dtype=int))
    return [count * width for count in counts]


def _type(rows: np.ndarray) -> object:
    from mpi4py.util.dtlib import from_numpy_dtype

    return from_numpy_dtype(rows.dtype)


def _portable(error: BaseException) -> BaseException:
    """An error as other processes can raise it."""
    carried = isinstance(error, (WsphError, OSError, MemoryError, KeyboardInterrupt))
    return error if carried else Elsewhere(f"{type(error).__name__}: {error}")
