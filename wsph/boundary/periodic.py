"""Periodic faces: what leaves a body through one comes in by the other.

The particles of both faces that stand at one place but for the period are one particle: they move together, with the mass
of both and the sum of the forces on both, a = sum m_k a_k/sum m_k. Where cells see their own corners alone this is the body
that closes on itself, to rounding: the cells beside a seam see what they would in the middle of it. Along edges gradients at
a seam are those of either side, which a wave of 25 cells notes by 1e-3 of its amplitude.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import any_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.conditions import particles_of
from wsph.boundary.programs.prescribed import Moved, same, varies
from wsph.boundary.slide import Slide
from wsph.errors import Fault, SceneError
from wsph.geometry.geometry import Geometry
from wsph.output.fields import AXES

FIT = 1e-6
"""Parts of a spacing within which particles of two faces stand opposite each other."""


def partners(key: str, name: str, particles: np.ndarray, geometry: Geometry) -> np.ndarray:
    """Pairs of `particles` (k,) with those of the face `name` opposite, (k, 2), of the nodes of a body. Raises SceneError
    where the faces are not the same but for a shift, or one process has not both of them."""
    faces, place, spacing, split = geometry.sides, geometry.nodes, geometry.spacing, geometry.split
    rows = faces.named(name)
    others = particles_of(faces.nodes[rows], len(place), split, at_nodes=True)
    if not any_of(split.domain, len(others) > 0):
        text = f"{name!r} is no face of it, which has {', '.join(faces.names)}"
        raise SceneError("scene", [Fault(0, key, text)])
    if not any_of(split.domain, not np.isin(particles, others).all()):
        raise SceneError("scene", [Fault(0, key, "a face is not its own partner: name the one opposite")])
    if split.domain.size > 1 and any_of(split.domain, bool((geometry.faces.axis[rows] == geometry.cut_axis).any())):
        text = (
            f"processes share the body in slabs across an axis that {name!r} lies across too: what is periodic there is for one"
            " process: turn the body, or start it without mpiexec"
        )
        raise SceneError("scene", [Fault(0, key, text)])
    if not len(particles) and not len(others):
        return np.zeros((0, 2), int)
    if len(others) == len(particles):
        shift = place[others].mean(0) - place[particles].mean(0)
        orders = [_ordered(each, spacing) for each in (place[particles], place[others] - shift)]
        pairs = np.stack([particles[orders[0]], others[orders[1]]], 1)
        if np.abs(place[pairs[:, 1]] - place[pairs[:, 0]] - shift).max() <= FIT * spacing:
            return pairs
    text = (
        f"the particles of {name!r} do not stand opposite: both faces have to be the same but for a shift (jitter moves their"
        " particles; those of a turned lattice or a fitted surface may differ)"
    )
    raise SceneError("scene", [Fault(0, key, text)])


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
    key: str,
) -> None:
    """Refuse what is prescribed to some particles that are one and not to the others, or differs between them."""
    for slide in slides:
        there = [np.isin(seam, slide.particle) for seam in seams]
        if any(each.any() and not each.all() for each in there):
            raise SceneError("scene", [Fault(0, key, "a velocity along normals is prescribed at one side of it alone")])
    for (name, axis), values in entries.items():
        for seam in seams if name == "velocity" else ():
            given = [values[k] for k in seam.tolist() if k in values]
            apart = [AXES[k] for k in range(place.shape[1]) if np.ptp(place[seam, k]) > 0.0]
            odd = any(not same(given[0], value) for value in given) or (given and varies(given[0], apart))
            if given and (len(given) < len(seam) or odd):
                text = f"the velocity {AXES[axis]} is prescribed at one side of it and not alike at the other"
                raise SceneError("scene", [Fault(0, key, text)])


@cache
def _kernel(space: Space, layout: Layout) -> wp.Kernel:
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def join(
        first: int,
        offsets: wp.array(dtype=wp.int32),
        member: wp.array(dtype=wp.int32),
        share: wp.array(dtype=real),
        fields_out: Fields,
    ):
        g = first + wp.tid()
        total = vec()
        for k in range(offsets[g], offsets[g + 1]):
            total += share[k] * fields_out.velocity[member[k]]
        for k in range(offsets[g], offsets[g + 1]):
            fields_out.velocity[member[k]] = total

    return join


class Seam:
    """Groups of particles of a body that are one, g of them with m particles in all.

    _offsets  # (g + 1,) int32, where the particles of each begin
    _member   # (m,) int32
    _share    # (m,), their masses over that of the group
    """

    def __init__(self, seams: list[np.ndarray], mass: np.ndarray, space: Space, arrays: Arrays):
        """`mass` (n,) of all particles of the body."""
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
            inputs = [self._offsets, self._member, self._share]
            clock.launch(_kernel(self._space, state.layout), self.count, inputs, [state.struct])

    def project(self, velocity: np.ndarray) -> np.ndarray:
        """Velocities (n dim,) times the roots of masses, with what of them is no motion of groups taken out."""
        if not self.count:
            return velocity
        result = velocity.reshape(-1, self._space.dim).copy()
        weighted = (self._shares / self._roots)[:, None] * result[self._members]
        mean = np.repeat(np.add.reduceat(weighted, self._first), self._many, axis=0)
        result[self._members] = self._roots[:, None] * mean
        return result.ravel()
