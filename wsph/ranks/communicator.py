"""A communicator of MPI, as mpi4py has it: what processes that share a scene ask of it."""

# pyright: strict

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

T = TypeVar("T")


class Request(Protocol):
    """A message under way."""

    def Wait(self) -> object: ...


class Communicator(Protocol):
    """The processes that share a scene."""

    def Get_rank(self) -> int: ...

    def Get_size(self) -> int: ...

    def allgather(self, sendobj: T) -> list[T]: ...

    def Allgatherv(self, sendbuf: np.ndarray, recvbuf: list[object]) -> None: ...

    def scatter(self, sendobj: Sequence[T] | None, root: int) -> T: ...

    def Send(self, buf: np.ndarray, dest: int, tag: int) -> None: ...

    def Recv(self, buf: np.ndarray, source: int, tag: int) -> None: ...

    def Isend(self, buf: np.ndarray, dest: int, tag: int) -> Request: ...

    def Irecv(self, buf: np.ndarray, source: int, tag: int) -> Request: ...

    def Abort(self, errorcode: int) -> None: ...
