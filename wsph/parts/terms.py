"""Terms: the Warp functions that parts add to the loops over pairs and to the answer of a point, and their structs.

A term is a value: compositions whose terms are equal share their kernels, so a term holds the choices that decide its
source, and no number that a scene may choose. Numbers stand in the struct of coefficients, by the names that the term gives
them.
"""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal, Protocol, cast

import warp as wp

from wsph.backend.space import Array, Space
from wsph.backend.state import Layout
from wsph.constitutive.laws import Laws
from wsph.sph.images import images_struct


class Images(Protocol):
    """Mirror images of particles, as `wsph.sph.images.images_struct` has them."""

    offsets: Array
    indices: Array
    parent: Array
    kind: Array
    turn: Array
    flip: Array
    shift: Array
    going: Array
    drive: Array


class Coefficients(Protocol):
    """What every body has of the struct of `coefficients_struct`."""

    speed: float
    h: float
    images: Images
    """Where particles have images."""


@cache
def coefficients_struct(space: Space, names: tuple[str, ...] = (), imaged: bool = False) -> type:
    """Struct of nondimensional coefficients: the speed sqrt(E/rho), the smoothing length h, and those that terms name; where
    particles are `imaged`, beside them their images (`wsph.sph.images`)."""
    annotations: dict[str, object] = dict.fromkeys(("speed", "h", *names), space.scalar)
    if imaged:
        annotations["images"] = images_struct(space)
    return cast(type, wp.struct(type("Coefficients", (), {"__annotations__": annotations, "__module__": __name__})))


class Points(Protocol):
    """What points have of their own, as `points_struct` has it."""

    node: Array
    centre: Array
    moment: Array
    volume: Array
    share: Array
    whole: Array
    slope: Array
    back: Array
    row: Array
    stabilisation: float


@cache
def points_struct(space: Space) -> type:
    """Struct of the points' own arrays, nondimensional, m points and n particles.

    node           # places of the particles, (n,) vec
    centre         # places of the points, (m,) vec
    moment         # inverse second moments of a point's particles, (m,) mat
    volume         # (m,)
    share          # volume over the spread of a point's particles, (m,)
    whole          # the same as drag takes it: before it fades (`wsph.parts.fading`), (m,)
    slope, back    # V_p times the gradient's weight of a pair from p, and of the same pair the other way, (pairs,) vec,
                   # where they are no weights' times r; of points with places of their own `back` is `slope` by particle
    row            # where their fields stand in those of the state, (m,) int32, of some points of a body alone
    stabilisation  # stiffness against the misfit of a linear field to the displacements
    """
    real, vec, mat = space.scalar, space.vec, space.mat
    annotations: dict[str, object] = {
        "node": wp.array(dtype=vec),
        "centre": wp.array(dtype=vec),
        "moment": wp.array(dtype=mat),
        "volume": wp.array(dtype=real),
        "share": wp.array(dtype=real),
        "whole": wp.array(dtype=real),
        "slope": wp.array(dtype=vec),
        "back": wp.array(dtype=vec),
        "row": wp.array(dtype=wp.int32),
        "stabilisation": real,
    }
    return cast(type, wp.struct(type("Points", (), {"__annotations__": annotations, "__module__": __name__})))


def with_share(space: Space, points: Points, share: Array, *, fades: bool) -> Points:
    """The struct of `points` with the shares (m,) that a part has reduced; where what holds spurious modes `fades`, what
    drags stays as it was: a plastic shock needs its viscosity."""
    found: Points = points_struct(space)()
    for name in ("node", "centre", "moment", "volume", "slope", "back", "row", "stabilisation"):
        setattr(found, name, getattr(points, name))
    found.share = share
    found.whole = points.share if fades else share
    return found


@cache
def answers_struct(space: Space) -> type:
    """Struct of the points' answers to a state, from which forces are computed.

    mean       # mean displacement of a point's particles, (m,) vec, where points have places of their own
    corrected  # volume times first Piola stress times moment, less what the stabilisation has there, (m,) mat
    extra      # the same of a stress or rate term, (m,) mat, where there is one
    gradient   # displacement gradient as pairs see it, (m,) mat: the state's deformation, unless that is averaged
    nominal    # first Piola stress before it is averaged, (m,) mat, where it is
    """
    annotations: dict[str, object] = {
        "mean": wp.array(dtype=space.vec),
        "corrected": wp.array(dtype=space.mat),
        "extra": wp.array(dtype=space.mat),
        "gradient": wp.array(dtype=space.mat),
        "nominal": wp.array(dtype=space.mat),
    }
    return cast(type, wp.struct(type("Answers", (), {"__annotations__": annotations, "__module__": __name__})))


@dataclass(frozen=True)
class PairTerm:
    """A force between two particles that are their own points, beside the stress.

    `make(space, layout, smoothing, coefficients)` gives the Warp function (c: coefficients, density, points, answers,
    fields, others, i, j, wr, r, apart, square, both) -> the force on i, vec: r from i to j where the weights were found
    and wr that times the weight of the pair, `apart` from i to j now and `square` its own, `both` the weight times the
    sum of the two shares. Its sum is a "drag", which depends on velocities and is dissipated, or a "hold", which holds
    spurious modes. `shares`: it takes `both`; `one_sided`: it acts on approach alone. `along(space, coefficients)`, of a
    force along the line of the two that is in proportion to `both`: the Warp function (c, density, closing velocity v_j -
    v_i, (H_i + H_j) r of their gradients as pairs see them, r, apart, square) -> the factor of `both` times `apart`.
    """

    sum: Literal["drag", "hold"]
    make: Callable[[Space, Layout, str, type], wp.Function]
    coefficients: tuple[str, ...]
    shares: bool = False
    one_sided: bool = False
    along: Callable[[Space, type], wp.Function] | None = None


@dataclass(frozen=True)
class StressTerm:
    """A stress that the stress of a point calls forth; its pair term takes it from `answers.extra`. `make(space,
    coefficients)` gives the Warp function (c, in-plane Cauchy stress) -> stress, dim x dim."""

    make: Callable[[Space, type], wp.Function]
    coefficients: tuple[str, ...]


@dataclass(frozen=True)
class RateTerm:
    """A stress that the velocity gradient calls forth. `make(space, coefficients)` gives the Warp function (c, h, density,
    velocity gradient) -> Cauchy stress, dim x dim; h is the length of the point. `one_sided`: it acts against
    compression alone."""

    make: Callable[[Space, type], wp.Function]
    coefficients: tuple[str, ...]
    one_sided: bool = False


@dataclass(frozen=True)
class Response:
    """The answer of a point in place of its law.

    `struct(space)` is what it takes and writes; `make(space, laws, layout)` gives the Warp function (p, struct_out, rows,
    fields_out, share, H, i) -> (the share as it is left, first Piola stress); `energy(space, laws)` the Warp function (p,
    H, stress, damage) -> energy density, of a total law per reference volume, of a rate law per current volume.
    """

    model: str
    struct: Callable[[Space], type]
    make: Callable[[Space, Laws, Layout], wp.Function]
    energy: Callable[[Space, Laws], wp.Function]
