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
from wsph.backend.domain import Share
from wsph.contact.surfaces.body import SurfacedSystem
from wsph.contact.surfaces.meshing.boundary import neighbours
from wsph.contact.surfaces.meshing.own import OwnCells
from wsph.parts.part import BROKEN

NO_PAIRS = np.zeros((0, 2), int)


class Breaking:
    """What is left of the cells of a body: of its own each process says it. A join is of the lower one of its two cells."""

    def __init__(self, system: SurfacedSystem, own: OwnCells, *, at_nodes: bool) -> None:
        self._system, self._own, self._at_nodes = system, own, at_nodes
        split = system.geometry.split
        self._domain, self._points = split.domain, system.geometry.points_of_cells
        share = split.points
        if system.traits.pairwise:
            share = split.particles(at_nodes=at_nodes)
            self._points = system.geometry.blocks if at_nodes else self._points
        self._halo = split.domain.halo(share)
        self._cut = self._cracked() if not at_nodes else NO_PAIRS
        self._joins, self._links = NO_PAIRS, np.zeros(0, int)
        if not at_nodes and system.breakable_weights is not None:
            joins = neighbours(system.geometry)
            known, keys = system.neighbours.keys(), joins[:, 0].astype(np.int64) * system.count + joins[:, 1]
            at = np.minimum(np.searchsorted(known, keys), max(len(known) - 1, 0))
            mine = np.flatnonzero((known[at] == keys) & split.points.owns(joins[:, 0]))
            mine = mine[np.lexsort(joins[mine].T[::-1])]
            self._joins, self._links = joins[mine] + split.points.first, at[mine]
        counts = self._domain.joined(np.array([len(self._joins)]))
        low, high = (int(counts[:k].sum()) for k in (self._domain.rank, self._domain.rank + 1))
        self.joins = Share(int(counts.sum()), low, high - low, low, high)

    def _cracked(self) -> np.ndarray:
        """Pairs of cells that a crack from the start passes between, of the whole body, (k, 2)."""
        geometry = self._system.geometry
        if not geometry.cracks:
            return NO_PAIRS
        pairs, (_, cells), points = neighbours(geometry), geometry.off_cracks, geometry.split.points
        pairs = pairs[points.owns(pairs).any(1)]
        torn = geometry.crossed(cells[pairs[:, 0]], cells[pairs[:, 1]])
        # Of two processes both may say it.
        return np.unique(self._domain.joined(pairs[torn] + points.first), axis=0)

    def live(self) -> np.ndarray:
        """Its own cells that are not dead, (c,) bool. All processes that share the body ask together."""
        parts = self._system.attached.values()
        found = next((part.damage for part in parts if part.damage is not None), None)
        if found is None:
            return np.ones(len(self._own.numbers), bool)
        damage = host(found).reshape(-1, 1).copy()
        self._halo.fill(damage)
        broken = damage[:, 0] > BROKEN
        return np.concatenate(
            [~broken[each[rows]].all(1) for each, rows in zip(self._points, self._own.rows, strict=True)]
        )

    def torn(self) -> np.ndarray:
        """Which of its own joins have parted, (j,) bool."""
        weights = self._system.breakable_weights
        if weights is None or not len(self._links):
            return np.zeros(len(self._links), bool)
        return host(weights)[self._links] == 0.0

    def parted(self, torn: np.ndarray) -> np.ndarray:
        """Pairs of cells of the whole body, with a side in common, that do not hang together at it, (k, 2). All processes
        that share the body ask together."""
        return np.concatenate([self._cut, self._domain.joined(self._joins[torn])])
