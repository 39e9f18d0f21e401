"""Sparse matrices on the host, by rows."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

NOTHING = 1e-14
"""An entry below this is the rounding of none."""


@dataclass(frozen=True)
class SparseRows:
    """A sparse matrix: row i has `values` at the columns `indices`, ascending, from `offsets[i]` to `offsets[i + 1]`, of so
    many `columns`. offsets (rows + 1,), indices (entries,), values (entries,)."""

    offsets: np.ndarray
    indices: np.ndarray
    values: np.ndarray
    columns: int

    @classmethod
    def of(cls, entries: tuple[np.ndarray, np.ndarray, np.ndarray], shape: tuple[int, int]) -> "SparseRows":
        """From rows, columns and values (k,), which are summed where they stand at one place."""
        row, column, value = entries
        keys, place = np.unique(row.astype(np.int64) * shape[1] + column, return_inverse=True)
        total = np.bincount(place.ravel(), value, len(keys))
        there = np.abs(total) > NOTHING
        keys, total = keys[there], total[there]
        offsets = np.searchsorted(keys, np.arange(shape[0] + 1, dtype=np.int64) * shape[1])
        return cls(offsets, keys % shape[1], total, shape[1])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.offsets) - 1, self.columns

    @property
    def rows(self) -> np.ndarray:
        """The row of every entry, (entries,)."""
        return np.repeat(np.arange(self.shape[0]), np.diff(self.offsets))

    @property
    def T(self) -> "SparseRows":
        """The transpose."""
        return SparseRows.of((self.indices, self.rows, self.values), (self.columns, self.shape[0]))

    def __abs__(self) -> "SparseRows":
        return SparseRows(self.offsets, self.indices, np.abs(self.values), self.columns)

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        """Times x, (columns,) or (columns, k)."""
        if x.ndim == 1:
            return np.bincount(self.rows, self.values * x[self.indices], self.shape[0])
        return np.stack([self @ column for column in x.T], 1)

    def only(self, rows: np.ndarray) -> "SparseRows":
        """Some of the rows (k,), in their order."""
        offsets = np.concatenate([[0], np.cumsum(np.diff(self.offsets)[rows])])
        where = spread(self.offsets, rows)[1]
        return SparseRows(offsets, self.indices[where], self.values[where], self.columns)

    def dense(self) -> np.ndarray:
        """As an array (rows, columns)."""
        full = np.zeros(self.shape)
        full[self.rows, self.indices] = self.values
        return full


def among(n: int, *rows: np.ndarray) -> np.ndarray:
    """Which of n numbers stand in any of some arrays, ascending."""
    found = np.zeros(n, bool)
    for each in rows:
        found[each] = True
    return np.flatnonzero(found)


def spread(starts: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The entries of `rows` (k,) of a list of lists that begin at `starts` (n + 1,), one after the other: whose each is, an
    index into `rows`, and where it stands."""
    lengths = np.diff(starts)[rows]
    ends = np.cumsum(lengths)
    whose = np.repeat(np.arange(len(rows)), lengths)
    where = np.arange(ends[-1] if len(ends) else 0) + np.repeat(starts[rows] - (ends - lengths), lengths)
    return whose, where
