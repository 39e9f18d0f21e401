"""A skin around pairs that follow the motion: how far particles have gone since the pairs were found."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of
from wsph.backend.domain import WHOLE, Domain
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, largest
from wsph.backend.space import Space


@cache
def _travel_kernel(space: Space) -> wp.Kernel:
    vec = space.vec

    @kernel()
    def travel(
        clock: wp.array(dtype=wp.float64),
        found: wp.array(dtype=vec),
        u: wp.array(dtype=vec),
        v: wp.array(dtype=vec),
        low: int,
        end: int,
        furthest_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        furthest = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            moved = wp.float64(wp.length(u[i] - found[i]))
            # Half as fast again: stages and accelerations within a step.
            furthest = wp.max(furthest, moved + wp.float64(1.5) * dt_of(clock) * wp.float64(wp.length(v[i])))
        furthest_out[block] = furthest

    return travel


@cache
def _pace_kernel(space: Space) -> wp.Kernel:
    vec = space.vec

    @kernel()
    def pace(
        found: wp.array(dtype=vec),
        u: wp.array(dtype=vec),
        v: wp.array(dtype=vec),
        low: int,
        end: int,
        furthest_out: wp.array2d(dtype=wp.float64),
    ):
        block = wp.tid()
        way = wp.float64(0.0)
        speed = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            way = wp.max(way, wp.float64(wp.length(u[i] - found[i])))
            speed = wp.max(speed, wp.float64(wp.length(v[i])))
        furthest_out[block, 0] = way
        furthest_out[block, 1] = speed

    return pace


class Skin:
    """The skin of `n` particles. `found` holds the displacements at which the pairs were found, (n,) vec, nondimensional."""

    def __init__(self, space: Space, n: int, clock: Clock, domain: Domain = WHOLE, own: slice | None = None):
        """`own`: those that a process looks at, where others look at the rest."""
        self._space, self._clock, self._domain = space, clock, domain
        self._low, self._end = (0, n) if own is None else (own.start, own.stop)
        count = blocks(self._end - self._low)
        self.found = wp.zeros(n, dtype=space.vec, device=clock.device)
        self._furthest = wp.zeros(count, dtype=wp.float64, device=clock.device)
        self._pace = wp.zeros((count, 2), dtype=wp.float64, device=clock.device)

    def has_left(self, u: wp.array, v: wp.array, thickness: float) -> bool:
        """Whether a particle with displacement `u` and velocity `v`, (n,) vec, has moved, or can have moved by the end of
        the step, half of the thickness (a launch and a copy). False where that is not finite: the finite check says so."""
        inputs = [self._clock.time, self.found, u, v, self._low, self._end]
        travel, device = _travel_kernel(self._space), self._clock.device
        wp.launch(travel, len(self._furthest), inputs=inputs, outputs=[self._furthest], device=device)
        return 0.5 * thickness < largest(self._furthest, self._domain) < np.inf

    def gone(self, u: wp.array, v: wp.array) -> tuple[float, float]:
        """The longest way that a particle has moved, and the largest speed, of displacements `u` and velocities `v`, (n,)
        vec (a launch and a copy)."""
        inputs, device = [self.found, u, v, self._low, self._end], self._clock.device
        wp.launch(_pace_kernel(self._space), self._pace.shape[0], inputs=inputs, outputs=[self._pace], device=device)
        way, speed = self._domain.max(self._pace.numpy().max(0))
        return float(way), float(speed)
