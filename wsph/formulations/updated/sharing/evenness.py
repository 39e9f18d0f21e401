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
        cutting, domain = self.cutting, self.domain
        # In pairs as there were at the start, which what other bodies have to do is in too.
        now = domain.joined(np.array([[float(pairs.sum()), work]]))
        others = np.zeros(domain.size) if cutting.loads is None else cutting.loads
        works = now[:, 1] * float(cutting.counts.visits.sum()) / max(now[:, 0].sum(), 1.0) + others
        if works.max() <= self._known * works.mean():
            return
        self._known = float(works.max() / works.mean())
        # A body has a layer of nodes more than of points.
        layer = np.minimum(self.layer.astype(np.int64), len(cutting.counts.visits) - 1)
        mine = np.bincount(layer, pairs, len(cutting.counts.visits))
        visits = domain.sum(mine.astype(np.int64)).astype(float)
        before = cutting.works(visits, domain.joined(np.array([self.low]))) + others
        if (np.array(work_of(cutting.slabs(visits))) + others).max() <= WORTH * before.max():
            raise Anew(self.body, Remade(None, visits))
