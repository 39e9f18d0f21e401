"""Which particles of the other set each sees, with which weights, and how much of a body a process has to hold for that.

What a particle sees beside a face, or a crack, is known when it has been found: of a body that processes share each looks in
a part that is wide enough for any, and goes on with the layers that its steps read.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wsph.backend.domain import Share
from wsph.boundary.collocated import face_conditions
from wsph.boundary.conditions import Conditions
from wsph.constitutive.constitutive import Constitutive
from wsph.errors import Refused
from wsph.formulations.setup import Setup
from wsph.geometry.lattice import Lattice
from wsph.sph.averages import visible
from wsph.sph.pairs import Pairs, find_pairs_once
from wsph.sph.weights import Weights, gradient_weights, interpolation_weights

WIDENINGS = 2
"""Times that the support of a target may grow by half where it spans too few directions (a corner) and has to span all."""

WIDEST = 1.5**WIDENINGS
"""The support of a particle that has to see more than the others, over theirs, at most."""


class Sets:
    """The two sets of a body in coordinates of its grid: the kernel is one of these, so cells of any aspect have the same
    neighbours. No pair reaches through a crack."""

    def __init__(self, setup: Setup, support: float):
        """`support` in cells."""
        self._space, self._device, self._smoothing = setup.space, setup.device, setup.scene.run.kernel
        self.lattice, self._support = setup.lattice, support
        self.nodes, self.cells = setup.lattice.centred
        self._off_cracks = setup.lattice.off_cracks if setup.lattice.cracks else (self.nodes, self.cells)

    def weights(self, name: str, volume: np.ndarray, spanning: np.ndarray) -> tuple[Weights, Weights]:
        """Interpolation and gradient to the "virtual" or the "real" particles from the others, of `volume` (sources,) in
        cells; those `spanning` (targets,) bool look further until they span all directions. Raises Refused."""
        order = slice(None, None, 1 if name == "real" else -1)
        targets, sources = (self.nodes, self.cells)[order]
        off_targets, off_sources = self._off_cracks[order]
        reach = np.full(len(targets), self._support)

        def seen() -> Pairs:
            found = find_pairs_once(targets, sources, reach, self._device)
            return visible(found, self.lattice, off_targets, off_sources)

        pairs = seen()
        gradient = gradient_weights(self._space, pairs, targets, sources, volume, self._smoothing)
        for _ in range(WIDENINGS):
            # A corner sees one particle of the other set.
            narrow = spanning & (gradient.rank < self._space.dim)
            if not narrow.any():
                break
            reach[narrow] *= 1.5
            pairs = seen()
            gradient = gradient_weights(self._space, pairs, targets, sources, volume, self._smoothing)
        interpolation = interpolation_weights(self._space, pairs, targets, sources, volume, self._smoothing)
        split = self.lattice.split
        own = (split.nodes if name == "real" else split.points).own
        isolated = own.start + np.flatnonzero((interpolation.rank[own] < 0) | (gradient.rank[own] < 0))
        if len(isolated):
            where = (self.lattice.cells if name == "virtual" else self.lattice.nodes)[isolated[0]].tolist()
            raise Refused(
                f"{len(isolated)} {name} particles, the first at {where} m, see too few particles of the other set"
                f" for a gradient: raise run.support (now {self._support:g} spacings)"
            )
        return interpolation, gradient


Both = tuple[Weights, Weights]
"""Weights of interpolation and of gradient."""


@dataclass(frozen=True)
class Weighed:
    """A body whose particles have been weighed: the `setup` of the part that a process holds, what is prescribed there, and
    the weights `to_virtual` and `to_real` particles, in coordinates of the grid."""

    setup: Setup
    conditions: Conditions
    to_virtual: Both
    to_real: Both


def weighed(
    setup: Setup, support: float, along: int, spanning: Callable[[str, Lattice, Conditions, np.ndarray], np.ndarray]
) -> Weighed:
    """Weigh the particles of a body; `spanning` says which of the "virtual" or the "real" ones of a lattice, under its
    conditions, have to span all directions, `along` how many layers beyond its own a process holds at least. All
    processes that share the body call it together. Raises Refused where particles see too few."""
    split, wide = setup.lattice.split, setup
    if split.domain.size > 1:
        more = 2 * math.ceil(WIDEST * support + 1.0) + 1
        wide = _widened(setup, (split.layers[0] - more, split.layers[1] + more))
    lattice, conditions = wide.lattice, _prescribed(wide)
    cell, sets = float(np.prod(lattice.frame.step)), Sets(wide, support)
    held = held_components(conditions, setup.constitutive, len(lattice.nodes))
    # With its images: the half of a body that symmetry stands for has the operators of the whole, at a crack's tip too.
    whole = conditions.mirrored * lattice.node_volume / cell
    to_virtual = sets.weights("virtual", whole, spanning("virtual", lattice, conditions, held))
    to_real = sets.weights("real", lattice.cell_volume / cell, spanning("real", lattice, conditions, held))
    if wide is setup:
        return Weighed(setup, conditions, to_virtual, to_real)

    def sees(name: str, targets: slice) -> slice:
        pairs = (to_virtual if name == "virtual" else to_real)[0].pairs
        return pairs.seen(targets)

    of = lattice.split
    read = layers_read(lattice, (of.nodes.own, of.points.own), sees, along)
    part = _widened(setup, (min(read[0], split.layers[0]), max(read[1], split.layers[1])))
    nodes, cells = (
        _among(mine, theirs)
        for mine, theirs in ((part.lattice.split.nodes, of.nodes), (part.lattice.split.points, of.points))
    )
    weights = [each.between(cells, nodes) for each in to_virtual], [each.between(nodes, cells) for each in to_real]
    return Weighed(part, _prescribed(part), (weights[0][0], weights[0][1]), (weights[1][0], weights[1][1]))


def layers_read(
    lattice: Lattice, own: tuple[slice, slice], sees: Callable[[str, slice], slice], along: int
) -> tuple[int, int]:
    """The layers of cells, from one up to another, of what a process reads that owns some real and some virtual particles:
    the virtual ones that its real ones see, the real ones that those see, and those `along` some layers beyond its own.
    `sees` gives the sources of "virtual" or of "real" targets."""
    node = lattice.node_layer
    stepped = joined(own[1], sees("real", own[0]))
    read, corners = joined(own[0], sees("virtual", stepped)), lattice.corners
    low = min(node[read.start], node[corners[stepped.start, 0]], node[own[0].start] - along)
    high = max(node[read.stop - 1], node[corners[stepped.stop - 1, 0]] + 1, node[own[0].stop - 1] + along)
    return int(low), int(high)


def held_components(conditions: Conditions, constitutive: Constitutive, count: int) -> np.ndarray:
    """Per real particle, one bit for every prescribed component, (count,) int32: velocity first, then stress."""
    fields = (("velocity", constitutive.space.dim), ("stress", constitutive.width))
    held = np.hstack([conditions.prescribed(name, width, count) for name, width in fields])
    return (held << np.arange(held.shape[1])).sum(1).astype(np.int32)


def joined(one: slice, other: slice) -> slice:
    """From the first of both to the last."""
    return slice(min(one.start, other.start), max(one.stop, other.stop))


def _prescribed(setup: Setup) -> Conditions:
    return face_conditions(setup.scene, setup.body.name, setup.lattice, setup.constitutive.state.labels)


def _widened(setup: Setup, layers: tuple[int, int]) -> Setup:
    """The setup of a part of a body with some layers at least."""
    return replace(setup, geometry=setup.lattice.wider(layers))


def _among(part: Share, wide: Share) -> slice:
    """Where the rows of a part are among those of a wider one."""
    first = part.first - wide.first
    return slice(first, first + part.held)
