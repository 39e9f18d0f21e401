"""Rates of displacement, stress and internals."""

import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.form import Form, gathered, loop_options
from wsph.formulations.updated.gradient import gradient_ahead
from wsph.parts.pair_forces import pair_struct


def drift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    Fields = fields_struct(space, layout)

    @wp.kernel(module="unique", enable_backward=False)
    def drift(first: int, fields: Fields, rate_out: Fields):
        i = first + wp.tid()
        rate_out.displacement[i] = fields.velocity[i]

    return drift


def flow_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """Rates of stress and internals of a rate law and, in the current configuration, of the deformation."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    Params, Pair, respond, internal = laws.Params, pair_struct(space), laws.respond, laws.internal
    kept, midpoint, inverse = "internals" in dict(layout), laws.depends_on_stress, determinant_and_inverse(space)[1]
    of_velocity, ahead_gradient = (
        gathered(space, layout, form, smoothing, False),
        gradient_ahead(space, layout, smoothing),
    )
    determinant = determinant_and_inverse(space)[0]

    @wp.kernel(module="unique", enable_backward=False, module_options=loop_options(form))
    def flow(first: int, clock: wp.array(dtype=wp.float64), ahead: real, p: Params, pair: Pair, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
             weight: wp.array(dtype=real), node: wp.array(dtype=vec), centre: wp.array(dtype=vec), moment: wp.array(dtype=mat),
             fields: Fields, others: Fields, rate_out: Fields):  # fmt: skip
        i = first + wp.tid()
        dt = ahead * real(clock[1])
        L = mat()
        if wp.static(form.moving):
            # From where the particles are by then, and for the deformation by then, (F + dF)/2 in the middle of a step:
            # second order, and a turn of any angle stays one.
            L = ahead_gradient(pair, dt, offsets, indices, node, fields, i)
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            rate_out.deformation[i] = inverse(wp.identity(n=dim, dtype=real) - dt * L) * (L * F)
        else:
            gradient, _mean = of_velocity(pair, offsets, indices, weight, node, centre, others, others.velocity, i)
            change = gradient * moment[i]
            later = wp.identity(n=dim, dtype=real) + fields.deformation[i] + dt * change
            # Across a crack F says nothing: where it has no inverse, stress rests.
            if wp.static(form.damage != "") and determinant(later) < real(0.1):
                later = wp.identity(n=dim, dtype=real)
                change = mat()
            L = change * inverse(later)
        if wp.static(form.total):
            return
        s = fields.stress[i]
        q = internal()
        if wp.static(kept):
            q = fields.internals[i]
        ds, dq = respond(p, s, L, q)
        # A step that goes on from the start of its stress would be of first order where the law depends on it.
        if wp.static(midpoint) and dt > real(0.0):
            ds, dq = respond(p, s + dt * ds, L, q + dt * dq)
        rate_out.stress[i] = ds
        if wp.static(kept):
            rate_out.internals[i] = dq

    return flow
