"""The particles that the surface of a body hangs on: its own, or of a body that processes share those of all of them.

Every process has the whole surface of a shared body, and places what it looks at. What that takes of particles of others is
brought up to date by a message whenever it is placed; of the forces each process takes those on its own.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Sequence
from functools import partial

import numpy as np
import warp as wp

from wsph.backend.arrays import changed, host
from wsph.backend.domain import Share
from wsph.backend.space import Array
from wsph.backend.state import State
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.meshing.sparse import SparseRows


class Carriers:
    """The particles of a body that is here as a whole."""

    def __init__(self, system: SurfacedSystem):
        self._system = system

    def hang(self, B: SparseRows) -> SparseRows:
        """A matrix (vertices, particles of the whole body) as one over these particles."""
        return B

    def stands(self, k: int) -> np.ndarray:
        """Where all k of them stand among the particles of the body that are here, (k,); -1 for those that are not."""
        return np.arange(k)

    def support(self, B: SparseRows, *, every: bool) -> tuple[np.ndarray, Share]:
        """Those that are here, (s,), ascending, by where they stand among the particles here, and the share that they are of
        all; `every`: of all particles of the body."""
        rows = np.arange(B.columns) if every else np.unique(B.indices)
        return rows, Share.all(len(rows))

    def attend(self, columns: np.ndarray) -> None:
        """From now on bring `columns` (j,), ascending, up to date, of all. All processes that share the body attend
        together."""

    def bring(self, state: State) -> None:
        """Bring what the surface takes of a state up to date."""

    def displacement(self, state: State) -> Array:
        """Of them, in a state that was brought last."""
        return state.struct.displacement

    def velocity(self, state: State) -> Array:
        """The same."""
        return state.struct.velocity

    def rows(self, values: np.ndarray) -> np.ndarray:
        """What they have, of rows of the particles that are here. All processes that share the body ask together."""
        return values

    def back(self, values: np.ndarray, otherwise: float) -> np.ndarray:
        """What the particles that are here have, of numbers (k,) of these; `otherwise` where that is none of these."""
        return values


class SharedCarriers(Carriers):
    """Those of the particles of a body that processes share on which any vertex of its surface hangs, k of all.

    _own     # those that this process owns, rows of the particles that are here, ascending
    _stands  # where each stands among the particles that are here, -1 where it is not, (k,)
    _share   # the range of them that this process owns; all are held
    _u, _v   # their displacements and velocities, as far as they are attended to, (k,) vec
    _from    # those that this process owns and attends to: where each stands among the particles that are here
    _to      # and among all k, ascending
    """

    def __init__(self, system: SurfacedSystem, *, lagged: bool):
        super().__init__(system)
        self._lagged = lagged

    def hang(self, B: SparseRows) -> SparseRows:
        system, share = self._system, self._system.share
        which = np.unique(B.indices)
        self._own, self._stands = share.owned(which), share.stands(which)
        # Processes have ranges of particles, in their order.
        low, high = (int(each) for each in np.searchsorted(which, [share.low, share.high]))
        self._share = Share(len(which), 0, len(which), low, high)
        self._halo = system.domain.chosen_halo(self._share)
        vec, device = system.space.vec, system.clock.device
        self._u: Array = wp.zeros(len(which), dtype=vec, device=device)
        self._v: Array = wp.zeros(len(which), dtype=vec, device=device)
        return SparseRows(B.offsets, np.searchsorted(which, B.indices), B.values, len(which))

    def stands(self, k: int) -> np.ndarray:
        return self._stands

    def support(self, B: SparseRows, *, every: bool) -> tuple[np.ndarray, Share]:
        if every:
            return np.arange(self._system.count), self._system.share
        here = np.flatnonzero(self._stands >= 0)
        first = int(here[0]) if len(here) else 0
        return self._stands[here], Share(B.columns, first, len(here), self._share.low, self._share.high)

    def attend(self, columns: np.ndarray) -> None:
        own = self._share.owns(columns)
        self._to = columns[own]
        self._from = self._own[self._to - self._share.low]
        self._halo.choose(columns[~own])

    def bring(self, state: State) -> None:
        moves = [(self._u, state.struct.displacement)]
        if not self._lagged:
            moves.append((self._v, state.struct.velocity))
        self._system.clock.host(partial(self._bring, moves))

    def _bring(self, moves: Sequence[tuple[Array, Array]]) -> None:
        rows = [host(into) for into, _ in moves]
        for each, (_, of) in zip(rows, moves, strict=True):
            each[self._to] = host(of)[self._from]
        self._halo.fill(*rows)
        for (into, _), each in zip(moves, rows, strict=True):
            changed(into, each)

    def displacement(self, state: State) -> Array:
        return self._u

    def velocity(self, state: State) -> Array:
        return self._v

    def rows(self, values: np.ndarray) -> np.ndarray:
        return self._system.domain.joined(values[self._own])

    def back(self, values: np.ndarray, otherwise: float) -> np.ndarray:
        found = np.full(self._system.count, otherwise)
        here = self._stands >= 0
        found[self._stands[here]] = values[here]
        return found


def carriers_of(system: SurfacedSystem, *, lagged: bool) -> Carriers:
    """The particles that the surface of a body hangs on. `lagged`: their velocities are not asked for."""
    return Carriers(system) if system.domain.size == 1 else SharedCarriers(system, lagged=lagged)
