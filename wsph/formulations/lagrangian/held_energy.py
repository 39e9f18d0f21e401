"""Energy of what holds spurious modes."""

import warp as wp

from wsph.backend.pair_loops import PAIR_LOOPS
from wsph.backend.space import Space
from wsph.sph.misfit import misfit

BLOCK = 1024
"""Points in one partial sum: the same for any number of threads."""


def held_energy_kernel(space: Space, Fields: type, points: bool) -> wp.Kernel:
    real, vec, left_over = space.scalar, space.vec, misfit(space)

    @wp.kernel(module="unique", enable_backward=False, module_options=PAIR_LOOPS)
    def residual(count: int, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                 weight: wp.array(dtype=real), node: wp.array(dtype=vec), centre: wp.array(dtype=vec), share: wp.array(dtype=real), stiffness: real,
                 mean: wp.array(dtype=vec), fields: Fields, energy_out: wp.array(dtype=wp.float64)):  # fmt: skip
        block = wp.tid()
        total = wp.float64(0.0)
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            middle = vec()
            if wp.static(points):
                middle = mean[i]
            else:
                middle = fields.displacement[i]
            square = left_over(
                i, middle, centre[i], fields.deformation[i], offsets, indices, weight, node, fields.displacement
            )
            total += wp.float64(real(0.5) * stiffness * share[i] * square)
        energy_out[block] = total

    return residual
