"""The part of a body of two sets that a process has.

A process holds what its steps read beyond its own (`wsph.formulations.taylor.set_up`). Its steps change its own real
particles, and the virtual ones that these see; then it is told the state of the others' real particles: messages once a
step. Rows are in the order of the whole body, so that what two processes compute has the same bits in both.
"""

# pyright: strict

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.domain import Share, Split
from wsph.backend.state import State
from wsph.boundary.conditions import Conditions
from wsph.formulations.taylor.operators import Operator
from wsph.formulations.taylor.set_up import joined
from wsph.ranks.kept import Piece, Rows


class Part:
    """The shares of the real and of the virtual particles that a process has, `real` and `virtual`, and those, from one up
    to another, that its steps change, `stepped` by the name of the set."""

    def __init__(self, split: Split):
        self.real, self.virtual = split.nodes, split.points
        self._shared, self._halo = split.domain.size > 1, split.domain.halo(split.nodes)
        self.stepped = {"real": self.real.own, "virtual": self.virtual.own}

    def reach(self, to_virtual: Operator, to_real: Operator) -> None:
        """Have steps reach the real particles that are its own, and the virtual ones that these see or that are."""
        if self._shared:
            self.stepped["virtual"] = joined(self.virtual.own, to_real.sees(self.real.own))
            to_real.reach(self.stepped["real"])
            to_virtual.reach(self.stepped["virtual"])

    def prescribed(self, conditions: Conditions, corners: np.ndarray) -> Conditions:
        """Of the conditions of the real particles those that steps need: of its own, and of the `corners` (c, k) of the
        cells that its steps change."""
        if not self._shared:
            return conditions
        around = corners[self.stepped["virtual"]]
        here = joined(self.real.own, slice(int(around.min()), int(around.max()) + 1))
        entries = {
            key: {particle: value for particle, value in values.items() if here.start <= particle < here.stop}
            for key, values in conditions.entries.items()
        }
        return replace(conditions, entries=entries)

    def bring(self, state: State, clock: Clock, *names: str) -> None:
        """Bring the copies in a state of the real particles up to date: of fields by name, or of all."""
        if self._shared:
            clock.host(partial(self._update, state, names or tuple(state.start)))

    def _update(self, state: State, names: Iterable[str]) -> None:
        self._halo.update(*(getattr(state.struct, name) for name in names))

    def pieces(
        self, kept: Iterable[str], states: Mapping[str, tuple[State, Share]], others: Mapping[str, Rows]
    ) -> dict[str, list[Piece]]:
        """Where arrays that are `kept` stand in those of all processes, by their names: the buffers of `states`, of one set
        or the other, and `others`."""
        found: dict[str, list[Piece]] = {}
        for name in kept:
            if name not in states:
                found[name] = [Piece(0, 0, others[name])]
                continue
            state, share = states[name]
            rows = Rows.of(share)
            found[name] = [Piece(start, state.widths[field], rows) for field, start in state.start.items()]
        return found
