"""Inertia, gravity and damping of every particle of a body. A scene that names neither pays for neither.

dv/dt = (div stress)/rho + g - rate v

Bodies of two sets take accelerations that change from place to place as a field of theirs; of one set these are loads.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

import numpy as np
import warp as wp

from wsph.backend.space import Space, Struct
from wsph.quantities import Model, Unit
from wsph.units import Scales


class Damping(Model):
    """Damping of every particle's motion: dv/dt = ... - rate v, rate in 1/s."""

    rate: Annotated[float, Unit("1/s", ge=0)]


@cache
def inertia_struct(space: Space, varied: bool) -> type:
    """Struct of the nondimensional density, damping rate and gravity, as kernels take it; where accelerations change from
    place to place (`varied`), of those of the particles too, (n,) vec."""
    annotations = {"density": space.scalar, "damping": space.scalar, "gravity": space.vec}
    annotations |= {"field": wp.array(dtype=space.vec)} if varied else {}
    return wp.struct(type("Inertia", (), {"__annotations__": annotations, "__module__": __name__}))


@dataclass(frozen=True)
class BodyForceKinds:
    """Which body forces a composition has: it decides the source of the kernels."""

    damped: bool
    heavy: bool
    varied: bool = False
    """Whether there are accelerations that change from place to place."""


@cache
def acceleration(space: Space, parts: BodyForceKinds) -> wp.Function:
    """Warp function (inertia, particle, force per volume, velocity) -> acceleration."""
    vec, Inertia = space.vec, inertia_struct(space, parts.varied)

    @wp.func
    def accelerated(body: Inertia, i: int, force: vec, velocity: vec) -> vec:
        a = force / body.density
        if wp.static(parts.heavy):
            a += body.gravity
        if wp.static(parts.varied):
            a += body.field[i]
        if wp.static(parts.damped):
            a -= body.damping * velocity
        return a

    return accelerated


def weightless(body: object, space: Space) -> object:
    """The inertia of a body without gravity and damping, for kernels that are to find its own forces alone."""
    bare = inertia_struct(space, False)()
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
        varied: bool = False,
    ):
        pull = np.array([gravity.get(axis, 0.0) for axis in "xyz"[: space.dim]])
        rate = damping.rate if damping is not None else 0.0
        self.parts = BodyForceKinds(damped=rate > 0.0, heavy=bool(pull.any()), varied=varied)
        self._space, self._density = space, density
        self._pull = pull * scales.time / scales.velocity
        self.rate = float(space.scalar(rate * scales.time))
        """Rate of the damping, nondimensional."""
        self.struct = self.among(None)

    def among(self, field: wp.array | None) -> Struct:
        """The struct for particles with further accelerations `field` (n,) vec."""
        space, struct = self._space, inertia_struct(self._space, self.parts.varied)()
        struct.density, struct.damping = space.scalar(self._density), space.scalar(self.rate)
        struct.gravity = space.vec(*self._pull)
        if field is not None:
            struct.field = field
        return struct
