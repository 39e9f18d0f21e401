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


def own_cells(run: BodyRun) -> Sequence[np.ndarray]:
    """Which cells of every block of a body are this process's own, (c,) bool."""
    return run.system.geometry.own_cells if run.reading.cells else []


def _blocks(run: BodyRun, values: np.ndarray) -> list[tuple[np.ndarray, slice | np.ndarray]]:
    """Values (c, ...) of cells by their blocks, with those that are this process's own; of a body that has none of its
    particles."""
    if not run.reading.cells:
        return [(values, run.system.share.own)]
    ends = np.cumsum([len(corners) for corners in run.reading.cells])[:-1]
    return list(zip(np.split(values, ends), own_cells(run), strict=True))


class All:
    """All of a body, in the first process; the others have their own rows."""

    def __init__(self, run: BodyRun):
        self._run, self._system, self._reading = run, run.system, run.reading
        self._split = run.system.geometry.split
        share = self._system.share
        self._span = (0, share.whole) if self._split.domain.rank == 0 else (share.low, share.high)

    @property
    def count(self) -> int:
        """All of them; in other processes its own."""
        return self._span[1] - self._span[0]

    @property
    def numbers(self) -> np.ndarray:
        """All of them; in other processes its own."""
        return np.arange(*self._span)

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
        own = zip(self._reading.cells, own_cells(self._run), strict=True)
        return [split.domain.gathered(corners[mine] + split.nodes.first) for corners, mine in own]

    def of_particles(self, values: np.ndarray) -> np.ndarray:
        """Those of all processes."""
        system = self._system
        return values if system.share.complete else system.domain.gathered(values[system.share.own])

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Those of all processes."""
        domain = self._split.domain
        if domain.size == 1:
            return values
        # Block after block, as one process has them.
        return np.concatenate([domain.gathered(rows[mine]) for rows, mine in _blocks(self._run, values)])


class Own:
    """The particles and cells of a body that are a process's own, and copies of other corners of these cells. A body that
    all processes have whole the first has."""

    def __init__(self, run: BodyRun, rank: int):
        self._run, self._system, self._reading = run, run.system, run.reading
        self._absent = run.system.share.complete and rank > 0

    @cached_property
    def _rows(self) -> np.ndarray:
        share = self._system.share
        used = np.zeros(share.held, bool)
        used[slice(0, 0) if self._absent else share.own] = True
        for corners in self._corners:
            used[corners] = True
        return np.flatnonzero(used)

    @property
    def _corners(self) -> Sequence[np.ndarray]:
        """Of its own cells, rows of the particles that it holds."""
        if self._absent:
            return []
        if self._system.share.complete:
            return self._reading.cells
        return [corners[mine] for corners, mine in zip(self._reading.cells, own_cells(self._run), strict=True)]

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
        return [np.searchsorted(self._rows, corners) for corners in self._corners]

    def of_particles(self, values: np.ndarray) -> np.ndarray:
        """Its own rows, and those of copies as their owners have them."""
        if self._reading.cells and not self._system.share.complete:
            values = np.array(values, order="C")
            self._halo.fill(values)
        return values[self._rows]

    def of_cells(self, values: np.ndarray) -> np.ndarray:
        """Its own rows."""
        if self._absent or self._system.share.complete:
            return values[: 0 if self._absent else len(values)]
        return np.concatenate([rows[mine] for rows, mine in _blocks(self._run, values)])
