"""Cuts of a body across the first axis of its grid, a slab of it a process; or across the layers of one without a grid
(`wsph.geometry.meshes.layers`), of which points are what cells are here.

Particles are numbered layer by layer, so that a slab is a range of numbers: what a process holds is an array over that
range, and rows and sums are in the order that they have in the whole. Slabs begin at whole blocks of particles
(`wsph.backend.reduce`), so that works, which are summed up block by block in every step, are those of one process; which
of them is chosen by what each process has to do (`wsph.ranks.cuts`).
"""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from wsph.backend.domain import Share
from wsph.backend.reduce import BLOCK
from wsph.errors import Refused
from wsph.ranks.cuts import Counts, Places, Reach

NOTHING = (2**31, 0)
"""Layers that take nothing beyond what a slab has."""


class TooFew(Refused):
    """A body that has too few particles to be cut for so many processes."""


@dataclass(frozen=True)
class Slab:
    """A slab of a body: the `layers` of cells that a process holds, from one up to another, its shares of nodes and cells,
    and the pairs that it visits in a right-hand side, `work`."""

    layers: tuple[int, int]
    nodes: Share
    cells: Share
    work: float

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
        nodes_share, cells_share = (
            replace(share, first=a, held=n) for share, a, n in zip((self.nodes, self.cells), first, held, strict=True)
        )
        return replace(self, layers=window, nodes=nodes_share, cells=cells_share)

    def within(self, wide: "Slab") -> tuple[slice, slice]:
        """Its nodes and cells among those of a slab that has them and more."""
        pairs = (self.nodes, wide.nodes), (self.cells, wide.cells)
        nodes, cells = (slice(own.first - of.first, own.first - of.first + own.held) for own, of in pairs)
        return nodes, cells


def slabs(body: Counts, size: int, reach: Reach, *, who: str, loads: np.ndarray | None = None) -> list[Slab]:
    """The slabs of `size` processes of a body, which leave the largest of what they have to do as small as it can be, beside
    the `loads` (size,) that each has of others [visits]. Raises TooFew, naming the body, where it has too few particles."""
    places = Places.of(body, reach)
    chosen = places.even(np.zeros(size) if loads is None else loads)
    if chosen is None:
        raise TooFew(
            f"{who}: {places.nodes[-1]} particles in blocks of {BLOCK} are too few for {size} processes: start fewer"
        )
    before = [np.concatenate([[0], np.cumsum(each)]) for each in (body.nodes, body.points)]
    found: list[Slab] = []
    for a, b in pairwise(chosen.tolist()):
        window = int(places.first[a]), int(places.last[b])
        held = [(before[0][window[0]], before[0][window[1] + 1]), (before[1][window[0]], before[1][window[1]])]
        own = [(places.nodes[a], places.nodes[b]), (places.points[a], places.points[b])]
        nodes, cells = (
            Share(int(whole[-1]), int(first), int(end - first), int(low), int(high))
            for whole, (first, end), (low, high) in zip(before, held, own, strict=True)
        )
        found.append(Slab(window, nodes, cells, float(places.closed[b] - places.opened[a])))
    return found


@dataclass(frozen=True)
class Cutting:
    """How a body is cut: as `slabs` takes it."""

    counts: Counts
    size: int
    reach: Reach
    who: str
    loads: np.ndarray | None

    def slabs(self, visits: np.ndarray | None = None) -> list[Slab]:
        """The slabs of all processes, by the pairs that there are at the start, or by other `visits` (l,) of layers. Raises
        TooFew."""
        counts = self.counts if visits is None else self.counts.visited(visits)
        return slabs(counts, self.size, self.reach, who=self.who, loads=self.loads)

    def works(self, visits: np.ndarray, lows: np.ndarray) -> np.ndarray:
        """The pairs that processes visit whose nodes begin at the numbers `lows` (size,), by `visits` (l,) of layers."""
        places = Places.of(self.counts.visited(visits), self.reach)
        at = np.append(np.searchsorted(places.nodes, lows), len(places.nodes) - 1)
        return places.closed[at[1:]] - places.opened[at[:-1]]


def work_of(found: Sequence[Slab]) -> tuple[float, ...]:
    """The pairs that each process visits."""
    return tuple(each.work for each in found)
