"""Energy of the stabilisation: of the misfit of a linear field to the displacements."""

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.misfit import misfit
from wsph.sph.rows import rows_struct


def held_energy_kernel(space: Space, layout: Layout, apart: bool) -> wp.Kernel:
    """Partial sums of the energy over blocks of points, from `starts` on. `apart`: points have places of their own."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    Rows, Points, Answers, left_over = rows_struct(space), points_struct(space), answers_struct(space), misfit(space)

    @kernel(pairs=True)
    def held_energy(
        starts: wp.array(dtype=wp.int32),
        rows: Rows,
        points: Points,
        answers: Answers,
        fields: Fields,
        energy_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        total = wp.float64(0.0)
        for i in range(starts[block], starts[block + 1]):
            middle = vec()
            if wp.static(apart):
                middle = answers.mean[i]
            else:
                middle = fields.displacement[i]
            square = left_over(i, middle, points.centre[i], answers.gradient[i], rows, points.node, fields.displacement)
            total += wp.float64(real(0.5) * points.stabilisation * points.share[i] * square)
        energy_out[block] = total

    return held_energy
