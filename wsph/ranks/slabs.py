"""Cuts of a body across the first axis of its grid, a slab of it a process; or across the layers of one without a grid
(`wsph.geometry.meshes.layers`), of which points are what cells are here.

Particles are numbered layer by layer, so that a slab is a range of numbers: what a process holds is an array over that
range, and rows and sums are in the order that they have in the whole. Slabs begin at whole blocks of particles
(`wsph.backend.reduce`), so that works, which are summed up block by block in every step, are those of one process.
"""

# pyright: strict

from dataclasses import dataclass, replace

import numpy as np

from wsph.backend.domain import Share
from wsph.backend.reduce import BLOCK
from wsph.errors import Refused


class TooFew(Refused):
    """A body that has too few particles to be cut for so many processes."""


@dataclass(frozen=True)
class Slab:
    """A slab of a body: the `layers` of cells that a process holds, from one up to another, and its shares of nodes and
    cells."""

    layers: tuple[int, int]
    nodes: Share
    cells: Share

    def around(self, layers: int) -> tuple[int, int]:
        """Its layers of cells, and two more on either side where the body, of so many `layers`, has them: the first says
        which faces have nothing behind them, and has volumes that are right where nodes are moved by what faces they are
        on."""
        return max(self.layers[0] - 2, 0), min(self.layers[1] + 2, layers)

    def over(self, layers: tuple[int, int], nodes: np.ndarray, cells: np.ndarray) -> "Slab":
        """The same with at least some layers, from one up to another, of a body with so many `nodes` (l + 1,) and `cells`
        (l,) in its layers."""
        window = max(min(self.layers[0], layers[0]), 0), min(max(self.layers[1], layers[1]), len(cells))
        first = [int(each[: window[0]].sum()) for each in (nodes, cells)]
        held = int(nodes[window[0] : window[1] + 1].sum()), int(cells[window[0] : window[1]].sum())
        shares = [
            replace(share, first=a, held=n) for share, a, n in zip((self.nodes, self.cells), first, held, strict=True)
        ]
        return Slab(window, *shares)


def slabs(nodes: np.ndarray, cells: np.ndarray, size: int, reach: int, *, joined: bool, who: str) -> list[Slab]:
    """The slabs of `size` processes, of bodies with so many `nodes` (l + 1,) and `cells` (l,) in their layers. A process
    holds `reach` layers beyond what it owns: so far does an acceleration depend on where others are. `joined`: the cells are
    particles too, which are summed up in whole blocks. Raises TooFew, naming the body, where there are too few."""
    layers = len(cells)
    before = [np.concatenate([[0], np.cumsum(each)]) for each in (nodes, cells)]
    goals = before[0][-1] * np.arange(1, size) / size
    cuts = np.concatenate([[0], np.rint(goals / BLOCK).astype(np.int64) * BLOCK, before[0][-1:]])
    at = np.searchsorted(before[0], cuts[1:-1], side="right") - 1
    behind = before[1][np.minimum(at, layers)]
    if joined:
        behind = np.rint(behind / BLOCK).astype(np.int64) * BLOCK
    behind = np.concatenate([[0], behind, before[1][-1:]])
    if (np.diff(cuts) <= 0).any() or (np.diff(behind) <= 0).any():
        raise TooFew(
            f"{who}: {before[0][-1]} particles in blocks of {BLOCK} are too few for {size} processes: start fewer"
        )
    found: list[Slab] = []
    for k in range(size):
        own = [(cuts[k], cuts[k + 1]), (behind[k], behind[k + 1])]
        first, last = _layers(before[0], *own[0])
        low, high = _layers(before[1], *own[1])
        # Of points that are no particles it is enough to have the corners.
        more = reach if joined else 0
        first, last = min(first - reach, low - more), max(last + reach, high + 1 + more)
        window = max(first, 0), min(last, layers)
        held = [(before[0][window[0]], before[0][window[1] + 1]), (before[1][window[0]], before[1][window[1]])]
        shares = [
            Share(int(whole[-1]), int(a), int(b - a), int(low), int(high))
            for whole, (a, b), (low, high) in zip(before, held, own, strict=True)
        ]
        found.append(Slab(window, *shares))
    return found


def _layers(before: np.ndarray, low: int, high: int) -> tuple[int, int]:
    """The first and the last layer of the rows from one up to another."""
    first, last = np.searchsorted(before, [low, high - 1], side="right") - 1
    return int(first), int(last)
