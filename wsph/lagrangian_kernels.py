"""Kernels of the Lagrangian forms (`wsph.lagrangian` has the equations): strain and stress at the points, forces at the
nodes, rates of laws."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.body_force import Parts, acceleration, inertia_struct
from wsph.constitutive import Laws
from wsph.contiguous import element
from wsph.operators import generalized_inverse, misfit
from wsph.pair_forces import PairParts, opposing_stress, pair_struct, viscous_push, viscous_stress
from wsph.pair_loops import PAIR_LOOPS
from wsph.phase_field import damage_around
from wsph.phase_laws import damaged, phase_struct
from wsph.smoothing import SMOOTHING
from wsph.space import Space, determinant_and_inverse, in_plane
from wsph.state import Layout, fields_struct
from wsph.stress_state import packing

BLOCK = 1024
"""Points in one partial sum: the same for any number of threads."""


@dataclass(frozen=True)
class Form:
    """What the kernels of a composition are made for. `moving`: pairs are seen in the current configuration."""

    points: bool
    total: bool
    residual: bool
    loaded: bool
    paper: bool
    parts: PairParts
    moving: bool = False
    damage: str = ""
    """How a body breaks: the model of its phase field, or "links"."""


@cache
def _seen(space: Space, layout: Layout, form: Form, smoothing: str) -> wp.Function:
    """Warp function (pair, weight, node, fields, i, j, k) -> (r, w) of pair k, from i to j: from the reference configuration
    as stored, or from the current one."""
    real, vec, Fields, Pair = space.scalar, space.vec, fields_struct(space, layout), pair_struct(space)
    slope, at = SMOOTHING[smoothing](space)[1], element(real, vec)
    if form.moving:

        @wp.func
        def now(
            pair: Pair, weight: wp.array(dtype=real), node: wp.array(dtype=vec), fields: Fields, i: int, j: int, k: int
        ):
            r = (at(node, j) - at(node, i)) + (at(fields.displacement, j) - at(fields.displacement, i))
            return r, -slope(wp.length(r) / pair.h)

        return now

    @wp.func
    def at_start(
        pair: Pair, weight: wp.array(dtype=real), node: wp.array(dtype=vec), fields: Fields, i: int, j: int, k: int
    ):
        return at(node, j) - at(node, i), at(weight, k)

    return at_start


@cache
def _gathered(space: Space, layout: Layout, form: Form, smoothing: str, averaged: bool) -> wp.Function:
    """Warp function (pair, offsets, indices, weight, node, centre, others, field, i) -> the sum of w (f_j - f_i) (x) r over
    the pairs of i, and where `averaged` the weighted mean of f."""
    real, vec, mat, Fields, Pair = space.scalar, space.vec, space.mat, fields_struct(space, layout), pair_struct(space)
    points, seen, at = form.points, _seen(space, layout, form, smoothing), element(wp.int32, real, vec)

    @wp.func
    def gathered(pair: Pair, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                 node: wp.array(dtype=vec), centre: wp.array(dtype=vec), others: Fields, field: wp.array(dtype=vec), i: int):  # fmt: skip
        near = i
        if wp.static(points):
            near = indices[offsets[i]]
        f0 = field[near]
        gradient = mat()
        mean = vec()
        c = centre[i]
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            if wp.static(points):
                r = at(node, j) - c
                w = at(weight, k)
            else:
                r, w = seen(pair, weight, node, others, i, j, k)
            df = w * (at(field, j) - f0)
            gradient = gradient + wp.outer(df, r)
            if wp.static(averaged):
                mean = mean + df
            k += 1
        return gradient, f0 + mean

    return gathered


class Kernels:
    """The kernels of a composition: one instance per (space, laws, which fields there are, form).

    `strain` (`moments` in the current configuration) finds what forces take of every point, `force` the accelerations,
    `drift` and `flow` the rates of the rest, `residual` the energy of the residual; those that the form has.
    """

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: Parts, form: Form, smoothing: str):
        if form.moving:
            self.moments = _moments_kernel(space, laws, layout, form, smoothing)
        else:
            self.strain = _strain_kernel(space, laws, layout, form, smoothing)
        if form.points:
            self.force = _force_from_points_kernel(space, layout, parts, form)
        else:
            self.force = _force_between_kernel(space, layout, parts, form, smoothing)
        self.drift = _drift_kernel(space, layout)
        if form.residual:
            self.residual = _residual_kernel(space, fields_struct(space, layout), form.points)
        if form.moving or not form.total:
            self.flow = _flow_kernel(space, laws, layout, form, smoothing)


def _loops(form: Form) -> dict[str, str] | None:
    """How the pair loops of a form are compiled: rows of the current configuration have pairs without weight in them, and
    sums in vectors would depend on how many."""
    return None if form.moving else PAIR_LOOPS


def _force_from_points_kernel(space: Space, layout: Layout, parts: Parts, form: Form) -> wp.Kernel:
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


def _force_between_kernel(space: Space, layout: Layout, parts: Parts, form: Form, smoothing: str) -> wp.Kernel:
    """Accelerations of particles that are their own points, with what acts between pairs beside the stress."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space)
    Pair, value, residual = pair_struct(space), SMOOTHING[smoothing](space)[0], form.residual
    viscous, approach = bool(form.parts.viscosity), form.parts.viscosity == "approach"
    hourglass, artificial, holding = form.parts.hourglass, form.parts.artificial, form.parts.holding
    push, seen = viscous_push(space, form.parts.viscosity), _seen(space, layout, form, smoothing)
    at = element(wp.int32, real, vec, mat)

    @wp.kernel(module="unique", enable_backward=False, module_options=_loops(form))
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


def _drift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    Fields = fields_struct(space, layout)

    @wp.kernel(module="unique", enable_backward=False)
    def drift(first: int, fields: Fields, rate_out: Fields):
        i = first + wp.tid()
        rate_out.displacement[i] = fields.velocity[i]

    return drift


@cache
def _gradient_ahead(space: Space, layout: Layout, smoothing: str) -> wp.Function:
    """Warp function (pair, dt, offsets, indices, node, fields, i) -> the velocity gradient in the current configuration dt
    ahead, by the pairs as they will be then."""
    real, vec, mat, Fields, Pair = space.scalar, space.vec, space.mat, fields_struct(space, layout), pair_struct(space)
    slope, inverse, at = SMOOTHING[smoothing](space)[1], generalized_inverse(space), element(wp.int32, real, vec)

    @wp.func
    def gradient_ahead(pair: Pair, dt: real, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                       node: wp.array(dtype=vec), fields: Fields, i: int):  # fmt: skip
        v = fields.velocity[i]
        place = node[i] + fields.displacement[i]
        gradient = mat()
        moment = mat()
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            dv = at(fields.velocity, j) - v
            r = ((at(node, j) + at(fields.displacement, j)) - place) + dt * dv
            wr = -slope(wp.length(r) / pair.h) * r
            gradient = gradient + wp.outer(dv, wr)
            moment = moment + wp.outer(wr, r)
            k += 1
        b, _rank = inverse(moment, real(0.0))
        return gradient * b

    return gradient_ahead


def _flow_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """Rates of stress and internals of a rate law and, in the current configuration, of the deformation."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    Params, Pair, respond, internal = laws.Params, pair_struct(space), laws.respond, laws.internal
    kept, midpoint, inverse = "internals" in dict(layout), laws.depends_on_stress, determinant_and_inverse(space)[1]
    of_velocity, ahead_gradient = (
        _gathered(space, layout, form, smoothing, False),
        _gradient_ahead(space, layout, smoothing),
    )
    determinant = determinant_and_inverse(space)[0]

    @wp.kernel(module="unique", enable_backward=False, module_options=_loops(form))
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


def _strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """Deformation at the points from the displacements, and the stress that forces take, with what folds into it."""
    real, mat, dim, vec = space.scalar, space.mat, space.dim, space.vec
    Params, Fields, Pair = laws.Params, fields_struct(space, layout), pair_struct(space)
    total, artificial, averaged = laws.total or laws.respond, form.parts.artificial, form.points and form.residual
    breaks, Phase, apart = form.damage in ("AT1", "AT2"), phase_struct(space), not form.total
    of_displacement, around = _gathered(space, layout, form, smoothing, averaged), damage_around(space)
    damaging = damaged(space, laws, form.damage)[0] if breaks else laws.respond
    determinant, inverse = determinant_and_inverse(space)
    (unpack, _), opposing, plane = packing(space, laws.state), opposing_stress(space), in_plane(space)
    # Between particles of one set viscosity is a force of pairs, at points of their own it is a stress.
    viscous, drags = form.points and bool(form.parts.viscosity), viscous_stress(space, form.parts.viscosity)
    of_velocity = _gathered(space, layout, form, smoothing, False)

    @wp.kernel(module="unique", enable_backward=False, module_options=PAIR_LOOPS)
    def strain(first: int, p: Params, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
               node: wp.array(dtype=vec), centre: wp.array(dtype=vec), moment: wp.array(dtype=mat), volume: wp.array(dtype=real),
               share: wp.array(dtype=real), stiffness: real, density: real, pair: Pair, phase: Phase, fields: Fields, others: Fields,
               mean_out: wp.array(dtype=vec), corrected_out: wp.array(dtype=mat), opposing_out: wp.array(dtype=mat),
               dragging_out: wp.array(dtype=mat)):  # fmt: skip
        i = first + wp.tid()
        gradient, mean = of_displacement(pair, offsets, indices, weight, node, centre, others, others.displacement, i)
        H = gradient * moment[i]
        fields.deformation[i] = H
        if wp.static(averaged):
            mean_out[i] = mean
        P = mat()
        hold = real(0.0)
        if wp.static(form.residual):
            hold = share[i]
        if wp.static(breaks):
            S = around(phase, offsets, indices, weight, i)
            d, opening, g, s, P = damaging(p, phase, H, fields.stress[i], phase.damage[i], S, phase.weights[i])
            fields.damage[i][0] = d
            phase.opening[i] = opening
            hold = g * share[i]
            phase.share[i] = hold
            if wp.static(apart):
                fields.damaged_stress[i] = s
            else:
                fields.stress[i] = s
        elif wp.static(form.total):
            s, P = total(p, H)
            fields.stress[i] = s
        if wp.static(not breaks and (artificial or not form.total)):
            F = wp.identity(n=dim, dtype=real) + H
            cauchy = plane(unpack(fields.stress[i]))
            back = determinant(F) * wp.transpose(inverse(F))
            if wp.static(not form.total):
                P = cauchy * back
            if wp.static(artificial):
                opposing_out[i] = volume[i] * (opposing(pair.epsilon, cauchy) * back) * moment[i]
        if wp.static(viscous):
            rate, _v = of_velocity(pair, offsets, indices, weight, node, centre, others, others.velocity, i)
            drag = mat()
            # Across a crack, or turned inside out, F says nothing.
            if determinant(wp.identity(n=dim, dtype=real) + H) > real(0.1):
                to_start = inverse(wp.identity(n=dim, dtype=real) + H)
                drag = drags(pair, density, rate * moment[i] * to_start) * wp.transpose(to_start)
            dragging_out[i] = volume[i] * drag * moment[i]
        A = volume[i] * P
        if wp.static(not form.paper):
            A = A * moment[i]
        if wp.static(form.residual):
            A = A - (stiffness * hold) * H
        corrected_out[i] = A

    return strain


def _moments_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """What `strain` is in the current configuration: moments of the pairs as they are, stress of a total law from F."""
    real, mat, dim, vec = space.scalar, space.mat, space.dim, space.vec
    Params, Fields, Pair = laws.Params, fields_struct(space, layout), pair_struct(space)
    total, artificial = laws.total or laws.respond, form.parts.artificial
    determinant, _ = determinant_and_inverse(space)
    seen, opposing, plane = _seen(space, layout, form, smoothing), opposing_stress(space), in_plane(space)
    (unpack, _), inverse, at = packing(space, laws.state), generalized_inverse(space), element(wp.int32)

    @wp.kernel(module="unique", enable_backward=False)
    def moments(first: int, p: Params, pair: Pair, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                node: wp.array(dtype=vec), volume: wp.array(dtype=real), fields: Fields, moment_out: wp.array(dtype=mat),
                share_out: wp.array(dtype=real), corrected_out: wp.array(dtype=mat), opposing_out: wp.array(dtype=mat),
                rank_out: wp.array(dtype=wp.int32)):  # fmt: skip
        i = first + wp.tid()
        moment = mat()
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            r, w = seen(pair, weight, node, fields, i, at(indices, k), k)
            moment = moment + wp.outer(w * r, r)
            k += 1
        b, rank = inverse(moment, real(0.0))
        moment_out[i] = b
        rank_out[i] = rank
        if wp.static(form.total):
            s, _P = total(p, fields.deformation[i])
            fields.stress[i] = s
        current = volume[i] * determinant(wp.identity(n=dim, dtype=real) + fields.deformation[i])
        if wp.static(form.parts.viscosity != ""):
            share_out[i] = volume[i] / wp.trace(moment)  # rho_0 V_0 = rho V
        cauchy = plane(unpack(fields.stress[i]))
        corrected_out[i] = current * cauchy * b
        if wp.static(artificial):
            opposing_out[i] = current * opposing(pair.epsilon, cauchy) * b

    return moments


def _residual_kernel(space: Space, Fields: type, points: bool) -> wp.Kernel:
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


@cache
def kernels(space: Space, laws: Laws, layout: Layout, parts: Parts, form: Form, smoothing: str) -> Kernels:
    return Kernels(space, laws, layout, parts, form, smoothing)
