"""Blocks in pieces, so that what one loop hands to the next stays in the cache of a core, shared out to threads.

A right-hand side is stages, each over blocks of its own: cells, then the nodes that take of these. Each thread has a run of
the blocks of the first stage, and goes through it piece by piece, each stage as far as all that it takes of has been; it
waits for no other. What takes of the runs of two threads is left until all have ended: a layer of the body at each cut.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays, host
from wsph.backend.clock import Clock
from wsph.backend.space import Array

FEW = 3
"""Spans that are left, of one stage, which are launched one after the other."""


@dataclass(frozen=True)
class Takes:
    """Of every block of a stage the `first` and the `last` block of the stage before that it takes of, (b,) each."""

    first: np.ndarray
    last: np.ndarray

    @classmethod
    def of_rows(cls, low: np.ndarray, high: np.ndarray, starts: np.ndarray, taken: np.ndarray) -> "Takes":
        """Of blocks that start at some rows, whose rows take of those from `low` to `high` (n,), which stand in blocks that
        start at those of `taken`."""
        found = np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)
        return cls(*(np.searchsorted(taken, each, side="right") - 1 for each in found))


Spans = list[tuple[int, int]]
"""From which to which block."""


@dataclass(frozen=True)
class Pieces:
    """The pieces of each of the `parts` that threads have, in their order, with the span of each stage in it; and for each
    stage those that are `left` until all parts have ended, one at each cut."""

    parts: list[list[Spans]]
    left: list[Spans]


def pieces_of(count: int, most: int, stages: Sequence[Takes], threads: int) -> Pieces:
    """The pieces, of at most `most` blocks, of stages the first of which has `count` blocks; `stages` are those that follow.
    Few blocks are one part."""
    parts = threads if count > most * threads else 1
    cuts = np.arange(parts + 1) * count // parts
    low, ends = cuts[:-1], [np.append(np.arange(a + most, b, most), b) for a, b in pairwise(cuts)]
    found = [[_spans(start, each)] for start, each in zip(low.tolist(), ends, strict=True)]
    left: list[Spans] = [[]]
    for takes in stages:
        first, last = np.minimum.accumulate(takes.first[::-1])[::-1], np.maximum.accumulate(takes.last)
        ends = [np.searchsorted(last, each, side="left") for each in ends]
        low = np.searchsorted(first, low, side="left")
        # Blocks that take of nothing are anybody's.
        low[1:] = np.maximum(low[1:], [each[-1] for each in ends[:-1]])
        ends = [np.maximum(each, a) for a, each in zip(low, ends, strict=True)]
        between = zip(ends[:-1], low[1:].tolist(), strict=True)
        left.append([(int(each[-1]), end) for each, end in between if end > each[-1]])
        for spans, start, each in zip(found, low.tolist(), ends, strict=True):
            spans.append(_spans(start, each))
    return Pieces([[list(piece) for piece in zip(*spans, strict=True)] for spans in found], left)


def _spans(low: int, ends: np.ndarray) -> Spans:
    """The spans from `low` on that end one after the other."""
    return list(zip([low, *ends[:-1].tolist()], ends.tolist(), strict=True))


@dataclass(frozen=True)
class Table:
    """Blocks on the device: `rows`, flat, of so many `columns`."""

    rows: Array
    columns: int

    @classmethod
    def of(cls, blocks: np.ndarray, arrays: Arrays, name: str) -> "Table":
        """Blocks (b, columns) int32 in an array of that name."""
        return cls(arrays.of(name, blocks.ravel(), wp.int32), blocks.shape[1])

    @property
    def count(self) -> int:
        """How many blocks there are."""
        return len(self.rows) // self.columns

    @property
    def blocks(self) -> np.ndarray:
        """The blocks on the host, (b, columns); on a CPU a view."""
        return host(self.rows).reshape(-1, self.columns)

    def part(self, first: int, end: int) -> Array:
        """The rows of some blocks."""
        return cast(Array, self.rows[first * self.columns : end * self.columns])


Loop = Callable[[Array, int], None]
"""Launches the kernels of a stage, over the rows of so many blocks."""


class Order:
    """The stages of a right-hand side over their pieces. `table`: the blocks of the first stage; `after`: those of each that
    follows, and what they take; `most` as `pieces_of` has it."""

    def __init__(
        self,
        table: Table,
        after: Sequence[tuple[Table, Takes]],
        most: int,
        threads: int,
        arrays: Arrays,
        name: str,
    ):
        self._tables = [table, *(each for each, _ in after)]
        self._pieces = pieces_of(table.count, most, [takes for _, takes in after], threads)
        self._left = [
            _left(table, spans, arrays, f"{name} {k}")
            for k, (table, spans) in enumerate(zip(self._tables, self._pieces.left, strict=True))
        ]

    def run(self, loops: Sequence[Loop], clock: Clock) -> None:
        """Launch the stages by the loops of each."""
        clock.apart([partial(self._run, loops, part) for part in self._pieces.parts])
        for loop, left in zip(loops, self._left, strict=True):
            for rows, blocks in left:
                loop(rows, blocks)

    def _run(self, loops: Sequence[Loop], pieces: list[Spans]) -> None:
        for piece in pieces:
            for loop, table, (first, end) in zip(loops, self._tables, piece, strict=True):
                if end > first:
                    loop(table.part(first, end), end - first)


def _left(table: Table, spans: Spans, arrays: Arrays, name: str) -> list[tuple[Array, int]]:
    """Rows of some blocks of a table, and how many: a few spans as they stand there, or all in a table of their own."""
    if len(spans) <= FEW:
        return [(table.part(first, end), end - first) for first, end in spans]
    own = Table.of(np.concatenate([table.blocks[first:end] for first, end in spans]), arrays, name)
    return [(own.rows, own.count)]
