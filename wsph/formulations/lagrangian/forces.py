"""Forces: of points on nodes, and between particles that are their own points."""

import warp as wp

from wsph.backend.pair_loops import PAIR_LOOPS, element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.form import Form, loop_options, seen_pair
from wsph.parts.body_force import Parts, acceleration, inertia_struct
from wsph.parts.pair_forces import pair_struct
from wsph.parts.viscosity import viscous_push
from wsph.sph.smoothing import SMOOTHING


def force_from_points_kernel(space: Space, layout: Layout, parts: Parts, form: Form) -> wp.Kernel:
    """Accelerations of nodes from the points that see them."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space)
    at, viscous = element(wp.int32, real, vec, mat), bool(form.parts.viscosity)

    @wp.kernel(module="unique", enable_backward=False, module_options=PAIR_LOOPS)
    def force_from_points(first: int, body: Inertia, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
              weight: wp.array(dtype=real), node: wp.array(dtype=vec), centre: wp.array(dtype=vec), share: wp.array(dtype=real), stiffness: real,
              mean: wp.array(dtype=vec), corrected: wp.array(dtype=mat), dragging: wp.array(dtype=mat), loads: wp.array(dtype=vec),
              own: wp.array(dtype=real), fields: Fields, rate_out: Fields):  # fmt: skip
        i = first + wp.tid()
        f = vec()
        drag = vec()
        u = fields.displacement[i]
        x = node[i]
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            p = at(indices, k)
            push = at(corrected, p) * (x - at(centre, p))
            if wp.static(form.residual):
                push = push + (stiffness * at(share, p)) * (u - at(mean, p))
            f = f - at(weight, k) * push
            if wp.static(viscous):
                drag = drag - at(weight, k) * (at(dragging, p) * (x - at(centre, p)))
            k += 1
        if wp.static(form.loaded):
            for a in range(wp.static(dim)):
                f += loads[i * dim + a]
        if wp.static(viscous):
            rate_out.drag[i] = drag / (own[i] * body.density)
            f += drag
        rate_out.velocity[i] = accelerated(body, f / own[i], fields.velocity[i])

    return force_from_points


def force_between_kernel(space: Space, layout: Layout, parts: Parts, form: Form, smoothing: str) -> wp.Kernel:
    """Accelerations of particles that are their own points, with what acts between pairs beside the stress."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space)
    Pair, value, residual = pair_struct(space), SMOOTHING[smoothing](space)[0], form.residual
    viscous, approach = bool(form.parts.viscosity), form.parts.viscosity == "approach"
    hourglass, artificial, holding = form.parts.hourglass, form.parts.artificial, form.parts.holding
    push, seen = viscous_push(space, form.parts.viscosity), seen_pair(space, layout, form, smoothing)
    at = element(wp.int32, real, vec, mat)

    @wp.kernel(module="unique", enable_backward=False, module_options=loop_options(form))
    def force_between(first: int, body: Inertia, pair: Pair, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
              weight: wp.array(dtype=real), node: wp.array(dtype=vec), moment: wp.array(dtype=mat), share: wp.array(dtype=real),
              volume: wp.array(dtype=real), stiffness: real, corrected: wp.array(dtype=mat),
              opposing_stress: wp.array(dtype=mat), loads: wp.array(dtype=vec), fields: Fields, others: Fields,
              holding_out: wp.array(dtype=vec), rate_out: Fields):  # fmt: skip
        i = first + wp.tid()
        u = fields.displacement[i]
        v = fields.velocity[i]
        A = corrected[i]
        own = real(0.0)
        M = mat()
        H = mat()
        if wp.static(residual or viscous or hourglass):
            own = share[i]
        if wp.static(form.paper or form.parts.own):
            M = moment[i]
        if wp.static(hourglass):
            H = real(2.0) * wp.identity(n=dim, dtype=real) + fields.deformation[i]
        f = vec()
        drag = vec()
        hold = vec()
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            r, w = seen(pair, weight, node, others, i, j, k)
            wr = w * r
            if wp.static(form.paper):
                f = f + (A + at(corrected, j)) * (M * wr)
            else:
                f = f + (A + at(corrected, j)) * wr
            both = real(0.0)
            if wp.static(residual or viscous or hourglass):
                both = w * (own + at(share, j))
            if wp.static(residual):
                # What is left of du beside H r: that part stands in the corrected stress.
                f = f + (stiffness * both) * (at(others.displacement, j) - u)
            if wp.static(viscous or holding):
                apart = r
                if wp.static(not form.moving):
                    apart = r + (at(others.displacement, j) - u)
                square = wp.dot(apart, apart)
                if wp.static(viscous):
                    closing = wp.dot(at(others.velocity, j) - v, apart)
                    if wp.static(approach):
                        closing = wp.min(closing, real(0.0))
                    pressure = push(pair, body.density, closing, square)
                    if wp.static(form.parts.own):
                        drag = drag + (pressure * volume[i]) * (M * wr)
                    else:
                        drag = drag + (real(wp.static(0.5 * dim)) * pressure * both) * apart
                if wp.static(hourglass):
                    # Twice the distance less what both deformations say of it, along the line between.
                    gap = real(2.0) - wp.dot((H + at(fields.deformation, j)) * r, apart) / square
                    hold = hold + (pair.spring * both * gap) * apart
                if wp.static(artificial):
                    near = wp.pow(value(wp.sqrt(square) / pair.h) / pair.at_spacing, pair.exponent)
                    hold = hold + near * ((opposing_stress[i] + at(opposing_stress, j)) * wr)
            k += 1
        if wp.static(form.loaded):
            for a in range(wp.static(dim)):
                f += loads[i * dim + a]
        if wp.static(viscous):
            rate_out.drag[i] = drag / (volume[i] * body.density)
            f += drag
        if wp.static(holding):
            holding_out[i] = hold / (volume[i] * body.density)
            f += hold
        rate_out.velocity[i] = accelerated(body, f / volume[i], v)

    return force_between
