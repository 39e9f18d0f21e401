"""The cells of a body that a process owns, by the numbers that they have in the whole body."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Share
from wsph.geometry.geometry import Geometry


@dataclass(frozen=True)
class OwnCells:
    """Of every block of cells the range `rows` of those here that are its own; of all of these, block by block, their
    `numbers` (c,) in the whole body, which ascend; of those sorted by the first of their points, in `order` (c,), the
    `share` that they are of all."""

    rows: tuple[slice, ...]
    numbers: np.ndarray
    order: np.ndarray
    share: Share

    @classmethod
    def of(cls, geometry: Geometry) -> "OwnCells":
        """Those of a part of a body. All processes that share it ask together."""
        domain, first, rows = geometry.split.domain, list[np.ndarray](), list[slice]()
        for own, points in zip(geometry.own_cells, geometry.points_of_cells, strict=True):
            start, count = int(own.argmax()) if len(own) else 0, int(np.count_nonzero(own))
            rows.append(slice(start, start + count))  # cells of a block are in the order of their first points
            first.append(points[rows[-1]].min(1))
        counts = domain.joined(np.array([[len(each) for each in first]]))
        before, every = counts[: domain.rank].sum(0), counts.sum(0)
        starts = np.cumsum(every) - every + before
        numbers = np.concatenate([start + np.arange(len(each)) for start, each in zip(starts, first, strict=True)])
        order, low = np.argsort(np.concatenate(first), kind="stable"), int(before.sum())
        return cls(tuple(rows), numbers, order, Share(int(every.sum()), low, len(numbers), low, low + len(numbers)))

    @property
    def whole(self) -> int:
        """Cells of the whole body."""
        return self.share.whole

    def blocks(self, geometry: Geometry) -> list[tuple[np.ndarray, slice]]:
        """Corners of its own cells of every block (c, k), nodes here, and their range among all of its own."""
        ends = np.cumsum([0, *(rows.stop - rows.start for rows in self.rows)]).tolist()
        return [
            (corners[rows], slice(a, b))
            for corners, rows, a, b in zip(geometry.blocks, self.rows, ends[:-1], ends[1:], strict=True)
        ]

    def among(self, numbers: np.ndarray) -> np.ndarray:
        """Which of its own are among some cells of the whole body (k,), (c,) bool."""
        found = np.zeros(len(self.numbers), bool)
        at = np.searchsorted(self.numbers, numbers)
        there = at < len(self.numbers)
        there[there] = self.numbers[at[there]] == numbers[there]
        found[at[there]] = True
        return found
