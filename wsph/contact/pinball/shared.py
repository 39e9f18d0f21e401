"""The particles of a body that processes share, as those see them that they may meet."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np
import warp as wp

from wsph.backend.arrays import host, put
from wsph.backend.clock import Clock
from wsph.backend.space import Array, Space
from wsph.contact.pinball.everyone import Everyone
from wsph.contact.pinball.law import Balls, body_struct
from wsph.contact.touched import TouchedSystem
from wsph.sph.pairs import Pairs, find_pairs

T = TypeVar("T")


class SharedEveryone(Everyone):
    """Those of a body that processes share: `struct` has all of them."""

    def __init__(self, own: Balls, system: TouchedSystem, space: Space, clock: Clock):
        self._own, self._clock, self._domain, self._share = own, clock, system.domain, system.share
        self._halo = self._domain.halo(self._share)
        self.struct = body_struct(space)()
        self._dim, n, device = space.dim, self._share.whole, clock.device
        for name, dtype in (("x", space.vec), ("u", space.vec), ("v", space.vec), ("volume", space.scalar)):
            setattr(self.struct, name, wp.zeros(n, dtype=dtype, device=device))
            put(getattr(self.struct, name), self.rows(host(getattr(own, name))))

    def bring(self) -> None:
        self._clock.host(self._bring)

    def _bring(self) -> None:
        dim = self._dim
        mine = np.concatenate([host(each)[self._share.own] for each in (self._own.u, self._own.v)], 1)
        found = self._domain.joined(mine)
        put(self.struct.u, found[:, :dim])
        put(self.struct.v, found[:, dim:])

    def spread(self, force: Array) -> None:
        self._clock.host(partial(self._halo.update, force))

    def rows(self, values: np.ndarray) -> np.ndarray:
        return self._domain.joined(values[self._share.own])

    def smallest(self, values: np.ndarray) -> float:
        return float(self._domain.min(np.asarray(values.min())))

    def near(self, where: np.ndarray, sources: np.ndarray, reach: float, device: str, *, same: bool) -> Pairs:
        share, own = self._share, self._share.own
        pairs = find_pairs(where[share.low : share.high], sources, reach, device)
        if same:
            pairs = pairs.where(pairs.rows() + share.low != pairs.indices.numpy())
        # Copies have empty rows.
        offsets, found = np.full(share.held + 1, pairs.count, np.int32), np.zeros(share.held)
        offsets[: own.start] = 0
        offsets[own.start : own.stop + 1], found[own] = pairs.offsets.numpy(), pairs.reach.numpy()
        rows = wp.array(offsets, dtype=wp.int32, device=device), wp.array(found, dtype=wp.float64, device=device)
        return replace(pairs, offsets=rows[0], targets=share.held, reach=rows[1])

    def numbers(self, rows: np.ndarray) -> np.ndarray:
        return rows + self._share.first

    def told(self, of: Callable[[], T], least: float) -> T:
        return self._domain.told(of, by=int(self._domain.joined(np.array([least])).argmin()))

    def here(self, numbers: np.ndarray) -> np.ndarray:
        return self._share.stands(numbers)
