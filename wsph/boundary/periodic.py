"""Periodic faces: what leaves a body through one comes in by the other.

The particles of both faces that stand at one place but for the period are one particle: they move together, with the mass
of both and the sum of the forces on both, a = sum m_k a_k/sum m_k. Where cells see their own corners alone this is the body
that closes on itself, to rounding: the cells beside a seam see what they would in the middle of it. Along edges gradients at
a seam are those of either side, which a wave of 25 cells notes by 1e-3 of its amplitude.
"""

from functools import cache, partial

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays, host, put
from wsph.backend.clock import Clock
from wsph.backend.domain import Domain, Share, any_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.conditions import particles_of
from wsph.boundary.programs.prescribed import Moved, mark, varies
from wsph.boundary.slide import Slide
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.output.fields import AXES

FIT = 1e-6
"""Parts of a spacing within which particles of two faces stand opposite each other."""


def partners(key: str, name: str, particles: np.ndarray, geometry: Geometry) -> np.ndarray:
    """Pairs of `particles` (k,) with those of the face `name` opposite, (k, 2), by their numbers among the nodes of the
    whole body. Raises SceneError where the faces are not the same but for a shift."""
    faces, spacing, split = geometry.sides, geometry.spacing, geometry.split
    opposite = particles_of(faces.nodes[faces.named(name)], len(geometry.nodes), split, at_nodes=True)
    (ones, place), (others, there) = (_everywhere(each, geometry) for each in (particles, opposite))
    if not len(others):
        text = f"{name!r} is no face of it, which has {', '.join(faces.names)}"
        raise SceneError("scene", [Fault(0, key, text)])
    if np.isin(ones, others).all():
        raise SceneError("scene", [Fault(0, key, "a face is not its own partner: name the one opposite")])
    if len(others) == len(ones):
        shift = there.mean(0) - place.mean(0)
        first, second = _ordered(place, spacing), _ordered(there - shift, spacing)
        if np.abs(there[second] - place[first] - shift).max() <= FIT * spacing:
            return np.stack([ones[first], others[second]], 1)
    text = (
        f"the particles of {name!r} do not stand opposite: both faces have to be the same but for a shift (jitter moves their"
        " particles; those of a turned lattice or a fitted surface may differ)"
    )
    raise SceneError("scene", [Fault(0, key, text)])


def _everywhere(particles: np.ndarray, geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (k,) among the nodes of the whole body, and places (k, dim) [m], of particles of all processes."""
    split = geometry.split
    own = particles[split.nodes.owns(particles)]
    return split.domain.joined(own + split.nodes.first), split.domain.joined(geometry.nodes[own])


def _ordered(place: np.ndarray, spacing: float) -> np.ndarray:
    """An order of places that does not depend on what they are off by roundings."""
    return np.lexsort(np.round((place - place.mean(0)) / (0.01 * spacing)).T)


def seams_of(pairs: list[np.ndarray]) -> list[np.ndarray]:
    """Groups of particles that are one, of all pairs: at an edge of two seams four, in a corner of three eight."""
    root: dict[int, int] = {}

    def first(particle: int) -> int:
        while root.setdefault(particle, particle) != particle:
            particle = root[particle]
        return particle

    for one, other in (row for each in pairs for row in each.tolist()):
        low, high = sorted((first(one), first(other)))
        root[high] = low
    groups: dict[int, list[int]] = {}
    for particle in sorted(root):
        groups.setdefault(first(particle), []).append(particle)
    return [np.array(group) for group in groups.values()]


def refuse_parted(
    seams: list[np.ndarray],
    entries: dict[tuple[str, int], dict[int, Moved]],
    slides: list[Slide],
    place: np.ndarray,
    share: Share,
    domain: Domain,
    key: str,
) -> None:
    """Refuse what is prescribed to some particles that are one and not to the others, or differs between them. `place`
    (n, dim) [m] of the `share` of the particles that a process has. All processes ask together."""
    who = np.unique(np.concatenate(seams))
    groups = [np.searchsorted(who, seam) for seam in seams]
    rows = share.owned(who)
    where = domain.joined(place[rows])
    for slide in slides:
        there = domain.joined(np.isin(rows, slide.particle))
        if any(there[group].any() and not there[group].all() for group in groups):
            raise SceneError("scene", [Fault(0, key, "a velocity along normals is prescribed at one side of it alone")])
    for axis in range(place.shape[1]):
        values = entries.get(("velocity", axis), {})
        given = [values.get(row) for row in rows.tolist()]
        code = domain.joined(np.array([0 if value is None else mark(value) for value in given], np.int64))
        uses = [[value is not None and varies(value, along) for along in AXES[: place.shape[1]]] for value in given]
        uneven = domain.joined(np.array(uses, bool).reshape(len(rows), place.shape[1]))
        for group in groups:
            apart = np.ptp(where[group], axis=0) > 0.0
            if np.ptp(code[group]) > 0 or uneven[group][:, apart].any():
                text = f"the velocity {AXES[axis]} is prescribed at one side of it and not alike at the other"
                raise SceneError("scene", [Fault(0, key, text)])


@cache
def _kernel(space: Space, layout: Layout) -> wp.Kernel:
    """The velocity of each group, to its members: these stand at `member` among the velocities that it is found of, and at
    `row` among the particles of the state, -1 for those that are not there."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def join(
        first: int,
        offsets: wp.array(dtype=wp.int32),
        member: wp.array(dtype=wp.int32),
        row: wp.array(dtype=wp.int32),
        share: wp.array(dtype=real),
        velocity: wp.array(dtype=vec),
        fields_out: Fields,
    ):
        g = first + wp.tid()
        total = vec()
        for k in range(offsets[g], offsets[g + 1]):
            total += share[k] * velocity[member[k]]
        for k in range(offsets[g], offsets[g + 1]):
            if row[k] >= 0:
                fields_out.velocity[row[k]] = total

    return join


class Seam:
    """Groups of particles of a body that are one, g of them with m particles in all.

    _offsets  # (g + 1,) int32, where the particles of each begin
    _member   # (m,) int32
    _share    # (m,), their masses over that of the group
    """

    def __init__(self, seams: list[np.ndarray], mass: np.ndarray, space: Space, arrays: Arrays):
        """`mass` (n,) of all particles that the groups are of."""
        self._space, self.count = space, len(seams)
        if not seams:
            return
        starts = np.concatenate([[0], np.cumsum([len(seam) for seam in seams])])
        self._first, self._members = starts[:-1], np.concatenate(seams)
        own = mass[self._members]
        whole = np.repeat(np.add.reduceat(own, self._first), np.diff(starts))
        self._roots, self._shares, self._many = np.sqrt(own), own / whole, np.diff(starts)
        self._offsets = arrays.of("offsets", starts, wp.int32)
        self._member = arrays.of("member", self._members, wp.int32)
        self._share = arrays.of("share", self._shares, space.scalar)

    def join(self, state: State, clock: Clock) -> None:
        """Give the particles of each group one velocity, or acceleration where `state` is a rate (a launch, if there are
        any)."""
        if self.count:
            self._launch(state, clock, self._member, state.struct.velocity)

    def _launch(self, state: State, clock: Clock, row: Array, velocity: Array) -> None:
        inputs = [self._offsets, self._member, row, self._share, velocity]
        clock.launch(_kernel(self._space, state.layout), self.count, inputs, [state.struct])

    def project(self, velocity: np.ndarray) -> np.ndarray:
        """Velocities (n dim,) times the roots of masses, with what of them is no motion of groups taken out."""
        if not self.count:
            return velocity
        result = velocity.reshape(-1, self._space.dim).copy()
        result[self._members] = self._as_one(result[self._members])
        return result.ravel()

    def _as_one(self, velocity: np.ndarray) -> np.ndarray:
        """The same of the members (m, dim)."""
        weighted = (self._shares / self._roots)[:, None] * velocity
        return self._roots[:, None] * np.repeat(np.add.reduceat(weighted, self._first), self._many, axis=0)


class SharedSeam(Seam):
    """Groups whose particles are of several processes: each has all groups, and is told of the velocities of all of their
    particles, k in their order.

    _own       # those that this process owns, rows of the particles that are here
    _row       # (m,) where each member is here, -1 where it is not
    _velocity  # (k,) vec
    """

    def __init__(
        self, seams: list[np.ndarray], mass: np.ndarray, share: Share, domain: Domain, space: Space, arrays: Arrays
    ):
        """`seams` by the numbers of particles in the whole body, `mass` (n,) of those that are here."""
        who, members = np.unique(np.concatenate(seams)), np.concatenate(seams)
        self._own = share.owned(who)
        self._domain = domain
        super().__init__([np.searchsorted(who, seam) for seam in seams], domain.joined(mass[self._own]), space, arrays)
        rows = share.stands(members)
        self._here = rows >= 0
        self._rows = rows[self._here]
        self._row = arrays.of("row", rows, wp.int32)
        self._velocity = arrays.zeros("velocity", len(who), space.vec)

    def join(self, state: State, clock: Clock) -> None:
        clock.host(partial(self._bring, state.struct.velocity))
        self._launch(state, clock, self._row, self._velocity)

    def _bring(self, velocity: Array) -> None:
        # Processes have ranges of particles, in their order.
        put(self._velocity, self._domain.joined(host(velocity)[self._own]))

    def project(self, velocity: np.ndarray) -> np.ndarray:
        result = velocity.reshape(-1, self._space.dim).copy()
        every = self._domain.joined(result[self._own])
        result[self._rows] = self._as_one(every[self._members])[self._here]
        return result.ravel()


def seam_between(
    seams: list[np.ndarray], mass: np.ndarray, share: Share, domain: Domain, space: Space, arrays: Arrays
) -> Seam:
    """What joins groups of particles, by their numbers in the whole body. Where no group is of several processes none is
    told of others."""
    rows = [share.stands(seam) for seam in seams]
    if any_of(domain, any(each.min() < 0 <= each.max() for each in rows)):
        return SharedSeam(seams, mass, share, domain, space, arrays)
    return Seam([each for each in rows if each.min() >= 0], mass, space, arrays)
