"""Runs: rows of a lattice whose neighbours follow from those of the row before, by one.

Nodes and cells stand in the order of a grid, its last axis fastest. Along that axis the corners of one cell are those of the
cell before it plus one, so a run of cells needs one node a corner, and a run of nodes one cell a side. A run ends where a
line of the lattice does, at a hole, a notch or a crack. Long ones are cut into blocks, which is what kernels take: what
stands in a block is computed side by side.

Every node has a slot for the cell that it is the first corner of, whether there is one or not. What a cell hands to its
nodes stands in its slot; slots without a cell, and PAD before the first, hold zeros for ever. So a node at a face sees as
many slots as one inside, and is in the same run.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

HEAD = 3
"""Columns of a block before those of its neighbours: its first row, how many rows are its own, and over how many it may be
computed: whole vectors are faster than what is left of one, and rows that are not its own are read, never written."""

PAD = 64
"""Slots before those of the nodes, and behind them: as many as a block may have rows."""

VECTOR = 16
"""Rows that are computed together at most."""


@dataclass(frozen=True)
class Runs:
    """Blocks of rows: `table` (blocks, HEAD + k) int32, k the neighbours of a row, those of the first row of each block;
    `rows` in all."""

    table: np.ndarray
    rows: int

    @property
    def count(self) -> int:
        """Blocks."""
        return len(self.table)


def cell_runs(corners: np.ndarray, nodes: int, width: int) -> Runs:
    """Blocks of about `width` cells, whose neighbours are their `corners` (c, k) among so many `nodes`."""
    return _blocks(corners, (np.diff(corners, axis=0) == 1).all(1), width, nodes - corners.max(1))


def node_runs(corners: np.ndarray, nodes: int, width: int) -> Runs:
    """Blocks of about `width` nodes, whose neighbours are the slots of the cells that each is the first, second, ... corner
    of; 0, where there are zeros, of rows that all lack the same."""
    slots = np.full((nodes, corners.shape[1]), -1)
    for k, own in enumerate(corners.T):
        slots[own, k] = PAD + corners[:, 0]
    empty = np.ones(2 * PAD + nodes, bool)
    empty[PAD + corners[:, 0]] = False
    # At the end of a line the next slot along it is one without a cell.
    before, behind = np.full_like(slots, -1), np.full_like(slots, -1)
    before[1:], behind[:-1] = slots[:-1] + 1, slots[1:] - 1
    for near in (before, behind):
        fits = (slots < 0) & (near > 0)
        fits &= empty[near]
        slots[fits] = near[fits]
    missing = slots < 0
    follows = (np.diff(slots, axis=0) == 1) | (missing[1:] & missing[:-1])
    return _blocks(np.where(missing, 0, slots), follows.all(1), width, nodes - np.arange(nodes))


def _blocks(near: np.ndarray, follows: np.ndarray, width: int, ahead: np.ndarray) -> Runs:
    """Blocks of rows with neighbours `near` (n, k), of which row i + 1 follows row i where `follows` (n - 1,) says so. A run
    is cut every `width` rows, and what is left of it, less than that, goes with its last block. `ahead` (n,): how many rows
    may be computed from one on before what they take ends."""
    starts = np.concatenate([[0], 1 + np.flatnonzero(~follows)])
    lengths = np.diff(np.concatenate([starts, [len(near)]]))
    many = np.maximum(lengths // width, 1)
    within = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)
    first = np.repeat(starts, many) + within * width
    own = np.where(within == np.repeat(many, many) - 1, np.repeat(starts + lengths, many) - first, width)
    whole = -(-own // VECTOR) * VECTOR
    computed = np.where(whole <= ahead[first], whole, own)
    return Runs(np.column_stack([first, own, computed, near[first]]).astype(np.int32), len(near))
