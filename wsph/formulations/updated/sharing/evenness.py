"""Whether the processes that share a body whose pairs follow the motion still have as much to do as each other.

Where a body is compressed particles see more of each other. Owners stay with the material until the process with most to do
has a fifth more than the mean: then the body is cut anew, by the pairs that there are, if that helps.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from dataclasses import dataclass

import numpy as np

from wsph.backend.domain import Domain
from wsph.formulations.updated.sharing.anew import Anew, Remade
from wsph.ranks.slabs import Cutting, work_of

UNEVEN = 1.2
"""What the process with most to do may have, over the mean."""

WORTH = 0.9
"""What it has after another cut, of that before, at most: to make a body anew takes seconds."""


@dataclass
class Evenness:
    """Of a body called `body`; `low`: the number of the first node that a process owns; `layer` (n,), that of each of its
    particles."""

    body: str
    cutting: Cutting
    low: int
    layer: np.ndarray
    domain: Domain
    _known = UNEVEN
    """The most, over the mean, up to which nothing is to be done."""

    def refuse(self, pairs: np.ndarray, work: float) -> None:
        """Raise Anew in all processes where the body is to be cut anew: own particles have so many `pairs` (n,), and the
        process visits as many as are its `work`."""
        most, mean = (
            float(self.domain.max(np.array(work))),
            float(self.domain.sum(np.array(round(work)))) / self.domain.size,
        )
        if most <= self._known * mean:
            return
        self._known = most / mean
        count = len(self.cutting.counts.visits)
        mine = np.bincount(self.layer.astype(np.int64), pairs, count)
        visits = self.domain.sum(mine.astype(np.int64)).astype(float)
        now = self.cutting.works(visits, self.domain.joined(np.array([self.low])))
        if max(work_of(self.cutting.slabs(visits))) <= WORTH * now.max():
            raise Anew(self.body, Remade(None, visits))
