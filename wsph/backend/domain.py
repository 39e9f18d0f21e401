"""Which part of a scene this process has, and what it asks of the others."""

# pyright: strict

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from wsph.backend.space import Array
from wsph.backend.threads import cores

T = TypeVar("T")


@dataclass(frozen=True)
class Share:
    """The rows that a process holds of an array over a whole body, a range of them, and the range of those that are its
    own: the others are copies of rows that other processes own. Of `whole` rows it holds `held` from number `first` on, and
    owns those from number `low` up to `high`."""

    whole: int
    first: int
    held: int
    low: int
    high: int

    @classmethod
    def all(cls, n: int) -> "Share":
        """All of n rows."""
        return cls(n, 0, n, 0, n)

    @property
    def own(self) -> slice:
        """Its own rows among those that it holds."""
        return slice(self.low - self.first, self.high - self.first)

    def owns(self, rows: np.ndarray) -> np.ndarray:
        """Which of some rows, by their numbers among those that it holds, are its own: bool, of their shape."""
        own = self.own
        return (rows >= own.start) & (rows < own.stop)

    def stands(self, numbers: np.ndarray) -> np.ndarray:
        """Where rows of the whole stand among those that it holds, by their numbers; -1 for those that it does not hold."""
        rows = numbers - self.first
        return np.where((rows >= 0) & (rows < self.held), rows, -1)

    def owned(self, numbers: np.ndarray) -> np.ndarray:
        """The same of those that are its own, alone and in their order."""
        rows = numbers - self.first
        return rows[self.owns(rows)]

    @property
    def window(self) -> slice:
        """The rows that it holds, among those of the whole."""
        return slice(self.first, self.first + self.held)

    @property
    def complete(self) -> bool:
        """Whether they are all its own."""
        return self.high - self.low == self.whole


@dataclass(frozen=True)
class Split:
    """The part of a body that a process has: its shares of the `nodes` and of the `points` that carry the stress. Of the
    whole it knows, in cells of its grid, `middle` (dim,), where its nodes are in the mean, and `low` (dim,), where the
    first are. `layers` of its cells, or points, from one up to another, whose state is that of their owners in every step,
    with their nodes and points among those that it holds, `right`; it holds those `around` them. `work`: how many pairs each
    process visits in a right-hand side, as they were counted to cut the body."""

    domain: "Domain"
    nodes: Share
    points: Share
    middle: np.ndarray | None = None
    low: np.ndarray | None = None
    layers: tuple[int, int] = (0, 0)
    around: tuple[int, int] = (0, 0)
    right: tuple[slice, slice] | None = None
    work: tuple[float, ...] = ()

    def particles(self, *, at_nodes: bool) -> Share:
        """Its share of the particles, which are at the nodes or at the points."""
        return self.nodes if at_nodes else self.points


class Halo(Protocol):
    """Keeps the copies of rows that other processes own up to date. Where those of accelerations are, all that a step makes
    of them the copies of particles go through as their owners do, to the bit."""

    def update(self, *fields: Array) -> None:
        """Overwrite the copies in arrays over the rows held by what their owners have, on the host, in the order in which
        all processes call it."""
        ...

    def fill(self, *every: np.ndarray) -> None:
        """The same of rows on the host."""
        ...


class ChosenHalo(Halo, Protocol):
    """The same of some of the copies, which are chosen anew now and then."""

    def choose(self, rows: np.ndarray) -> None:
        """From now on those of `rows` (k,), ascending, among the rows held: all processes choose together."""
        ...


class Domain(Protocol):
    """The part of a scene that a process has. All processes call all of these in the same order: one that skips a call
    leaves the others waiting. The numbers returned are the same in every process, to the bit. Where a process has called
    `fail` all the others raise what it failed of, at their next call."""

    rank: int
    size: int

    def sum(self, x: np.ndarray) -> np.ndarray:
        """The sums of integers of all parts, element by element."""
        ...

    def max(self, x: np.ndarray) -> np.ndarray:
        """The largest of the parts' numbers, element by element; NaN where any is."""
        ...

    def min(self, x: np.ndarray) -> np.ndarray:
        """The smallest of the parts' numbers, element by element; NaN where any is."""
        ...

    def joined(self, rows: np.ndarray) -> np.ndarray:
        """The rows of all parts, one part after the other."""
        ...

    def gathered(self, rows: np.ndarray) -> np.ndarray:
        """The same in the first process; its own rows in the others."""
        ...

    def told(self, of: Callable[[], T], by: int = 0) -> T:
        """What a function gives in the first process, or in another, which alone calls it."""
        ...

    def dealt(self, of: Callable[[], Sequence[T]]) -> T:
        """Of what a function gives in the first process, which alone calls it, what is for this one: one for each."""
        ...

    def passed(self, rows: Sequence[np.ndarray]) -> list[np.ndarray]:
        """What each process has for this one, of the rows that each has for every process, of one type and shape."""
        ...

    def abort(self, error: BaseException) -> None:
        """End all processes, in the middle of steps, where others wait for what this one has to say."""
        ...

    def common(self, words: Sequence[str]) -> list[str]:
        """Those of the words of this process that all say."""
        ...

    def fail(self, error: BaseException) -> None:
        """Have all others raise an error at their next call."""
        ...

    def afresh(self) -> "Domain":
        """The same for something else, of which nothing has failed yet."""
        ...

    def halo(self, share: Share) -> Halo:
        """What keeps copies of a body's rows up to date."""
        ...

    def chosen_halo(self, share: Share) -> ChosenHalo:
        """What keeps some copies up to date: none until they are chosen."""
        ...

    def cores(self) -> Sequence[int]:
        """The cores that are this process's alone."""
        ...

    def place(self) -> int:
        """Its number among the processes on its machine."""
        ...


class Whole:
    """The domain of a scene in one process: every call gives what it was given."""

    rank, size = 0, 1

    def sum(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def max(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def min(self, x: np.ndarray) -> np.ndarray:
        """The numbers themselves."""
        return x

    def joined(self, rows: np.ndarray) -> np.ndarray:
        """The rows themselves."""
        return rows

    def gathered(self, rows: np.ndarray) -> np.ndarray:
        """The rows themselves."""
        return rows

    def told(self, of: Callable[[], T], by: int = 0) -> T:
        """What the function gives."""
        return of()

    def dealt(self, of: Callable[[], Sequence[T]]) -> T:
        """The one that the function gives."""
        return of()[0]

    def passed(self, rows: Sequence[np.ndarray]) -> list[np.ndarray]:
        """The rows themselves."""
        return list(rows)

    def abort(self, error: BaseException) -> None:
        """There are no others."""

    def common(self, words: Sequence[str]) -> list[str]:
        """The words themselves."""
        return list(words)

    def fail(self, error: BaseException) -> None:
        """There are no others."""

    def afresh(self) -> Domain:
        """It never fails."""
        return self

    def halo(self, share: Share) -> Halo:
        """There are no copies."""
        return self

    def chosen_halo(self, share: Share) -> ChosenHalo:
        """There are no copies."""
        return self

    def choose(self, rows: np.ndarray) -> None:
        """There are no copies."""

    def cores(self) -> Sequence[int]:
        """All that it may use."""
        return cores()

    def place(self) -> int:
        """There are no others."""
        return 0

    def update(self, *fields: Array) -> None:
        """There are no copies."""

    def fill(self, *every: np.ndarray) -> None:
        """There are no copies."""


WHOLE = Whole()


@contextmanager
def failing_together(domain: Domain) -> Generator[None]:
    """What goes wrong within it in this process all others raise too, at their next call."""
    try:
        yield
    except BaseException as error:
        domain.fail(error)
        raise


class Together(Exception):
    """What all processes raise at the same place: none of them waits for another."""


@contextmanager
def ending_together(domain: Domain) -> Generator[None]:
    """What goes wrong within it in this process ends all, in the middle of steps; what all raise together does not."""
    try:
        yield
    except Together:
        raise
    except BaseException as error:
        domain.abort(error)
        raise


def any_of(domain: Domain, flag: bool) -> bool:
    """Whether something holds in any part."""
    return flag if domain.size == 1 else bool(domain.max(np.array([flag], np.int64))[0])


def anywhere(domain: Domain, flags: np.ndarray) -> np.ndarray:
    """Which of some flags, bool, hold in any part, element by element."""
    return flags if domain.size == 1 else domain.max(flags.astype(np.int8)).astype(bool)
