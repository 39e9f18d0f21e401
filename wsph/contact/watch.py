"""A watch over the bodies of a scene: which of them run into each other.

Between two looks no pair of bodies can come together unseen: how fast they close bounds the time to the next. A look costs a
launch a body and, where boxes about two bodies meet, a search among the particles in both.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations
from typing import Protocol

import numpy as np
import warp as wp

from wsph.backend.domain import Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.contact.overlap import AnySolid, bounds_of, first_inside, solid_of
from wsph.geometry.geometry import Geometry
from wsph.protocols import BodyTable, Waving
from wsph.units import Scales

FASTER = 0.01
"""Part of the wave speeds by which bodies may speed up between two looks."""

CELL = 1.0
"""Way [spacings] that bodies whose boxes meet may go between two looks."""

DEEP = 2.0
"""Depth [spacings] at which a particle has passed through a surface that contact keeps it out of. The law lets go of what is
deeper than one; where corners meet, the cells that depths are counted in are crushed to half."""

LONGEST = 10**9
"""Steps between two looks at bodies that do not come near each other."""


class WatchedSystem(Protocol):
    """The system of a body, as a watch sees it."""

    state: State
    position: np.ndarray
    geometry: Geometry
    scales: Scales
    device: str

    @property
    def domain(self) -> Domain: ...

    @property
    def share(self) -> Share: ...

    @property
    def count(self) -> int: ...


class WatchedBody(Protocol):
    """A body in a run, as a watch sees it."""

    @property
    def body(self) -> BodyTable: ...

    @property
    def system(self) -> WatchedSystem: ...

    @property
    def constitutive(self) -> Waving: ...


@dataclass(frozen=True)
class Meeting:
    """Two bodies that have run into each other, by their numbers: a `particle` of the first lies inside of the second, at a
    `place` (dim,) [m]. `named`: contact was to keep them apart."""

    one: int
    other: int
    particle: int
    place: np.ndarray
    named: bool


@cache
def _extent_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """The smallest and the largest displacements and velocities of a block of particles."""
    dim, Fields = space.dim, fields_struct(space, layout)

    @kernel()
    def extents(fields: Fields, low: int, end: int, extent_out: wp.array2d(dtype=wp.float64)):
        block = wp.tid()
        first = low + block * BLOCK
        low_u = fields.displacement[first]
        high_u = low_u
        low_v = fields.velocity[first]
        high_v = low_v
        for i in range(first, wp.min(first + BLOCK, end)):
            low_u = wp.min(low_u, fields.displacement[i])
            high_u = wp.max(high_u, fields.displacement[i])
            low_v = wp.min(low_v, fields.velocity[i])
            high_v = wp.max(high_v, fields.velocity[i])
        for a in range(wp.static(dim)):
            extent_out[block, a] = wp.float64(low_u[a])
            extent_out[block, 3 + a] = wp.float64(high_u[a])
            extent_out[block, 6 + a] = wp.float64(low_v[a])
            extent_out[block, 9 + a] = wp.float64(high_v[a])

    return extents


class Watch:
    """The watch over all pairs of bodies that move; each is reported once. `due` is the step of the next look."""

    def __init__(self, bodies: Sequence[WatchedBody], named: Mapping[frozenset[str], bool]):
        """`named`: the pairs that contact keeps apart, and whether their surfaces do, so that particles on them lie inside
        of the other body as deep as they are pressed. Processes that share bodies look together."""
        moving = [k for k, run in enumerate(bodies) if "displacement" in run.system.state.layout]
        self._pairs = list(combinations(moving, 2))
        self._named = {pair: frozenset(bodies[k].body.name for k in pair) in named for pair in self._pairs}
        self._deep = {pair for pair in self._pairs if named.get(frozenset(bodies[k].body.name for k in pair))}
        self._watched = {k: _Watched(bodies[k]) for k in moving} if self._pairs else {}
        self.due = 0

    def kept(self) -> list[list[int]]:
        """What a run goes on with: the step of the next look, and the pairs that are still watched."""
        return [[self.due], *([one, other] for one, other in self._pairs)]

    def restore(self, kept: Sequence[Sequence[int]]) -> None:
        """Put back what `kept` gave."""
        (self.due,), *pairs = kept
        self._pairs = [(one, other) for one, other in pairs]

    def look(self, step: int, dt: float) -> list[Meeting]:
        """Look at the bodies as they are at a step, whose next one takes `dt` [s]: the meetings that are new."""
        if not self._pairs or step < self.due:
            return []
        boxes = {k: each.box() for k, each in self._watched.items()}
        found: list[Meeting] = []
        self.due = step + LONGEST
        for one, other in list(self._pairs):
            time = _until(boxes[one], boxes[other])
            if time == 0.0:
                meeting, time = self._search(one, other, boxes)
                if meeting is not None:
                    found.append(meeting)
                    self._pairs.remove((one, other))
                    continue
            self.due = min(self.due, step + max(int(min(time / dt, LONGEST)), 1))
        return found

    def _search(self, one: int, other: int, boxes: dict[int, "_Box"]) -> tuple[Meeting | None, float]:
        """Whether bodies whose boxes meet have run into each other, and for how long they cannot if they have not [s]."""
        watched = {k: self._watched[k] for k in (one, other)}
        places = {k: each.places() for k, each in watched.items()}
        spacings = {k: each.solid.geometry.spacing for k, each in watched.items()}
        for a, b in ((one, other), (other, one)):
            depth = DEEP * max(spacings.values()) / spacings[b] if (one, other) in self._deep else None
            found = first_inside(places[a], *watched[a].part, watched[b].solid, places[b], depth)
            if found is not None:
                return Meeting(a, b, found.number, found.place, self._named[one, other]), 0.0
        ends = {k: bounds_of(places[k], *each.part) for k, each in watched.items()}
        around = [replace(boxes[k], low=low, high=high) for k, (low, high) in ends.items()]
        way = CELL * min(spacings.values())
        return None, max(_until(*around), way / float(_closing(*around).max()))


class _Watched:
    """One body of a watch."""

    def __init__(self, run: WatchedBody):
        system = run.system
        self._run = run
        low, high = system.position.min(0), system.position.max(0)
        self._low, self._high = system.domain.min(low), system.domain.max(high)
        self._halo = system.domain.halo(system.share)
        own = system.share.own  # copies may have been left behind
        self._extents: Array = wp.zeros((blocks(own.stop - own.start), 12), dtype=wp.float64, device=system.device)

    @cached_property
    def solid(self) -> AnySolid:
        """It, as something that takes up room."""
        system = self._run.system
        return solid_of(system.geometry, at_nodes=len(system.position) != len(system.geometry.cell_volume))

    def box(self) -> "_Box":
        """A box about it, and how fast it may go (a launch and a small copy)."""
        system = self._run.system
        state, scales, dim = system.state, system.scales, len(self._low)
        inputs = [state.struct, system.share.own.start, system.share.own.stop]
        made = _extent_kernel(state.space, state.layout)
        wp.launch(made, len(self._extents), inputs=inputs, outputs=[self._extents], device=system.device)
        each = self._extents.numpy().reshape(-1, 4, 3)[:, :, :dim]
        smallest, largest = system.domain.min(each.min(0)), system.domain.max(each.max(0))
        more = FASTER * self._run.constitutive.wave_speed
        return _Box(
            self._low + smallest[0] * scales.length,
            self._high + largest[1] * scales.length,
            smallest[2] * scales.velocity - more,
            largest[3] * scales.velocity + more,
        )

    @property
    def part(self) -> tuple[Share, Domain]:
        """The part of its particles that this process has."""
        return self._run.system.share, self._run.system.domain

    def places(self) -> np.ndarray:
        """Where its particles here are, (n, dim) [m], copies where their owners have them."""
        system = self._run.system
        ways = system.state.read("displacement") * system.scales.length
        self._halo.fill(ways)
        return self.solid.places + ways


@dataclass(frozen=True)
class _Box:
    """A box about a body, `low` to `high` (dim,) [m], and its velocities, `slow` to `fast` (dim,) [m/s]."""

    low: np.ndarray
    high: np.ndarray
    slow: np.ndarray
    fast: np.ndarray


def _closing(one: _Box, other: _Box) -> np.ndarray:
    """How fast two bodies may close along every axis (dim,) [m/s]."""
    below = other.low - one.high > one.low - other.high
    return np.where(below, one.fast - other.slow, other.fast - one.slow)


def _until(one: _Box, other: _Box) -> float:
    """A time in which two boxes do not meet [s], 0 where they do."""
    gap = np.maximum(other.low - one.high, one.low - other.high)
    return float(np.max(np.where(gap > 0.0, gap / np.maximum(_closing(one, other), 1e-300), 0.0)))
