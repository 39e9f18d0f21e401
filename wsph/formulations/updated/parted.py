"""A body whose pairs follow the motion among processes that each have a part of its particles."""

# pyright: strict

from collections.abc import Callable, Iterator
from typing import cast

import numpy as np

from wsph.backend.arrays import host
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.boundary.programs.motions import Motions
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_rates import Rates
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.one_set_works import pieces_of
from wsph.formulations.setup import Setup
from wsph.formulations.system import Sight
from wsph.formulations.updated.rates import UpdatedRates
from wsph.formulations.updated.sharing.near import marked, seen_by
from wsph.ranks.kept import Piece, Rows


class PartedSystem(OneSetSystem):
    """A body in the current configuration, of which a process holds layers around the particles that it owns, and works on
    what is near these (`wsph.formulations.updated.sharing.near`)."""

    def __init__(self, setup: Setup, rates: Callable[[RateSetup, State], Rates]):
        super().__init__(setup, rates)
        made = cast(UpdatedRates, self.rates)
        self._near, made.bring = made.near, self.bring
        self._copies, self._halo = self._halo, self._near.halo

    def bring(self) -> None:
        if self.domain.size == 1:
            return
        for state in (self.state, *self._new):
            for name in (name for name in state.start if state.counts[name] == self.count):
                self._copies.update(cast(Array, getattr(state.struct, name)))

    def _spans(self, state: State, span: tuple[int, int]) -> Iterator[tuple[int, int]]:
        if self.domain.size == 1:
            yield span
            return
        for name, start in state.start.items():
            count, width = state.counts[name], state.widths[name]
            rows = self._near.move if count == self.count else slice(0, count)
            if span[0] <= start < span[1]:
                yield start + rows.start * width, start + rows.stop * width

    def _stressed(self, state: State) -> slice:
        return self._near.stress

    def sight(self, own: slice, right: slice) -> Sight:
        sights = cast(UpdatedRates, self.rates).sights
        stress = seen_by(marked(self.count, own), sights) | marked(self.count, right)
        many = 4 * np.sum([np.diff(host(pairs.offsets)) for pairs, _ in sights], 0)
        bytes_of = int(many[stress].sum()), int(many.sum())
        return Sight(int(stress.sum()), int(seen_by(stress, sights).sum()), *bytes_of)

    @property
    def wall_motions(self) -> Motions:
        """Of its driven walls."""
        raise NotImplementedError

    def pieces(self) -> dict[str, list[Piece]]:
        blocks = Rows.of_blocks(self.share)
        own = {"rates.skin.found": Rows.of(self.share), "walls.work._work": blocks, "walls.work._power": blocks}
        moves = self.wall_motions.kept().items()
        own |= {f"walls.motions.moves.{name}": Rows.alike(len(each), self.domain) for name, each in moves}
        here = self.arrays.kept, self.state, self._prescribed, self.placement, self.domain
        return pieces_of(*here, self.attached, own)
