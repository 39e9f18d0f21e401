"""Which rows of a body a process has in frames: the first those of all processes, or each its own part of them."""

# pyright: strict

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from wsph.backend.domain import Halo
from wsph.simulation.composing.composition import BodyRun, Composition


def in_parts(composition: Composition) -> bool:
    """Whether each process writes its part of a frame."""
    return composition.scene.output.in_parts(composition.particles, composition.domain.size)


class Piece(Protocol):
    """What a process has of a body in a frame. All processes ask alike."""

    @property
    def count(self) -> int:
        """Particles."""
        ...

    @property
    def numbers(self) -> np.ndarray:
        """Those of the particles in the body, (count,)."""
        ...

    @property
    def copies(self) -> np.ndarray:
        """Which particles another process has in its part, (count,) bool."""
        ...

    @property
    def blocks(self) -> Sequence[np.ndarray]:
        """Its cells, as `wsph.formulations.reading.Reading.cells` has them, of rows of its particles."""
        ...

    def of_particles(self, values: np.ndarray) -> np.ndarray:
        """Rows of its particles, from those (n, ...) of the particles that the process holds."""
        ...

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Rows of its cells, or of its particles where the body has none, from those (c, ...) that the process holds."""
        ...


class All:
    """All of a body, in the first process; the others have their own rows."""

    def __init__(self, run: BodyRun):
        self._system, self._reading = run.system, run.reading
        self._split, self.count = run.system.geometry.split, run.system.share.whole

    @property
    def numbers(self) -> np.ndarray:
        """All of them; in other processes its own."""
        share = self._system.share
        return np.arange(share.whole) if self._split.domain.rank == 0 else np.arange(share.low, share.high)

    @property
    def copies(self) -> np.ndarray:
        """None."""
        return np.zeros(self.count, bool)

    @property
    def blocks(self) -> Sequence[np.ndarray]:
        """Those of all processes."""
        split = self._split
        if split.domain.size == 1:
            return self._reading.cells
        return [split.domain.gathered(corners[split.points.own] + split.nodes.first) for corners in self._reading.cells]

    def of_particles(self, values: np.ndarray) -> np.ndarray:
        """Those of all processes."""
        system = self._system
        return values if system.share.complete else system.domain.gathered(values[system.share.own])

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Those of all processes."""
        if self._split.domain.size == 1:
            return values
        share = self._split.points if self._reading.cells else self._system.share
        return self._split.domain.gathered(values[share.own])


class Own:
    """The particles and cells of a body that are a process's own, and copies of other corners of these cells. A body that
    all processes have whole the first has."""

    def __init__(self, run: BodyRun, rank: int):
        self._system, self._reading = run.system, run.reading
        share, points = run.system.share, run.system.geometry.split.points
        self._absent = share.complete and rank > 0
        own = points.own if run.reading.cells else share.own
        self._cells = slice(0, 0) if self._absent else slice(None) if share.complete else own

    @cached_property
    def _rows(self) -> np.ndarray:
        share = self._system.share
        used = np.zeros(share.held, bool)
        used[slice(0, 0) if self._absent else share.own] = True
        for corners in self._reading.cells:
            used[corners[self._cells]] = True
        return np.flatnonzero(used)

    @cached_property
    def _halo(self) -> Halo:
        return self._system.domain.halo(self._system.share)

    @property
    def count(self) -> int:
        """Particles."""
        return len(self._rows)

    @property
    def numbers(self) -> np.ndarray:
        """Those of its particles."""
        return self._system.share.first + self._rows

    @property
    def copies(self) -> np.ndarray:
        """The corners that are not its own."""
        return ~self._system.share.owns(self._rows)

    @property
    def blocks(self) -> Sequence[np.ndarray]:
        """Its own cells."""
        if self._absent:
            return []
        return [np.searchsorted(self._rows, corners[self._cells]) for corners in self._reading.cells]

    def of_particles(self, values: np.ndarray) -> np.ndarray:
        """Its own rows, and those of copies as their owners have them."""
        if self._reading.cells and not self._system.share.complete:
            values = np.array(values, order="C")
            self._halo.fill(values)
        return values[self._rows]

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Its own rows."""
        return values[self._cells]
