"""Forces: of points on nodes, and between particles that are their own points."""

# What `wp.static` leaves out is not compiled: a function that is not there is not called.
# pyright: reportOptionalCall=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.form import Form, coefficients_of, seen_pair
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def force_from_points_kernel(space: Space, layout: Layout, parts: BodyForceKinds, form: Form) -> wp.Kernel:
    """Accelerations of nodes from the points that see them; `rows` are those of the nodes."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    pushed, loaded, drags, resisted = sum_from_points(space, form), loaded_force(space, form), form.drags, form.resisted

    @kernel(ranged=True, pairs=True)
    def force_from_points(
        first: int,
        body: Inertia,
        rows: Rows,
        points: Points,
        answers: Answers,
        loads: wp.array(dtype=vec),
        following: wp.array(dtype=vec),
        own: wp.array(dtype=real),
        fields: Fields,
        rate_out: Fields,
    ):
        i = first + wp.tid()
        f, drag = pushed(rows, points, answers, fields.displacement[i], i, i)
        f = loaded(f, loads, following, i)
        if wp.static(resisted):
            drag = drag + following[following.shape[0] // 2 + i]
        if wp.static(drags):
            rate_out.drag[i] = drag / (own[i] * body.density)
            f += drag
        rate_out.velocity[i] = accelerated(body, i, f / own[i], fields.velocity[i])

    return force_from_points


@cache
def sum_from_points(space: Space, form: Form) -> wp.Function:
    """Warp function (rows, points, answers, u, row, i) -> the forces on node i, whose displacement is u, from the points in
    its `row`: of the stress and the residual, and of the viscous stress."""
    real, vec, mat = space.scalar, space.vec, space.mat
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    at, damps = element(wp.int32, real, vec, mat), form.damps

    @wp.func
    def pushed(rows: Rows, points: Points, answers: Answers, u: vec, row: int, i: int):
        f = vec()
        drag = vec()
        x = points.node[i]
        k = rows.offsets[row]
        end = rows.offsets[row + 1]
        while k < end:
            p = at(rows.indices, k)
            r = x - at(points.centre, p)
            if wp.static(form.vectors):
                f = f - at(answers.corrected, p) * at(points.back, k)
            push = vec()
            if wp.static(not form.vectors):
                push = at(answers.corrected, p) * r
            if wp.static(form.stabilised):
                left = u - at(answers.mean, p)
                if wp.static(form.vectors):
                    left = left - at(answers.gradient, p) * r
                push = push + (points.stabilisation * at(points.share, p)) * left
            f = f - at(rows.weight, k) * push
            if wp.static(damps and form.vectors):
                drag = drag - at(answers.extra, p) * at(points.back, k)
            elif wp.static(damps):
                drag = drag - at(rows.weight, k) * (at(answers.extra, p) * r)
            k += 1
        return f, drag

    return pushed


def force_between_kernel(space: Space, layout: Layout, parts: BodyForceKinds, form: Form) -> wp.Kernel:
    """Accelerations of particles that are their own points, with what else acts between them."""
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    Inertia, Coefficients, close = (
        inertia_struct(space, parts.varied),
        coefficients_of(space, form),
        closed_sum(space, layout, parts, form),
    )
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    seen, at, loaded = seen_pair(space, layout, form), element(wp.int32, real, vec, mat), loaded_force(space, form)
    pulled = _pulled(space, form)
    dragged, held = (summed_terms(space, layout, form, kind) for kind in ("drag", "hold"))
    damps, holds, resisted = form.damps, form.holds, form.resisted

    @kernel(ranged=True, pairs=True)
    def force_between(
        first: int,
        body: Inertia,
        c: Coefficients,
        rows: Rows,
        points: Points,
        answers: Answers,
        loads: wp.array(dtype=vec),
        following: wp.array(dtype=vec),
        fields: Fields,
        others: Fields,
        holding_out: wp.array(dtype=vec),
        rate_out: Fields,
    ):
        i = first + wp.tid()
        u = fields.displacement[i]
        A = answers.corrected[i]
        own = real(0.0)
        M = points.moment[i]
        if wp.static(form.shares):
            own = points.share[i]
        f = vec()
        drag = vec()
        hold = vec()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            r, w = seen(c, rows, points, others, i, j, k)
            wr = w * r
            f = f + pulled(points, answers, A, M, wr, j, k)
            both = real(0.0)
            if wp.static(form.shares):
                both = w * (own + at(points.share, j))
            whole = both
            if wp.static(damps and form.shares and form.fades >= 0):
                whole = w * (points.whole[i] + at(points.whole, j))
            if wp.static(form.stabilised and form.vectors):
                H = own * at(answers.gradient, i) + at(points.share, j) * at(answers.gradient, j)
                f = f - points.stabilisation * (H * wr)
            if wp.static(form.stabilised):
                # What is left of du beside H r: that part stands in the corrected stress, but of vectors.
                f = f + (points.stabilisation * both) * (at(others.displacement, j) - u)
            apart = r
            if wp.static(damps or holds):
                apart = r + (at(others.displacement, j) - u)
            square = wp.dot(apart, apart)
            if wp.static(damps):
                drag = drag + dragged(
                    c, body.density, points, answers, fields, others, i, j, wr, r, apart, square, whole
                )
            if wp.static(holds):
                hold = hold + held(c, body.density, points, answers, fields, others, i, j, wr, r, apart, square, both)
            k += 1
        f = loaded(f, loads, following, i)
        if wp.static(resisted):
            drag = drag + following[following.shape[0] // 2 + i]
        close(body, points.volume[i], fields.velocity[i], f, drag, hold, i, holding_out, rate_out)

    return force_between


@cache
def _pulled(space: Space, form: Form) -> wp.Function:
    """Warp function (points, answers, A, M, wr, j, k) -> the force of the stresses on the first of pair k, whose other
    is j: A and M are its corrected stress and moment."""
    vec, mat, Points, Answers = space.vec, space.mat, points_struct(space), answers_struct(space)
    at = element(vec, mat)
    if form.vectors:

        @wp.func
        def by_vectors(points: Points, answers: Answers, A: mat, M: mat, wr: vec, j: int, k: int) -> vec:
            return A * at(points.slope, k) - at(answers.corrected, j) * at(points.back, k)

        return by_vectors

    @wp.func
    def by_weights(points: Points, answers: Answers, A: mat, M: mat, wr: vec, j: int, k: int) -> vec:
        if wp.static(form.paper):
            return (A + at(answers.corrected, j)) * (M * wr)
        return (A + at(answers.corrected, j)) * wr

    return by_weights


@cache
def loaded_force(space: Space, form: Form) -> wp.Function:
    """Warp function (force, loads, following, i) -> the force with the loads on particle i."""
    vec = space.vec

    @wp.func
    def loaded(force: vec, loads: wp.array(dtype=vec), following: wp.array(dtype=vec), i: int) -> vec:
        f = force
        if wp.static(form.loaded):
            f += loads[i]
        if wp.static(form.followed):
            f += following[i]
        return f

    return loaded


def closed_sum(space: Space, layout: Layout, parts: BodyForceKinds, form: Form) -> wp.Function:
    """Warp function (body, volume, velocity, force, drag, hold, i, holding_out, rate_out) that writes what the sums over the
    pairs of particle i come to: its acceleration, and what of it drag and the forces that hold spurious modes are."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    accelerated, Inertia, drags, holds = (
        acceleration(space, parts),
        inertia_struct(space, parts.varied),
        form.drags,
        form.holds,
    )

    @wp.func
    def close(
        body: Inertia,
        volume: real,
        velocity: vec,
        force: vec,
        drag: vec,
        hold: vec,
        i: int,
        holding_out: wp.array(dtype=vec),
        rate_out: Fields,
    ):
        f = force
        if wp.static(drags):
            rate_out.drag[i] = drag / (volume * body.density)
            f += drag
        if wp.static(holds):
            holding_out[i] = hold / (volume * body.density)
            f += hold
        rate_out.velocity[i] = accelerated(body, i, f / volume, velocity)

    return close


def summed_terms(space: Space, layout: Layout, form: Form, kind: str) -> wp.Function | None:
    """The pair terms of one kind as one Warp function, as `wsph.parts.terms.PairTerm` has it; None where there are none."""
    Coefficients, Fields = coefficients_of(space, form), fields_struct(space, layout)
    made = [term.make(space, layout, form.smoothing, Coefficients) for term in form.pair_terms if term.sum == kind]
    if not made:
        return None
    total = made[0]
    for term in made[1:]:
        total = _both(space, Coefficients, Fields, total, term)
    return total


def _both(space: Space, Coefficients: type, Fields: type, one: wp.Function, other: wp.Function) -> wp.Function:
    """The sum of two pair terms."""
    real, vec, Points, Answers = space.scalar, space.vec, points_struct(space), answers_struct(space)

    @wp.func
    def both_terms(
        c: Coefficients,
        density: real,
        points: Points,
        answers: Answers,
        fields: Fields,
        others: Fields,
        i: int,
        j: int,
        wr: vec,
        r: vec,
        apart: vec,
        square: real,
        both: real,
    ) -> vec:
        first = one(c, density, points, answers, fields, others, i, j, wr, r, apart, square, both)
        return first + other(c, density, points, answers, fields, others, i, j, wr, r, apart, square, both)

    return both_terms
