"""Cells that have died and joins of cells that have parted, as the state of a body says it.

A cell is dead where all of its points are broken: by a phase field, or because every link of its particle is. Two cells
that share a side are parted where a crack passes between them, or the link between their particles is broken. Where
particles are nodes a broken link, or a crack that leaves the nodes on it whole, runs through cells: that parts none, and
their surface stays closed.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

import numpy as np

from wsph.backend.arrays import host
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.meshing.boundary import neighbours
from wsph.geometry.geometry import Geometry
from wsph.parts.part import BROKEN

NO_PAIRS = np.zeros((0, 2), int)


class Breaking:
    """What is left of the cells of a body."""

    def __init__(self, system: SurfacedSystem, geometry: Geometry, *, at_nodes: bool) -> None:
        """`geometry`: of the whole body."""
        self._system, self._at_nodes = system, at_nodes
        self._cells = sum(len(corners) for corners in geometry.blocks)
        self._cut = _cracked(geometry) if not at_nodes else NO_PAIRS
        self._joins, self._links = NO_PAIRS, np.zeros(0, int)
        if not at_nodes and system.breakable_weights is not None:
            joins = neighbours(geometry)
            own, keys = system.neighbours.keys(), joins[:, 0].astype(np.int64) * self._cells + joins[:, 1]
            at = np.minimum(np.searchsorted(own, keys), max(len(own) - 1, 0))
            linked = own[at] == keys
            self._joins, self._links = joins[linked], at[linked]

    def live(self) -> np.ndarray:
        """The cells that are not dead, (c,) bool."""
        system, geometry = self._system, self._system.geometry
        if not system.breaks or "damage" not in system.state.layout:
            return np.ones(self._cells, bool)
        broken = host(system.state.struct.damage).ravel() > BROKEN
        if not system.traits.pairwise:
            places = geometry.points_of_cells
        elif self._at_nodes:
            places = geometry.blocks
        else:
            return ~broken
        return np.concatenate([~broken[each].all(1) for each in places])

    def parted(self) -> np.ndarray:
        """Pairs of cells, with a side in common, that do not hang together at it, (k, 2)."""
        weights = self._system.breakable_weights
        if weights is None or not len(self._links):
            return self._cut
        return self._with(host(weights)[self._links] == 0.0)

    def _with(self, torn: np.ndarray) -> np.ndarray:
        return np.concatenate([self._cut, self._joins[torn]])

    def flags(self, live: np.ndarray, parted: np.ndarray) -> np.ndarray:
        """What is alive and what is parted as flags of a length of their own, int32."""
        keys, torn = (each[:, 0].astype(np.int64) * self._cells + each[:, 1] for each in (self._joins, parted))
        return np.concatenate([live, np.isin(keys, torn)]).astype(np.int32)

    def flagged(self, flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The reverse: `live` (c,) bool and `parted` (k, 2)."""
        return flags[: self._cells] != 0, self._with(flags[self._cells :] != 0)


def _cracked(geometry: Geometry) -> np.ndarray:
    """Pairs of cells that a crack from the start passes between, (k, 2)."""
    if not geometry.cracks:
        return NO_PAIRS
    pairs, (_, cells) = neighbours(geometry), geometry.off_cracks
    return pairs[geometry.crossed(cells[pairs[:, 0]], cells[pairs[:, 1]])]
