"""Sums over the rows that a process owns, put together as one process finds them: block by block, in their order."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Domain, Share
from wsph.backend.reduce import BLOCK, total
from wsph.backend.space import Array


@dataclass(frozen=True)
class Blocks:
    """The blocks of a share of rows. Those that have rows of other processes too are cut into single rows, so that the sums
    of all processes are put together as those of one: `starts` (b + 1,) of each among its own rows, and `numbers` (b,) of
    the block of the whole that it is of, or is a part of."""

    starts: np.ndarray
    numbers: np.ndarray

    @classmethod
    def of(cls, share: Share) -> "Blocks":
        """The blocks of a share's own rows."""
        low, high = share.low, share.high
        first, last = -(-low // BLOCK) * BLOCK, high if high == share.whole else high // BLOCK * BLOCK
        if first >= last:
            starts = np.arange(low, high)
        else:
            starts = np.concatenate([np.arange(low, first), np.arange(first, last, BLOCK), np.arange(last, high)])
        return cls(np.append(starts, high) - low, starts // BLOCK)

    @property
    def count(self) -> int:
        """Blocks and parts of them."""
        return len(self.numbers)

    def whole(self, sums: np.ndarray, domain: Domain) -> np.ndarray:
        """The sums (blocks, k) of the blocks of the whole, from those (b, k) of the blocks here."""
        if domain.size == 1:
            return sums
        numbers, rows = domain.joined(self.numbers), domain.joined(sums)
        found = np.zeros((int(numbers.max()) + 1 if len(numbers) else 0, *rows.shape[1:]), rows.dtype)
        np.add.at(found, numbers, rows)  # one after the other
        return found

    def of_rows(self, values: np.ndarray, domain: Domain) -> np.ndarray:
        """The sums of the blocks of the whole of numbers (n,) of its own rows, in double precision, one after the other."""
        block = np.repeat(np.arange(self.count), np.diff(self.starts))
        return self.whole(np.bincount(block, values, self.count), domain)


class Dots:
    """Scalar products of vectors over the particles of a body, of which a process has those of the particles that it
    holds: in double precision, block by block of those that processes own, which begin with whole ones. No BLAS, whose
    threads take longer to start than these sums, and change their last bits. All processes ask for them together."""

    def __init__(self, share: Share, domain: Domain, width: int):
        """Of vectors of `width` numbers a particle."""
        self.whole, self._domain = share.whole * width, domain
        low, high, each = share.own.start * width, share.own.stop * width, BLOCK * width
        self._blocks = [slice(begin, min(begin + each, high)) for begin in range(low, high, each)]

    def one(self, a: np.ndarray, b: np.ndarray) -> float:
        """That of a (n,) and b (n,)."""
        sums = [np.einsum("n,n->", a[rows], b[rows], dtype=np.float64) for rows in self._blocks]
        return float(self._domain.joined(np.array(sums)).sum())

    def every(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Those of a (n,) and the rows of b (m, n), (m,)."""
        sums = np.zeros((len(self._blocks), len(b)))
        for k, rows in enumerate(self._blocks):
            sums[k] = np.einsum("n,jn->j", a[rows], np.ascontiguousarray(b[:, rows]), dtype=np.float64)
        return self._domain.joined(sums).sum(0)

    def products(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Those of the rows of a (k, n) and the rows of b (m, n), (k, m)."""
        return np.array([self.every(row, b) for row in a]).reshape(len(a), len(b))


def own_total(values: Array, first: np.ndarray, share: Share, domain: Domain) -> float:
    """The sum of an array (b,) over blocks of rows of which the `first` (b,) is one that a process owns, in double
    precision."""
    return total(values, domain, share.owns(first))


def own_mean(values: np.ndarray, share: Share, domain: Domain) -> np.ndarray:
    """The mean (k,) of the own rows of all processes of numbers (n, k) of a share."""
    return np.array([own_sum(column, share, domain) for column in values.T]) / share.whole


def own_sum(values: np.ndarray, share: Share, domain: Domain) -> float:
    """The sum of the own rows of all processes of numbers (n,) of a share, block by block, in double precision; where one
    process has all of them, they may be those of the first rows alone."""
    if domain.size == 1:
        share = Share.all(len(values))
    return float(Blocks.of(share).of_rows(values[share.own], domain).sum())
