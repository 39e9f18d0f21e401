"""Deformation at the points from the displacements, and the stress that forces take, with what folds into it."""

# What `wp.static` leaves out is not compiled: a function that is not there is not called.
# pyright: reportOptionalCall=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.evolution import thickness
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, coefficients_of, gathered, misfit_pull, smoothed
from wsph.parts.fading import faded, row_of
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form) -> wp.Kernel:
    """Kernel of the points' answers and of the derived fields of the state."""
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    Params, Coefficients = laws.Params, coefficients_of(space, form)
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    meant, average = form.points and form.stabilised, smoothed(space, form.averaged)
    of_displacement, misfit = gathered(space, layout, form, meant), misfit_pull(space)
    cofactor, (unpack, _), plane = cofactor_of(space), packing(space, laws.state), in_plane(space)
    thick, thins = thickness(space, laws), laws.kept.thinning >= 0
    total, answers_by_law = total_of(space, laws, layout), form.response is None
    Response = form.response.struct(space) if form.response is not None else Points
    respond = form.response.make(space, laws, layout) if form.response is not None else laws.respond
    opposes, drags = form.stress_term is not None, form.rate_term is not None
    opposed = form.stress_term.make(space, Coefficients) if form.stress_term is not None else laws.respond
    # Between particles of one set drag is a force of pairs, at points of their own it is a stress.
    dragged, left, row = _dragged(space, layout, form), faded(space), row_of(space, form.beside)

    @kernel(ranged=True, pairs=True)
    def strain(
        first: int,
        p: Params,
        c: Coefficients,
        density: real,
        rows: Rows,
        points: Points,
        others: Fields,
        response_out: Response,
        fields_out: Fields,
        answers_out: Answers,
    ):
        i = first + wp.tid()
        k = row(points, i)
        H = mat()
        mean = vec()
        if wp.static(form.staged):
            H = average(rows, points, answers_out.gradient, i)
        else:
            gradient, mean = of_displacement(c, rows, points, others, others.displacement, i)
            H = gradient * points.moment[i]
        fields_out.deformation[k] = H
        if wp.static(form.beside):
            answers_out.gradient[i] = H
        if wp.static(meant):
            answers_out.mean[i] = mean
        P = mat()
        hold = real(0.0)
        if wp.static(form.stabilised):
            hold = points.share[i]
        if wp.static(form.fades >= 0):
            hold = hold * left(c.yields * fields_out.internals[k][wp.static(form.fades)])
            response_out.share[i] = hold
        if wp.static(not answers_by_law):
            hold, P = respond(p, response_out, rows, fields_out, points.share[i], H, i)
        elif wp.static(form.total):
            s, P = total(p, fields_out, H, k)
            fields_out.stress[k] = s
        if wp.static(answers_by_law and (opposes or not form.total)):
            cauchy = plane(unpack(fields_out.stress[k]))
            back = cofactor(H)
            if wp.static(not form.total):
                if wp.static(thins):
                    back = thick(fields_out.internals[k]) * back
                P = cauchy * back
            if wp.static(opposes):
                answers_out.extra[i] = points.volume[i] * (opposed(c, cauchy) * back) * points.moment[i]
        if wp.static(drags):
            answers_out.extra[i] = dragged(c, density, rows, points, others, H, i)
        if wp.static(form.staged):
            answers_out.nominal[i] = P
            return
        A = points.volume[i] * P
        if wp.static(not form.paper):
            A = A * points.moment[i]
        if wp.static(form.stabilised and form.vectors):
            A = A - misfit(rows, points, others.displacement, mean, H, hold, i) * points.moment[i]
        elif wp.static(form.stabilised):
            A = A - (points.stabilisation * hold) * H
        answers_out.corrected[i] = A

    return strain


@cache
def _dragged(space: Space, layout: Layout, form: Form) -> wp.Function | None:
    """Warp function (c, density, rows, points, others, H, i) -> the stress of the rate term at point i as forces take it,
    volume times first Piola stress times moment; None without one."""
    real, mat, dim, Fields, term = space.scalar, space.mat, space.dim, fields_struct(space, layout), form.rate_term
    if term is None:
        return None
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    of_velocity, stress_of = gathered(space, layout, form, False), term.make(space, Coefficients)
    (determinant, inverse), size = determinant_and_inverse(space), _size(space, form)

    @wp.func
    def dragged(c: Coefficients, density: real, rows: Rows, points: Points, others: Fields, H: mat, i: int) -> mat:
        rate, _v = of_velocity(c, rows, points, others, others.velocity, i)
        drag = mat()
        F = wp.identity(n=dim, dtype=real) + H
        # Across a crack, or turned inside out, F says nothing.
        if determinant(F) > real(0.1):
            to_start = inverse(F)
            drag = stress_of(c, size(c, points, i), density, rate * points.moment[i] * to_start) * wp.transpose(
                to_start
            )
        return points.volume[i] * drag * points.moment[i]

    return dragged


@cache
def _size(space: Space, form: Form) -> wp.Function:
    """Warp function (c, points, i) -> the length h of point i: of cells that differ their own size."""
    real, Coefficients, Points = space.scalar, coefficients_of(space, form), points_struct(space)
    power = 1.0 / space.dim

    @wp.func
    def size(c: Coefficients, points: Points, i: int) -> real:
        if wp.static(form.vectors):
            return wp.pow(points.volume[i], real(wp.static(power)))
        return c.h

    return size


@cache
def cofactor_of(space: Space) -> wp.Function:
    """Warp function H -> J F^-T of F = I + H."""
    real, mat, dim = space.scalar, space.mat, space.dim
    determinant, inverse = determinant_and_inverse(space)

    @wp.func
    def cofactor(H: mat) -> mat:
        F = wp.identity(n=dim, dtype=real) + H
        return determinant(F) * wp.transpose(inverse(F))

    return cofactor
