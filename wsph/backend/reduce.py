"""Reductions of device arrays to numbers on the host: the one room for them.

Kernels sum up blocks of BLOCK rows, a thread each, and the host the blocks, in their order: so a sum has the same bits for
any number of threads. The numbers of all parts of a scene are then put together by its `wsph.backend.domain.Domain`.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import WHOLE, Domain
from wsph.backend.space import Array
from wsph.reporting import Term

BLOCK = 1024
"""Rows that one thread sums up."""


def blocks(n: int) -> int:
    """Blocks of `n` rows."""
    return -(-n // BLOCK)


@dataclass(frozen=True)
class Segments:
    """Rows of several owners, in blocks of one owner each: so that what a kernel sums up for the whole it has for each of
    them. Row e of the blocks is row `order[e]` (n,); block b has rows `starts[b]` to `starts[b + 1]` (b + 1,), of
    `owner[b]` (b,)."""

    order: np.ndarray
    starts: np.ndarray
    owner: np.ndarray

    @classmethod
    def of(cls, owners: np.ndarray, each: int = BLOCK) -> "Segments":
        """The blocks, of at most `each` rows, of rows by their owners (n,), numbers not below -1."""
        order = np.argsort(owners, kind="stable")
        first = np.flatnonzero(np.diff(owners[order], prepend=-2))
        ends = np.append(first, len(owners))[1:]
        starts = [np.arange(a, b, each) for a, b in zip(first, ends, strict=True)]
        owner = np.repeat(owners[order][first], [len(part) for part in starts])
        return cls(order, np.concatenate([*starts, [len(owners)]]).astype(np.int32), owner)

    @property
    def count(self) -> int:
        """Blocks."""
        return len(self.owner)

    def terms(self, owner: int, sums: Array, names: Sequence[str]) -> dict[str, list[Term]]:
        """The sums of the columns `names` of `sums` (blocks, k) over the blocks of an owner; nothing where it has none."""
        mine, width = np.flatnonzero(self.owner == owner), int(sums.shape[1])
        if not len(mine):
            return {}
        return {name: [Term(sums, int(mine[0]) * width + k, len(mine), width)] for k, name in enumerate(names)}

    def none(self, sums: Array, names: Sequence[str]) -> dict[str, list[Term]]:
        """The sums over the blocks of an owner that has rows in other processes alone."""
        return {name: [Term(sums, 0, 0, max(len(names), 1))] for name in names}

    def whole(self, sums: np.ndarray, domain: Domain) -> np.ndarray:
        """The sums (blocks, k) of the blocks of all processes, in the order of their owners and of the processes."""
        if domain.size == 1:
            return sums
        return domain.joined(sums)[np.argsort(domain.joined(self.owner), kind="stable")]


def total(values: Array, domain: Domain = WHOLE, rows: slice | np.ndarray = slice(None)) -> float:
    """The sum of an array (n,), or of some `rows` of it, over all processes, in double precision."""
    return float(domain.joined(values.numpy()[rows]).sum(dtype=np.float64))


def totals(values: Array, domain: Domain = WHOLE) -> np.ndarray:
    """The sums over the rows of an array (n, k), (k,), in double precision."""
    return np.array([column.sum(dtype=np.float64) for column in domain.joined(values.numpy()).T])


def largest(values: Array, domain: Domain = WHOLE) -> float:
    """The largest element of an array (n,); NaN where any is."""
    return float(domain.max(np.asarray(values.numpy().max())))
