"""Copies of rows that other processes own, brought up to date by messages."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false
# pyright: reportMissingImports=false

from collections.abc import Sequence

import numpy as np

from wsph.backend.arrays import changed
from wsph.backend.domain import Domain, Share
from wsph.backend.space import Array
from wsph.ranks.communicator import Communicator
from wsph.ranks.packing import packed, unpacked, widths


class _Exchange:
    """Messages about rows."""

    def update(self, *fields: Array) -> None:
        """As `wsph.backend.domain.Halo.update`."""
        every: list[np.ndarray] = [field.numpy() for field in fields]  # on a CPU views
        self.fill(*every)
        for field, rows in zip(fields, every, strict=True):
            changed(field, rows)

    def fill(self, *every: np.ndarray) -> None:
        """As `wsph.backend.domain.Halo.fill`."""
        raise NotImplementedError


class Exchange(_Exchange):
    """Messages that keep the copies of other processes' rows up to date (`wsph.backend.domain.Halo`): ranges of the array
    itself, on a CPU without a copy."""

    def __init__(self, comm: Communicator, shares: Sequence[Share], rank: int):
        self._comm, mine = comm, shares[rank]
        self._into: list[tuple[int, slice]] = []
        self._out: list[tuple[int, slice]] = []
        for other, theirs in enumerate(shares):
            if other != rank:
                self._into += [(other, each) for each in _overlap(mine, theirs)]
                self._out += [(other, each) for each in _overlap(theirs, mine, mine.first)]

    def fill(self, *every: np.ndarray) -> None:
        waits = [self._comm.Irecv(rows[each], other, 3) for rows in every for other, each in self._into]
        waits += [self._comm.Isend(rows[each], other, 3) for rows in every for other, each in self._out]
        for each in waits:
            each.Wait()


class ChosenExchange(_Exchange):
    """Messages that keep chosen copies up to date (`wsph.backend.domain.ChosenHalo`), from wherever they stand."""

    def __init__(self, comm: Communicator, domain: Domain, shares: Sequence[Share]):
        self._comm, self._domain, self._shares = comm, domain, shares
        self._into: list[tuple[int, np.ndarray]] = []
        self._out: list[tuple[int, np.ndarray]] = []

    def choose(self, rows: np.ndarray) -> None:
        domain, mine = self._domain, self._shares[self._domain.rank]
        wanted = domain.joined(rows + mine.first)
        ends = np.cumsum(domain.joined(np.array([len(rows)])))
        self._into, self._out = [], []
        for other, theirs in enumerate(self._shares):
            if other == domain.rank:
                continue
            asked = wanted[ends[other - 1] if other else 0 : ends[other]]
            for found, each, owner in ((self._into, rows + mine.first, theirs), (self._out, asked, mine)):
                low, high = np.searchsorted(each, [owner.low, owner.high])
                if high > low:
                    found.append((other, each[low:high] - mine.first))

    def fill(self, *every: np.ndarray) -> None:
        # All that is for one process goes in one message, row by row.
        width = sum(widths(every))
        into = [np.empty((len(each), width), np.uint8) for _, each in self._into]
        out = [packed([rows[each] for rows in every]) for _, each in self._out]
        waits = [self._comm.Irecv(each, other, 3) for each, (other, _) in zip(into, self._into, strict=True)]
        waits += [self._comm.Isend(each, other, 3) for each, (other, _) in zip(out, self._out, strict=True)]
        for each in waits:
            each.Wait()
        for found, (_, each) in zip(into, self._into, strict=True):
            for rows, part in zip(every, unpacked(found, every), strict=True):
                rows[each] = part


def _overlap(holder: Share, owner: Share, first: int | None = None) -> list[slice]:
    """The rows that one process holds and another owns, numbered from `first` on, or as the holder has them."""
    low = max(holder.first, owner.low)
    high = min(holder.first + holder.held, owner.high)
    begin = holder.first if first is None else first
    return [slice(low - begin, high - begin)] if high > low else []
