"""Particles that slide along faces: the velocity along the faces' own normals is prescribed, n.v = g, and what else is free.

The normal of a particle is that of the faces that an entry selects at it, the sum of their N_j n dA, in the reference
configuration. With all that is prescribed at a particle, rows N of normals and coordinate axes and values g, v becomes
(I - N^+ N) v + N^+ g: the least change of velocity that meets them, so that without friction a body feels forces along
the normals alone. Components that are prescribed beside are set first, and stand among the rows, so that both hold.
"""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.prescribed import Moved, Prescribed, nonzero
from wsph.boundary.programs.windows import Windowed
from wsph.errors import Fault, SceneError

FLAT = 1e-9
"""Part of the largest below which a row adds no direction."""


@dataclass(frozen=True)
class Slide:
    """A prescribed velocity `value` [m/s] along the normals (k, dim) of particles (k,), by boundary `owner`, at `key`."""

    key: str
    value: Prescribed
    particle: np.ndarray
    normal: np.ndarray
    owner: int = -1


@dataclass(frozen=True)
class Slides:
    """What of the velocities is left free: of k particles (k,) `free` (k, dim, dim) = I - N^+ N, and what is prescribed of
    the rest, as rows that add up.

    A change of the velocity in the space of N is the sum of those that the rows make, along N_r each: N_r (N^+)_r times it.
    By r rows, `row` (r,) is the place among the k particles, `share` (r, dim, dim) that matrix, `owner` (r,) the boundary.
    """

    particle: np.ndarray
    free: np.ndarray
    given: list[FaceLoad]
    row: np.ndarray
    share: np.ndarray
    owner: np.ndarray

    def project(self, velocity: np.ndarray) -> np.ndarray:
        """Velocities (n dim,), or what goes by their components, with what is prescribed taken out."""
        if not len(self.particle):
            return velocity
        result = velocity.reshape(-1, self.free.shape[1]).copy()
        result[self.particle] = np.einsum("kab,kb->ka", self.free, result[self.particle])
        return result.ravel()


def slides_of(
    slides: list[Slide],
    entries: dict[tuple[str, int], dict[int, Moved]],
    dim: int,
    owners: Mapping[tuple[str, int], Mapping[int, tuple[tuple[float, float, int], ...]]] | None = None,
) -> Slides:
    """All sliding of a body together, with the velocity components that are prescribed beside, by the boundaries `owners`.
    Raises SceneError where what is prescribed at a particle is not independent, normals alike or more of them than there are
    directions, unless all of it is zero."""
    rows: dict[int, list[tuple[np.ndarray, Prescribed, str, int]]] = {}
    for slide in slides:
        for particle, normal in zip(slide.particle.tolist(), slide.normal, strict=True):
            rows.setdefault(particle, []).append((normal, slide.value, slide.key, slide.owner))
    for (name, axis), values in entries.items():
        for particle in rows.keys() & values.keys() if name == "velocity" else ():
            value = values[particle]
            if isinstance(value, Motion):
                text = f"a {value.kind} is prescribed beside it: write the velocity there"
                raise SceneError("scene", [Fault(0, slides[0].key, text)])
            if isinstance(value, Windowed):
                text = "slides particles whose velocity holds in some steps alone: select others, or leave out steps"
                raise SceneError("scene", [Fault(0, slides[0].key, text)])
            # In all steps of the run one.
            owned = (owners or {}).get((name, axis), {}).get(particle)
            owner = owned[0][2] if owned else -1
            rows[particle].append((np.eye(dim)[axis], value, slides[0].key, owner))
    free, given = np.zeros((len(rows), dim, dim)), list[FaceLoad]()
    shares: list[tuple[int, np.ndarray, int]] = []
    pushes: dict[int, tuple[Prescribed, list[int], list[np.ndarray]]] = {}
    for k, (particle, each) in enumerate(sorted(rows.items())):
        N = np.array([normal for normal, _, _, _ in each])
        inverse = np.linalg.pinv(N, rcond=FLAT)
        free[k] = np.eye(dim) - inverse @ N
        moved = [nonzero(value) for _, value, _, _ in each]
        if any(moved) and np.linalg.matrix_rank(N, tol=FLAT) < len(N):
            text = "prescribes velocities along normals that another entry prescribes too: select each face once"
            raise SceneError("scene", [Fault(0, each[moved.index(True)][2], text)])
        for column, (normal, value, _, owner) in enumerate(each):
            shares.append((k, np.outer(normal, inverse[:, column]), owner))
            if nonzero(value):
                _, particles, push = pushes.setdefault(id(value), (value, [], []))
                particles.append(particle)
                push.append(inverse[:, column])
    for value, particles, push in pushes.values():
        given.append(FaceLoad(value, np.array(particles), np.array(push), np.zeros(len(particles), int)))
    row, share, owner = ([each[c] for each in shares] for c in range(3))
    of_rows = np.array(row, int), np.array(share).reshape(-1, dim, dim), np.array(owner, int)
    return Slides(np.array(sorted(rows), int), free, given, *of_rows)
