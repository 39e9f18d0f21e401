"""Inertia, gravity and damping of every particle of a body. A scene that names neither pays for neither.

dv/dt = (div stress)/rho + g - rate v
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.parts.works import Works
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


@cache
def _work_kernel(space: Space, layout: Layout) -> wp.Kernel:
    Inertia, Fields = inertia_struct(space), fields_struct(space, layout)

    @wp.kernel(module="unique", enable_backward=False)
    def work(first: int, count: int, clock: wp.array(dtype=wp.float64), body: Inertia, volume: wp.array(dtype=space.scalar),
             fields: Fields, power_out: wp.array2d(dtype=wp.float64), work_out: wp.array2d(dtype=wp.float64)):  # fmt: skip
        block = first + wp.tid()
        lifted = wp.float64(0.0)
        damped = wp.float64(0.0)
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            v = fields.velocity[i]
            mass = wp.float64(body.density * volume[i])
            lifted += mass * wp.float64(wp.dot(body.gravity, v))
            damped += mass * wp.float64(body.damping * wp.dot(v, v))
        half = wp.float64(0.5) * clock[1]
        work_out[block, 0] = work_out[block, 0] + half * (lifted + power_out[block, 0])
        work_out[block, 1] = work_out[block, 1] + half * (damped + power_out[block, 1])
        power_out[block, 0] = lifted
        power_out[block, 1] = damped

    return work


class BodyForce(Works):
    """Gravity and damping of one body, and their work. `struct` goes to the kernels."""

    def __init__(
        self,
        gravity: Mapping[str, float],
        damping: Damping | None,
        space: Space,
        scales: Scales,
        density: float,
        volume: np.ndarray,
        device: str,
    ):
        pull = np.array([gravity.get(axis, 0.0) for axis in "xyz"[: space.dim]])
        rate = damping.rate if damping is not None else 0.0
        self.parts = BodyForceKinds(damped=rate > 0.0, heavy=bool(pull.any()))
        super().__init__(len(volume), self.parts.damped or self.parts.heavy, device)
        self._space = space
        self.struct = inertia_struct(space)()
        self.struct.density = space.scalar(density)
        self.struct.damping = space.scalar(rate * scales.time)
        self.struct.gravity = space.vec(*(pull * scales.time / scales.velocity))
        if self._acts:
            self._volume = wp.array(volume, dtype=space.scalar, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object]]:
        kernel = _work_kernel(self._space, state.layout)
        return kernel, [self._n, clock.time, self.struct, self._volume, state.struct]

    @property
    def gravity_work(self) -> float:
        """Work of gravity so far, nondimensional."""
        return self._total(0)

    @property
    def damped(self) -> float:
        """Energy that damping has taken so far, nondimensional."""
        return self._total(1)
