"""Forces between particles in the current configuration: of stresses, of what is remembered, and what else acts."""

# What `wp.static` leaves out is not compiled: a function that is not there is not called.
# pyright: reportOptionalCall=false

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.forces import closed_sum, loaded_force, summed_terms
from wsph.formulations.lagrangian.form import Form, coefficients_of, seen_pair
from wsph.formulations.updated.images import seen_image
from wsph.formulations.updated.memory import memory_struct
from wsph.parts.body_force import BodyForceKinds, inertia_struct
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def force_now_kernel(space: Space, layout: Layout, parts: BodyForceKinds, form: Form) -> wp.Kernel:
    """Accelerations of particles by the pairs of where they are."""
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    Inertia, Coefficients, close = (
        inertia_struct(space, parts.varied),
        coefficients_of(space, form),
        closed_sum(space, layout, parts, form),
    )
    Rows, Points, Answers, Memory = (
        rows_struct(space),
        points_struct(space),
        answers_struct(space),
        memory_struct(space),
    )
    seen, at, loaded = seen_pair(space, layout, form), element(wp.int32, real, vec, mat), loaded_force(space, form)
    imaged = seen_image(space, layout, form) if form.imaged else None
    dragged, held = (summed_terms(space, layout, form, kind) for kind in ("drag", "hold"))
    damps, holds, resisted = form.damps, form.holds, form.resisted

    @kernel(ranged=True)
    def force_now(
        first: int,
        body: Inertia,
        c: Coefficients,
        rows: Rows,
        points: Points,
        answers: Answers,
        memory: Memory,
        loads: wp.array(dtype=vec),
        following: wp.array(dtype=vec),
        fields: Fields,
        holding_out: wp.array(dtype=vec),
        rate_out: Fields,
    ):
        i = first + wp.tid()
        A = answers.corrected[i]
        own = real(0.0)
        pull = vec()
        if wp.static(form.shares):
            own = points.share[i]
        if wp.static(form.remembers):
            pull = memory.pull[i]
        f = vec()
        drag = vec()
        hold = vec()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            r, w = seen(c, rows, points, fields, i, j, k)
            wr = w * r
            f = f + (A + at(answers.corrected, j)) * wr
            if wp.static(form.remembers):
                f = f + w * (pull - at(memory.pull, j))
            both = real(0.0)
            if wp.static(form.shares):
                both = w * (own + at(points.share, j))
            square = wp.dot(r, r)
            if wp.static(damps):
                drag = drag + dragged(c, body.density, points, answers, fields, fields, i, j, wr, r, r, square, both)
            if wp.static(holds):
                hold = hold + held(c, body.density, points, answers, fields, fields, i, j, wr, r, r, square, both)
            k += 1
        if wp.static(form.imaged):
            for m in range(c.images.offsets[i], c.images.offsets[i + 1]):
                j, kind, r, w, _dv = imaged(c, real(0.0), points, fields, i, m)
                flip = c.images.flip[kind]
                f = f + w * ((A + flip * answers.corrected[j] * c.images.turn[kind]) * r)
                if wp.static(form.remembers):
                    f = f + w * (pull - flip * memory.pull[j])
        f = loaded(f, loads, following, i)
        if wp.static(resisted):
            drag = drag + following[following.shape[0] // 2 + i]
        close(body, points.volume[i], fields.velocity[i], f, drag, hold, i, holding_out, rate_out)

    return force_now
