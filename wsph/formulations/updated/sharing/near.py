"""Which particles of a body a process works on, of those that it shares with others: its own, and what these see.

A process holds its own particles and layers around them, and the pairs of some of these. The acceleration of a particle
takes the stresses of what it sees, and those the motion of what that sees. So a process finds the accelerations of its own
particles, the stresses of these and of what they see, and is told the accelerations of what all of those see: these copies
then go their way as with their owners, to the bit. The others stay behind until pairs are found anew, for which all that
copies have is brought up to date. What comes near and is no copy has to become one (`beyond`, beside this).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import warp as wp

from wsph.backend.arrays import host
from wsph.backend.domain import Share
from wsph.formulations.updated.sharing.beyond import Beyond
from wsph.formulations.updated.sharing.evenness import Evenness
from wsph.sph.pairs import Pairs

Sights = Sequence[tuple[Pairs, np.ndarray | None]]
"""Pairs of particles with what they see, and of images (m,) the particles that these are of."""


def seen_by(rows: np.ndarray, sights: Sights) -> np.ndarray:
    """Some particles (n,) bool and all that they see, (n,) bool."""
    found = rows.copy()
    for pairs, parent in sights:
        there = host(pairs.indices)[np.repeat(rows, np.diff(host(pairs.offsets)))]
        found[there if parent is None else parent[there]] = True
    return found


def marked(n: int, *some: slice) -> np.ndarray:
    """Some of n particles, (n,) bool."""
    found = np.zeros(n, bool)
    for each in some:
        found[each] = True
    return found


def _with(own: Pairs, others: Pairs, low: int) -> Pairs:
    """Rows from `low` on, and rows before and behind them, as one."""
    before = int(host(others.offsets)[low])
    rest, device = host(others.indices), own.offsets.device
    indices = np.concatenate([rest[:before], host(own.indices), rest[before:]])
    offsets, reach = (host(a) + host(b) for a, b in ((own.offsets, others.offsets), (own.reach, others.reach)))
    return replace(
        own,
        offsets=wp.array(offsets, dtype=wp.int32, device=device),
        indices=wp.array(indices, dtype=wp.int32, device=device),
        reach=wp.array(reach, dtype=wp.float64, device=device),
    )


class Near:
    """The particles that a process works on, as ranges of those that it holds: its `own`, those whose `stress` it finds, and
    all that are to `move`. Of a body of one process they are all of it.

    `halo` keeps up to date what others own of these. `right`: particles whose state is to be that of their owners, whoever
    sees them.
    """

    def __init__(self, share: Share, right: slice | None, beyond: Beyond, evenness: Evenness | None):
        self._share, self._right, self._beyond, self._evenness = share, right or share.own, beyond, evenness
        self.halo = beyond.split.domain.chosen_halo(share)
        self.own, self.stress, self.move = share.own, slice(0, share.held), slice(0, share.held)

    def find(self, look: Callable[[np.ndarray | None], Sights], place: np.ndarray, reach: float) -> Sights:
        """What particles see, where a `look` gives that of some of them (n,) bool, or of all: nothing beyond a `reach` from
        their `place` (n, dim). All processes find it together. Raises Anew where one does not hold all of it."""
        if self._share.complete:
            return look(None)
        mine = marked(self._share.held, self.own)
        first = look(mine)
        stress = seen_by(mine, first) | marked(self._share.held, self._right)
        self._beyond.refuse(place, stress, reach)
        rest = look(stress & ~mine)
        found = [(_with(a, b, self.own.start), parent) for (a, parent), (b, _) in zip(first, rest, strict=True)]
        self._pairs = np.sum([np.diff(host(pairs.offsets)) for pairs, _ in found], 0)
        move = seen_by(stress, found)
        self.stress, self.move = _range(stress), _range(move)
        self.halo.choose(np.flatnonzero(move & ~mine))
        return found

    def refuse_uneven(self) -> None:
        """Raise Anew in all processes where the body is to be cut anew, by the pairs that were found last."""
        if self._evenness is not None:
            own, seen = self._pairs[self.own].sum(), self._pairs[self.stress].sum()
            # Two launches of three are over all whose stress it finds.
            self._evenness.refuse(self._pairs[self.own], (own + 2.0 * seen) / 3.0)


def _range(rows: np.ndarray) -> slice:
    """The range that some particles (n,) bool are in."""
    first, last = np.flatnonzero(rows)[[0, -1]]
    return slice(int(first), int(last) + 1)
