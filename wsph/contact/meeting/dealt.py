"""Contacts that processes deal out among themselves, of vertices of a surface that all of them have whole.

Which vertices may be near anything all know; every search deals them out anew, in ranges of as many each. A process finds
what acts on its own, and remembers it until the next search; of the others it is told what it needs.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import partial

import numpy as np
from numpy.typing import NDArray

from wsph.backend.arrays import host, put
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.reduce import total
from wsph.backend.space import Array
from wsph.ranks.packing import packed, unpacked

Rows = NDArray[np.int64]


class Dealt:
    """n contacts, each of one process. All processes call what tells or deals together.

    share  # those of this process: all are held, a range of them is its own
    """

    def __init__(self, n: int, clock: Clock, domain: Domain = WHOLE):
        """The first process has all, until they are dealt out."""
        self._clock, self._domain = clock, domain
        self.alone = domain.size == 1
        self._take([0, *[n] * domain.size])

    def _take(self, ends: list[int]) -> None:
        n, rank = ends[-1], self._domain.rank
        self.share = Share(n, 0, n, ends[rank], ends[rank + 1])
        self._halo = self._domain.chosen_halo(self.share)

    def deal(self, near: Rows) -> None:
        """Deal out those that are `near` anything (k,), ascending; others go where their neighbours go."""
        n, size = self.share.whole, self._domain.size
        if not self.alone:
            cuts = near[len(near) * np.arange(1, size) // size] if len(near) else np.full(size - 1, n)
            self._take([0, *(int(cut) for cut in cuts), n])

    @property
    def own(self) -> slice:
        """The range of this process's own."""
        return self.share.own

    def joined(self, rows: np.ndarray) -> np.ndarray:
        """The rows of all processes, in the order of the contacts that they are of."""
        return self._domain.joined(rows)

    def ask(self, wanted: Rows) -> None:
        """From now on be told of some (k,), ascending, of which others are not its own."""
        self._halo.choose(wanted[~self.share.owns(wanted)])

    def tell(self, *fields: Array) -> None:
        """Have what others own, of those asked for, in arrays over all contacts, in the middle of a step."""
        if not self.alone:
            self._clock.host(partial(self._halo.update, *fields))

    def gather(self, *fields: Array) -> None:
        """Have what others own of all in arrays over all contacts."""
        if not self.alone:
            self._clock.host(partial(self._gather, *fields))

    def _gather(self, *fields: Array) -> None:
        mine = [host(each) for each in fields]
        found = self._domain.joined(packed([each[self.own] for each in mine]))
        for each, rows in zip(fields, unpacked(found, mine), strict=True):
            put(each, rows)

    def total(self, values: Array) -> float:
        """The sum of an array over all contacts, in double precision."""
        return total(values, self._domain, self.own)

    def shares(self, names: list[str]) -> dict[str, Share]:
        """The part of kept arrays over all contacts that is this process's to keep, by their names."""
        return {} if self.alone else dict.fromkeys(names, self.share)
