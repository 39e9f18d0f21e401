"""Where a body is cut for several processes, so that each has as much to do: by the pairs that it will visit, counted.

A process works on all that it holds, its own and what lies around it: one between two others has more of that than one at an
end. So places to cut at have two numbers, what comes before a part that begins there and before one that ends there, and
what a part has to do is the difference of the two.
"""

# pyright: strict

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wsph.backend.reduce import BLOCK

EXACT = 1e-9
"""Part of the most that a process has to do to which it is found."""


@dataclass(frozen=True)
class Counts:
    """Layers of a body one after the other: how many `nodes` (l + 1,) and points, or cells, (l,) each has, and the `visits`
    (l,) of pairs, from its points and back to them, in a right-hand side."""

    nodes: np.ndarray
    points: np.ndarray
    visits: np.ndarray

    @classmethod
    def of_cells(cls, nodes: np.ndarray, cells: np.ndarray, dim: int) -> "Counts":
        """Those of layers of cells of a grid: rows of these have all of their corners, and rows of nodes as many places."""
        return cls(nodes, cells, 2.0**dim * (cells + between(nodes)))

    def visited(self, visits: np.ndarray) -> "Counts":
        """The same with other visits (l,), as many in all as there were: what bodies have to do is compared."""
        return replace(self, visits=visits * (self.visits.sum() / visits.sum()))


def between(nodes: np.ndarray) -> np.ndarray:
    """Numbers of layers of nodes (l + 1,) as those of what is between them, (l,)."""
    return 0.5 * (nodes[:-1] + nodes[1:])


@dataclass(frozen=True)
class Reach:
    """What a process needs of a body around what it owns: it holds so many `layers` more, and works on them. `joined`:
    particles are their own points. `stressed`: of a body whose pairs follow the motion, layers more in which it finds the
    stress; it works on no others. `beyond`: layers that it holds beyond those, for what comes near. `seen`: of two sets of
    particles, the layers of points that one of its own sees on either side; it works on its own particles and on the points
    that these see."""

    layers: int
    joined: bool
    stressed: int | None = None
    beyond: int = 0
    seen: int | None = None

    def around(self, layers: tuple[int, int]) -> tuple[int, int]:
        """The layers that it holds around some."""
        return layers[0] - self.beyond, layers[1] + self.beyond


@dataclass(frozen=True)
class Places:
    """Places at which a body may be cut, at the ends of blocks of nodes (p,): how many nodes and how many points (p,) are
    before each; the first layer that a part that begins there holds, and the layer up to which one that ends there does;
    `opened` and `closed` (p,), the visits before the one and before the other."""

    nodes: np.ndarray
    points: np.ndarray
    first: np.ndarray
    last: np.ndarray
    opened: np.ndarray
    closed: np.ndarray

    @classmethod
    def of(cls, body: Counts, reach: Reach) -> "Places":
        """Those of a body; of particles that are their own points these are cut at whole blocks too."""
        layers = len(body.points)
        nodes, points, visits = (
            np.concatenate([[0], np.cumsum(each)]) for each in (body.nodes, body.points, body.visits)
        )
        count = int(nodes[-1])
        cuts = np.append(np.arange(0, count, BLOCK), count)
        starts, ends = _layers(nodes, cuts)
        behind = points[np.minimum(starts, layers)]
        if reach.joined:
            there = np.interp(cuts, nodes, np.append(points, points[-1]))
            behind = np.minimum(np.rint(there / BLOCK).astype(np.int64) * BLOCK, points[-1])
        behind[0], behind[-1] = 0, points[-1]
        low, high = _layers(points, behind)
        # Of points that are no particles it is enough to have the corners.
        more = reach.layers if reach.joined else 0
        first = np.maximum(np.minimum(starts - reach.layers, low - more), 0)
        last = np.minimum(np.maximum(ends + reach.layers, high + 1 + more), layers)
        opened, closed = visits[first], visits[last]
        if reach.stressed is not None:  # two launches of three are over what it sees too
            own = np.interp(behind, points, visits)
            seen = np.maximum(low - reach.stressed, 0), np.minimum(high + 1 + reach.stressed, layers)
            sees = np.minimum(first, seen[0]), np.maximum(last, seen[1])
            opened, closed = ((own + 2.0 * visits[each]) / 3.0 for each in sees)
        if reach.seen is not None:  # one launch of two is over its own particles, the other over points that they see
            along, own = np.interp(cuts, nodes, np.arange(layers + 2)), np.interp(behind, points, visits)
            at = np.arange(layers + 1)
            mine = np.interp(along * layers / (layers + 1), at, visits)
            opened = 0.5 * (mine + np.minimum(own, np.interp(along - reach.seen, at, visits)))
            closed = 0.5 * (mine + np.maximum(own, np.interp(along + reach.seen - 1, at, visits)))
        return cls(cuts, behind, first, last, opened, closed)

    def even(self, loads: np.ndarray) -> np.ndarray | None:
        """The places (size + 1,), from the first to the last, between which processes that have `loads` (size,) already
        have at most the least that is possible, and little more where parts are as thin as a layer; None where there are
        too few."""
        group: np.ndarray = np.unique(self.points, return_inverse=True)[1]
        if group[-1] < len(loads):
            return None

        def tried(most: float) -> tuple[np.ndarray, np.ndarray] | None:
            """The largest places with that much to do, and from the other end the least."""
            high = _filled(self.opened, self.closed, group, loads, most)
            low = _filled(-self.closed[::-1], -self.opened[::-1], group[-1] - group[::-1], loads[::-1], most)
            return None if high is None or low is None else (len(group) - 1 - low[::-1], high)

        least, most = 0.0, (1.0 + EXACT) * float(self.closed[-1] + loads.max())
        found = tried(most)
        while found is not None and most - least > EXACT * most:
            middle = 0.5 * (least + most)
            again = tried(middle)
            least, most, found = (middle, most, found) if again is None else (least, middle, again)
        return None if found is None else self._between(*found, group, loads, most)

    def _between(
        self, low: np.ndarray, high: np.ndarray, group: np.ndarray, loads: np.ndarray, most: float
    ) -> np.ndarray:
        """Places between the least and the largest, none of which leaves a process more to do than the `most`: what is left
        to choose is shared out."""
        size, chosen = len(loads), [0]
        for k, load in enumerate(loads[:-1].tolist(), start=1):
            reached = _up_to(self.closed, most - load + float(self.opened[chosen[-1]]))
            chosen.append(min(int(np.rint(low[k] + (high[k] - low[k]) * (size - k) / size)), reached))
        chosen.append(len(group) - 1)
        return np.array(chosen) if (np.diff(group[chosen]) > 0).all() else high


def _layers(before: np.ndarray, cuts: np.ndarray) -> Sequence[np.ndarray]:
    """The layers of the rows behind some cuts, and before them, where layers have so many rows `before` them."""
    return [np.searchsorted(before, rows, side="right") - 1 for rows in (cuts, cuts - 1)]


def _up_to(values: np.ndarray, most: float) -> int:
    """The last of ascending values that is no more than so much; -1 where there is none."""
    return int(np.searchsorted(values, most, side="right")) - 1


def _filled(
    opened: np.ndarray, closed: np.ndarray, group: np.ndarray, loads: np.ndarray, most: float
) -> np.ndarray | None:
    """The places that there are where one process after the other has as much as it may, `most`, and points are left for
    all; None where that leaves some over."""
    left, found = len(loads), [0]
    for load in loads.tolist():
        at, left = found[-1], left - 1
        end = min(_up_to(closed, most - load + float(opened[at])), _up_to(group, group[-1] - left))
        if end <= at or group[end] <= group[at]:
            return None
        found.append(end)
    return np.array(found) if found[-1] == len(group) - 1 else None
