"""The part of a body of two sets that a process has.

A process holds some layers beyond its own. A step finds the rates of its own real particles, and of the virtual ones that
these see; then it is told the state of the others' real particles, and closes the step of all: what is prescribed, where
faces look and what the law allows is the same wherever it is found. One message a step and neighbour, but for each field.
Rows are in the order of the whole body, so that what two processes compute has the same bits in both.
"""

# pyright: strict

from collections.abc import Iterable, Mapping
from functools import partial

from wsph.backend.clock import Clock
from wsph.backend.domain import Share, Split
from wsph.backend.state import State
from wsph.formulations.taylor.operators import Operator
from wsph.ranks.kept import Piece, Rows


class Part:
    """The shares of the real and of the virtual particles that a process has, `real` and `virtual`."""

    def __init__(self, split: Split):
        self.real, self.virtual = split.nodes, split.points
        self._shared, self._halo = split.domain.size > 1, split.domain.halo(split.nodes)

    def reach(self, to_virtual: Operator, to_real: Operator) -> None:
        """Have steps reach the real particles that are its own, and the virtual ones that these see or that are."""
        if self._shared:
            to_real.reach(self.real.own)
            own, seen = self.virtual.own, to_real.seen
            to_virtual.reach(slice(min(own.start, seen.start), max(own.stop, seen.stop)))

    def bring(self, state: State, clock: Clock) -> None:
        """Bring the copies in a state of the real particles up to date."""
        if self._shared:
            clock.host(partial(self._update, state))

    def _update(self, state: State) -> None:
        for name in state.start:
            self._halo.update(getattr(state.struct, name))

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
