"""The velocity gradient in the configuration at the end of a step, and what of the velocities it leaves out."""

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import generalized_inverse
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.updated.images import seen_image
from wsph.parts.terms import points_struct
from wsph.sph.rows import rows_struct
from wsph.sph.smoothing import SMOOTHING


def velocity_gradient_ahead(space: Space, layout: Layout, form: Form) -> wp.Function:
    """Warp function (c, dt, rows, points, fields, i) -> the velocity gradient in the current configuration dt ahead,
    from where the particles are by then, by the pairs as they will be then; of a form that `remembers` also the mean of the
    neighbours' velocities less the linear field of that gradient."""
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    imaged = seen_image(space, layout, form) if form.imaged else None
    slope, inverse, at = SMOOTHING[form.smoothing](space)[1], generalized_inverse(space), element(wp.int32, real, vec)

    @wp.func
    def gradient_ahead(c: Coefficients, dt: real, rows: Rows, points: Points, fields: Fields, i: int):
        v = fields.velocity[i]
        place = points.node[i] + fields.displacement[i]
        gradient = mat()
        moment = mat()
        total = real(0.0)
        middle = vec()
        mean = vec()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            dv = at(fields.velocity, j) - v
            r = ((at(points.node, j) + at(fields.displacement, j)) - place) + dt * dv
            w = -slope(wp.length(r) / c.h)
            wr = w * r
            gradient = gradient + wp.outer(dv, wr)
            moment = moment + wp.outer(wr, r)
            if wp.static(form.remembers):
                total = total + w
                middle = middle + wr
                mean = mean + w * dv
            k += 1
        if wp.static(form.imaged):
            for m in range(c.images.offsets[i], c.images.offsets[i + 1]):
                _j, _kind, r, w, dv = imaged(c, dt, points, fields, i, m)
                gradient = gradient + wp.outer(dv, w * r)
                moment = moment + wp.outer(w * r, r)
                total = total + w
                middle = middle + w * r
                mean = mean + w * dv
        b, _rank = inverse(moment, real(0.0))
        L = gradient * b
        if wp.static(form.remembers):
            left = vec()
            if total > real(0.0):
                left = (mean - L * middle) / total
            return L, left
        else:
            return L

    return gradient_ahead
