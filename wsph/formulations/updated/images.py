"""Mirror images of particles behind the walls of a body (`wsph.boundary.walls`), in kernels and where they are.

The image of j behind a wall through a with normal n, Q = I - 2 n (x) n: x_g = Q x_j + 2 (a . n) n, v_g = S v_j + (I - S) v
with v the wall's velocity, and what forces take of it A_g = S A_j Q, q_g = S q_j. S turns round the components that the wall
prescribes. Of walls at an angle there are images of images. The sum over images of (A_i + A_g) w r is then the gradient of
the energy of the particles alone: nothing is lost, and a driven wall does the work sum w (A_i r + q_i) . b, b the part of
v_g that is the wall's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np
import warp as wp

from wsph.backend.domain import Domain, any_of
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.boundary.walls import Wall
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.parts.terms import points_struct
from wsph.sph.pairs import Pairs, find_pairs
from wsph.sph.smoothing import SMOOTHING


@cache
def seen_image(space: Space, layout: Layout, form: Form) -> wp.Function:
    """Warp function (c, dt, points, fields, i, k) -> (j, kind, r, w, dv) of the pair k of particle i and an image, of
    particle j, dt ahead: r from i to the image, dv its velocity less that of i."""
    real, Fields = space.scalar, fields_struct(space, layout)
    Coefficients, Points = coefficients_of(space, form), points_struct(space)
    slope = SMOOTHING[form.smoothing](space)[1]

    @wp.func
    def seen(c: Coefficients, dt: real, points: Points, fields: Fields, i: int, k: int):
        images = c.images
        g = images.indices[k]
        j = images.parent[g]
        kind = images.kind[g]
        v = fields.velocity[i]
        vj = fields.velocity[j]
        place = points.node[j] + fields.displacement[j] + dt * vj
        there = images.turn[kind] * place + images.shift[kind] + dt * images.going[kind]
        r = there - (points.node[i] + fields.displacement[i] + dt * v)
        dv = images.flip[kind] * vj + images.drive[kind] - v
        return j, kind, r, -slope(wp.length(r) / c.h), dv

    return seen


@dataclass(frozen=True)
class Kind:
    """Images behind one wall, or several at an angle: their numbers, Q, S, and the particles that have and see them."""

    walls: tuple[int, ...]
    turn: np.ndarray
    flip: np.ndarray
    columns: np.ndarray


def kinds_of(walls: list[Wall], domain: Domain) -> list[Kind]:
    """The kinds of images behind some walls that any part of the body has, those of one wall first."""
    found: list[Kind] = []
    one = np.eye(len(walls[0].normal)) if walls else np.eye(1)
    for count in range(1, len(one) + 1):
        for chosen in combinations(range(len(walls)), count):
            axes, columns = {walls[k].axis for k in chosen}, np.logical_and.reduce([walls[k].columns for k in chosen])
            if len(axes) == count and any_of(domain, bool(columns.any())):
                turn, flip = one, one
                for k in chosen:
                    turn = (one - 2.0 * np.outer(walls[k].normal, walls[k].normal)) @ turn
                    flip = flip_of(walls[k]) @ flip
                found.append(Kind(chosen, turn, flip, columns))
    return found


def flip_of(wall: Wall) -> np.ndarray:
    """S of a wall, (dim, dim)."""
    return np.diag([-1.0 if k in wall.velocity else 1.0 for k in range(len(wall.normal))])


def shifts_of(kinds: Sequence[Kind], walls: list[Wall], origin: np.ndarray) -> np.ndarray:
    """Where images of every kind stand at the start, about `origin` [m]: x_g less Q x, (kinds, dim) [m]."""
    apart = [2.0 * float((wall.point - origin) @ wall.normal) * wall.normal for wall in walls]
    return np.array([np.sum([apart[k] for k in kind.walls], 0) for kind in kinds])


def find_images(
    kinds: Sequence[Kind],
    shift: np.ndarray,
    place: np.ndarray,
    reach: float,
    device: str,
    wanted: np.ndarray | None = None,
) -> tuple[Pairs, np.ndarray, np.ndarray]:
    """Pairs of particles at `place` (n, dim), or of those `wanted` (n,) bool, with images nearer than `reach`, and the
    particle and the kind of each image. `shift` (kinds, dim) as in `images_struct`; all nondimensional."""
    parents, numbers, images = [], [], []
    for number, kind in enumerate(kinds):
        there = place[kind.columns] @ kind.turn.T + shift[number]
        near = np.linalg.norm(there - place[kind.columns], axis=1) < 2.0 * reach
        parents.append(np.flatnonzero(kind.columns)[near])
        numbers.append(np.full(int(near.sum()), number))
        images.append(there[near])
    parent, number, there = np.concatenate(parents), np.concatenate(numbers), np.concatenate(images)
    pairs = find_pairs(place, there, reach, device, wanted=wanted)
    sees = np.stack([kind.columns for kind in kinds])
    return pairs.where(sees[number[pairs.indices.numpy()], pairs.rows()]), parent, number
