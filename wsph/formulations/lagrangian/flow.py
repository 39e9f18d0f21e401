"""Rates of displacement, stress and internals, and in the current configuration of the deformation."""

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.evolution import evolution
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.form import Form, coefficients_of, gathered, smoothed
from wsph.parts.fading import row_of
from wsph.parts.terms import points_struct
from wsph.sph.rows import rows_struct


def drift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """du/dt = v."""
    Fields = fields_struct(space, layout)

    @kernel(ranged=True)
    def drift(first: int, fields: Fields, rate_out: Fields):
        i = first + wp.tid()
        rate_out.displacement[i] = fields.velocity[i]

    return drift


def flow_kernel(
    space: Space, laws: Laws, layout: Layout, form: Form, ahead_gradient: wp.Function | None = None
) -> wp.Kernel:
    """Rates of stress and internals of a rate law and, in the current configuration, of the deformation.

    `gradients` are those of the velocities, as pairs see them, where the form averages them; `dilation`, where volumes are
    averaged over blocks, what makes the trace of a particle's gradient its block's; else they are not read.
    `ahead_gradient`, for the current configuration: Warp function (c, dt, rows, points, fields, i) -> the velocity gradient
    dt ahead, and of a form that `remembers` what of the neighbours' velocities is not linear.
    """
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Params, internal, evolve = laws.Params, laws.internal, evolution(space, laws)
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    kept, (determinant, inverse) = "internals" in layout, determinant_and_inverse(space)
    of_velocity = gathered(space, layout, form, False)
    of_later, average = ahead_gradient or of_velocity, smoothed(space, form.averaged)
    row = row_of(space, form.beside)

    @kernel(ranged=True, pairs=not form.moving)
    def flow(
        first: int,
        clock: wp.array(dtype=wp.float64),
        ahead: real,
        p: Params,
        c: Coefficients,
        rows: Rows,
        points: Points,
        gradients: wp.array(dtype=mat),
        dilation: wp.array(dtype=real),
        fields: Fields,
        others: Fields,
        rate_out: Fields,
    ):
        i = first + wp.tid()
        k = row(points, i)
        dt = ahead * real(dt_of(clock))
        L = mat()
        later = mat()
        if wp.static(form.moving):
            # From where the particles are by then, and for the deformation by then, (F + dF)/2 in the middle of a step:
            # second order, and a turn of any angle stays one.
            if wp.static(form.remembers):
                L, apart = of_later(c, dt, rows, points, fields, i)
                to_start = inverse(wp.identity(n=dim, dtype=real) + fields.deformation[i])
                rate_out.deviation[i] = to_start * (apart - dt * (L * apart))
            else:
                L = of_later(c, dt, rows, points, fields, i)
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            change = inverse(wp.identity(n=dim, dtype=real) - dt * L) * (L * F)
            later = F + dt * change
            rate_out.deformation[i] = change
        else:
            change = mat()
            if wp.static(form.staged):
                change = average(rows, points, gradients, i)
            else:
                gradient, _mean = of_velocity(c, rows, points, others, others.velocity, i)
                change = gradient * points.moment[i]
            later = wp.identity(n=dim, dtype=real) + fields.deformation[k] + dt * change
            # Across a crack F says nothing: where it has no inverse, stress rests.
            if wp.static(form.breaks) and determinant(later) < real(0.1):
                later = wp.identity(n=dim, dtype=real)
                change = mat()
            L = change * inverse(later)
            if wp.static(form.blocks):
                L += dilation[i] * wp.identity(n=dim, dtype=real)
        if wp.static(form.total):
            return
        s = fields.stress[k]
        q = internal()
        if wp.static(kept):
            q = fields.internals[k]
        ds, dq = evolve(p, s, q, later, L, dt)
        rate_out.stress[k] = ds
        if wp.static(kept):
            rate_out.internals[k] = dq

    return flow
