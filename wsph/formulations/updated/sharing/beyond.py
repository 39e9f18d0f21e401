"""What a process does not hold of a body whose pairs follow the motion, and is to see: particles that came near.

A process holds the layers around its own. Particles of other layers that come near it learns of from their owners, who look
which of theirs are in the box around what it sees. Where there are any the body has to be made anew with more around.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from dataclasses import dataclass

import numpy as np

from wsph.backend.arrays import host
from wsph.backend.domain import Share, Split, any_of
from wsph.formulations.updated.sharing.anew import Anew, Remade
from wsph.sph.pairs import Pairs, find_pairs

NONE = (2**31, -(2**31))
"""Layers of nothing."""


@dataclass(frozen=True)
class Beyond:
    """What is beyond the layers that a process holds of a body called `body`, of which it has the part `split`: of the
    particles a `share`, in layers `layer` (n,)."""

    body: str
    split: Split
    share: Share
    layer: np.ndarray
    device: str

    def refuse(self, place: np.ndarray, seeing: np.ndarray, reach: float) -> None:
        """Raise Anew in all processes where one does not hold all that its own particles see within `reach`, and that
        these and other `seeing` ones (n,) bool see. All are at `place` (n, dim)."""
        missing = self._missing(place, seeing, reach)
        (first, last), (begin, end), (low, high) = missing, self.split.around, self.split.layers
        # And half as many as there are, so that it is not made anew too often.
        wanted = (
            first - 1 - (low - begin) // 2 if first < begin else begin,
            last + 2 + (end - high) // 2 if last >= end else end,
        )
        if any_of(self.split.domain, missing != NONE):
            raise Anew(self.body, Remade(wanted))

    def _missing(self, place: np.ndarray, seeing: np.ndarray, reach: float) -> tuple[int, int]:
        """The first and the last layer of what is missing."""
        near = self._near(place, seeing, reach)
        if not len(near):
            return NONE
        layer, there = near[:, 0], near[:, 1:]
        some = _seen(find_pairs(place[self.share.own], there, reach, self.device))
        every = np.concatenate([place[seeing], there[some]])
        some |= _seen(find_pairs(every, there, reach, self.device))
        return (int(layer[some].min()), int(layer[some].max())) if some.any() else NONE

    def _near(self, place: np.ndarray, seeing: np.ndarray, reach: float) -> np.ndarray:
        """Layer and place of the particles that others own, and this process does not hold, in the box around what it sees,
        (m, 1 + dim)."""
        share, domain, dim = self.share, self.split.domain, place.shape[1]
        mine = place[share.own]
        low = np.minimum(mine.min(0) - 2.0 * reach, place[seeing].min(0) - reach)
        high = np.maximum(mine.max(0) + 2.0 * reach, place[seeing].max(0) + reach)
        boxes = domain.joined(np.array([[low, high]]))
        held = domain.joined(np.array([[share.first, share.first + share.held]]))
        numbers = np.arange(share.low, share.high)
        sent: list[np.ndarray] = []
        for (low, high), (first, end) in zip(boxes, held.tolist(), strict=True):
            rows = np.zeros(0, int)
            if (mine.max(0) >= low).all() and (mine.min(0) <= high).all() and (share.low < first or share.high > end):
                inside = ((mine >= low) & (mine <= high)).all(1)
                rows = np.flatnonzero(inside & ((numbers < first) | (numbers >= end)))
            sent.append(np.column_stack([self.layer[share.own][rows], mine[rows]]).reshape(-1, 1 + dim))
        return np.concatenate(domain.passed(sent))


def _seen(pairs: Pairs) -> np.ndarray:
    """Which sources are in any pair, bool."""
    found = np.zeros(pairs.sources, bool)
    found[host(pairs.indices)] = True
    return found
