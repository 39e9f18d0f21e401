"""Kernels of a form whose gradients and stresses are averaged over the edges of the cells: what stands before the answer of
the points, and what stands behind it."""

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.form import Form, coefficients_of, gathered, misfit_pull, smoothed
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def gradient_kernel(space: Space, layout: Layout, form: Form) -> wp.Kernel:
    """Gradients of the displacements or velocities, `field`, as pairs see them."""
    vec, mat, Fields = space.vec, space.mat, fields_struct(space, layout)
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    of_field = gathered(space, layout, form, False)

    @kernel(ranged=True, pairs=True)
    def gradient(
        first: int,
        c: Coefficients,
        rows: Rows,
        points: Points,
        others: Fields,
        field: wp.array(dtype=vec),
        gradient_out: wp.array(dtype=mat),
    ):
        i = first + wp.tid()
        sums, _mean = of_field(c, rows, points, others, field, i)
        gradient_out[i] = sums * points.moment[i]

    return gradient


def spread_kernel(space: Space, form: Form) -> wp.Kernel:
    """What forces take, from the averaged first Piola stresses."""
    Rows, Points, Answers, vec = rows_struct(space), points_struct(space), answers_struct(space), space.vec
    average, misfit = smoothed(space, form.averaged), misfit_pull(space)

    @kernel(ranged=True, pairs=True)
    def spread(first: int, rows: Rows, points: Points, displacement: wp.array(dtype=vec), answers_out: Answers):
        i = first + wp.tid()
        P = average(rows, points, answers_out.nominal, i)
        A = (points.volume[i] * P) * points.moment[i]
        if wp.static(form.stabilised and form.vectors):
            H = answers_out.gradient[i]
            A = A - misfit(rows, points, displacement, displacement[i], H, points.share[i], i) * points.moment[i]
        elif wp.static(form.stabilised):
            A = A - (points.stabilisation * points.share[i]) * answers_out.gradient[i]
        answers_out.corrected[i] = A

    return spread
