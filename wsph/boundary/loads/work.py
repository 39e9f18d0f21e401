"""Work of loads on a one-set body: the mean force of a step times the way in it."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.parts.works import Works


@cache
def _work_kernel(space: Space, layout: Layout) -> wp.Kernel:
    vec, Fields = space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def work(
        first: int,
        particle: wp.array(dtype=wp.int32),
        force: wp.array(dtype=vec),
        fields: Fields,
        count: int,
        before_out: wp.array(dtype=vec),
        place_out: wp.array(dtype=vec),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        for e in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            f = force[particle[e]]
            u = fields.displacement[particle[e]]
            total += wp.float64(wp.dot(f + before_out[e], u - place_out[e]))
            before_out[e] = f
            place_out[e] = u
        work_out[block, 0] = work_out[block, 0] + wp.float64(0.5) * total

    return work


class LoadWork(Works):
    """Work of forces on p particles, those of a step's end as they stand when it is added. A load that does not change has
    done the work of its potential, to rounding.

    _particle  # (p,) int32
    _force     # (n,) vec, of all particles of the body
    _before    # (p,) vec, forces at the end of the last step
    _place     # (p,) vec, displacements there
    """

    columns = 1

    def __init__(self, particles: np.ndarray, force: wp.array, space: Space, device: str):
        """Of the forces `force` (n,) vec on the `particles` (p,)."""
        super().__init__(len(particles), len(particles) > 0, device)
        self._space, self._force = space, force
        if self._acts:
            self._particle = wp.array(particles, dtype=wp.int32, device=device)
            self._before = wp.zeros(self._n, dtype=space.vec, device=device)
            self._place = wp.zeros_like(self._before)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        inputs = [self._particle, self._force, state.struct, self._n]
        return _work_kernel(self._space, state.layout), inputs, [self._before, self._place]

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | ({"before": self._before, "place": self._place} if self._acts else {})

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return self._total(0)
