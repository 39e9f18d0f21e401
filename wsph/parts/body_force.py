"""Inertia, gravity and damping of every particle of a body. A scene that names neither pays for neither.

dv/dt = (div stress)/rho + g - rate v
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.quantities import Model, Unit
from wsph.units import Scales


class Damping(Model):
    """Damping of every particle's motion: dv/dt = ... - rate v, rate in 1/s."""

    rate: Annotated[float, Unit("1/s", ge=0)]


@cache
def inertia_struct(space: Space) -> type:
    """Struct of the nondimensional density, damping rate and gravity, as kernels take it."""
    annotations = {"density": space.scalar, "damping": space.scalar, "gravity": space.vec}
    return wp.struct(type("Inertia", (), {"__annotations__": annotations, "__module__": __name__}))


@dataclass(frozen=True)
class BodyForceKinds:
    """Which body forces a composition has: it decides the source of the kernels."""

    damped: bool
    heavy: bool


@cache
def acceleration(space: Space, parts: BodyForceKinds) -> wp.Function:
    """Warp function (inertia, force per volume, velocity) -> acceleration."""
    vec, Inertia = space.vec, inertia_struct(space)

    @wp.func
    def accelerated(body: Inertia, force: vec, velocity: vec) -> vec:
        a = force / body.density
        if wp.static(parts.heavy):
            a += body.gravity
        if wp.static(parts.damped):
            a -= body.damping * velocity
        return a

    return accelerated


def weightless(body: object, space: Space) -> object:
    """The inertia of a body without gravity and damping, for kernels that are to find its own forces alone."""
    bare = inertia_struct(space)()
    bare.density, bare.damping, bare.gravity = body.density, space.scalar(0.0), space.vec()
    return bare


class BodyForce:
    """Gravity and damping of one body: `struct` goes to the kernels, `parts` says which of them there are."""

    def __init__(
        self,
        gravity: Mapping[Literal["x", "y", "z"], float],
        damping: Damping | None,
        space: Space,
        scales: Scales,
        density: float,
    ):
        pull = np.array([gravity.get(axis, 0.0) for axis in "xyz"[: space.dim]])
        rate = damping.rate if damping is not None else 0.0
        self.parts = BodyForceKinds(damped=rate > 0.0, heavy=bool(pull.any()))
        self.struct = inertia_struct(space)()
        self.struct.density = space.scalar(density)
        self.struct.damping = space.scalar(rate * scales.time)
        self.struct.gravity = space.vec(*(pull * scales.time / scales.velocity))
