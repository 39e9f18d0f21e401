"""Where the rows of an array that a process keeps stand in that of all processes."""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Domain, Share
from wsph.backend.reduce import BLOCK, blocks


@dataclass(frozen=True)
class Rows:
    """Rows of an array: of `whole` rows those at `places` (n,) are here, and of these those that are its `own` (n,) bool are
    for this process to keep."""

    whole: int
    places: np.ndarray
    own: np.ndarray

    @classmethod
    def of(cls, share: Share) -> "Rows":
        """Those of a share."""
        rows = np.arange(share.held)
        return cls(share.whole, share.first + rows, share.owns(rows))

    @classmethod
    def of_blocks(cls, share: Share) -> "Rows":
        """Those of the blocks of a share's own rows, which begin with a whole one."""
        places = np.arange(share.low // BLOCK, blocks(share.high))
        return cls(blocks(share.whole), places, np.ones(len(places), bool))

    @classmethod
    def alike(cls, n: int, domain: Domain) -> "Rows":
        """All of n rows that every process has alike: the first keeps them."""
        return cls(n, np.arange(n), np.full(n, domain.rank == 0))

    @classmethod
    def by_keys(cls, keys: np.ndarray, own: np.ndarray, domain: Domain) -> "Rows":
        """Rows that stand in the order of their keys (n, k), the last of which ascend from one process to the next. Rows of
        others have the keys that those have."""
        mine, counts = domain.joined(keys[own]), domain.joined(np.array([np.count_nonzero(own)]))
        order = np.lexsort(mine.T[::-1])
        known, place = mine[order], np.arange(len(mine))
        if own.all():
            first = int(counts[: domain.rank].sum())
            found = np.empty(len(mine), int)
            found[order] = place
            return cls(len(mine), found[first : first + len(keys)], own)
        if keys.shape[1] == 1:
            return cls(len(mine), np.searchsorted(known[:, 0], keys[:, 0]), own)
        same = (keys[:, None, :] == known[None, :, :]).all(2) if len(keys) * len(known) < 2**22 else None
        if same is not None:
            return cls(len(mine), same.argmax(1), own)
        numbers = {tuple(row): k for k, row in enumerate(known.tolist())}
        return cls(len(mine), np.array([numbers[tuple(row)] for row in keys.tolist()], int), own)


@dataclass(frozen=True)
class Piece:
    """A piece of a flat array: from `start` on `width` numbers a row; of an array by itself, with rows of any shape, `width`
    is zero."""

    start: int
    width: int
    rows: Rows

    def of(self, array: np.ndarray) -> np.ndarray:
        """Its rows in an array."""
        if not self.width:
            return array
        count = len(self.rows.places)
        return array[self.start : self.start + count * self.width].reshape(count, self.width)


def localised(whole: np.ndarray, pieces: Sequence[Piece]) -> np.ndarray:
    """The part of an array of all processes that is kept here."""
    if not pieces[0].width:
        return whole[pieces[0].rows.places]
    found: list[np.ndarray] = []
    start = 0
    for piece in pieces:
        end = start + piece.rows.whole * piece.width
        found.append(whole[start:end].reshape(-1, piece.width)[piece.rows.places].ravel())
        start = end
    return np.concatenate(found)
