"""Runs of blocks of neighbouring nodes (`wsph.formulations.lagrangian.blocks`), of two along every axis of a grid.

Along its last axis the members of a block are those of the one before plus two: a run says where the first one's are.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BlockRuns:
    """Runs of blocks, int32, a row each: how many blocks, and where the members of the first are, in the order of corners
    and -1 for none; `first` and `last` the outermost members of each run, `run` the run that each node is in."""

    runs: np.ndarray
    first: np.ndarray
    last: np.ndarray
    run: np.ndarray


def block_runs(index: np.ndarray, most: int) -> BlockRuns:
    """The runs, of at most so many blocks, of nodes at `index` (n, dim) in a grid, in its order."""
    place, dim = np.rint(index).astype(np.int64), index.shape[1]
    corner = (place % 2) @ 2 ** np.arange(dim)[::-1]
    place = place // 2
    place -= place.min(0)
    block = place[:, 0]
    for k in range(1, dim):
        block = block * (place[:, k].max() + 1) + place[:, k]
    keys, own = np.unique(block, return_inverse=True)
    members = np.full((len(keys), 2**dim), -1, np.int32)
    members[own, corner] = np.arange(len(own))
    line = keys // (place[:, -1].max() + 1)
    onward = (np.diff(members, axis=0) == 2) & (members[:-1] >= 0) | (members[:-1] < 0) & (members[1:] < 0)
    onward = onward.all(1) & (np.diff(keys) == 1) & (np.diff(line) == 0)
    begins = np.concatenate([[0], 1 + np.flatnonzero(~onward)])
    first = np.repeat(begins, np.diff(np.append(begins, len(keys))))
    first = np.flatnonzero((np.arange(len(keys)) - first) % most == 0)
    count = np.diff(np.append(first, len(keys)))
    low = np.minimum.reduceat(np.where(members < 0, len(own), members).min(1), first)
    high = np.maximum.reduceat(members.max(1), first)
    run = np.searchsorted(first, own, side="right") - 1
    runs = np.column_stack([count, members[first]]).astype(np.int32)
    return BlockRuns(runs, low, high, run)
