"""Moments of the current pairs, and the corrected stress of every particle, which forces are computed from."""

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import generalized_inverse, in_plane
from wsph.constitutive.evolution import volume_ratio
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, coefficients_of, seen_pair
from wsph.formulations.updated.images import seen_image
from wsph.formulations.updated.memory import memory_struct, remembered
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def moments_kernel(space: Space, laws: Laws, layout: Layout, form: Form) -> wp.Kernel:
    """Moments, shares and corrected stresses in the current configuration; the stress of a total law from F."""
    real, vec, mat, dim, Fields = space.scalar, space.vec, space.mat, space.dim, fields_struct(space, layout)
    Params, Coefficients = laws.Params, coefficients_of(space, form)
    Rows, Points, Answers = rows_struct(space), points_struct(space), answers_struct(space)
    imaged = seen_image(space, layout, form) if form.imaged else None
    Memory, recalled = memory_struct(space), remembered(space)
    total, ratio, plane = total_of(space, laws, layout), volume_ratio(space, laws, layout), in_plane(space)
    seen, inverse, at = seen_pair(space, layout, form), generalized_inverse(space), element(wp.int32)
    unpack, opposes = packing(space, laws.state)[0], form.stress_term is not None
    opposed = form.stress_term.make(space, Coefficients) if form.stress_term is not None else laws.respond

    @kernel(ranged=True)
    def moments(
        first: int,
        p: Params,
        c: Coefficients,
        rows: Rows,
        fields_out: Fields,
        points_out: Points,
        answers_out: Answers,
        memory_out: Memory,
        rank_out: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        moment = mat()
        weight = real(0.0)
        middle = vec()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            r, w = seen(c, rows, points_out, fields_out, i, at(rows.indices, k), k)
            moment = moment + wp.outer(w * r, r)
            if wp.static(form.remembers):
                weight = weight + w
                middle = middle + w * r
            k += 1
        if wp.static(form.imaged):
            for m in range(c.images.offsets[i], c.images.offsets[i + 1]):
                _j, _kind, r, w, _dv = imaged(c, real(0.0), points_out, fields_out, i, m)
                moment = moment + wp.outer(w * r, r)
                weight = weight + w
                middle = middle + w * r
        b, rank = inverse(moment, real(0.0))
        points_out.moment[i] = b
        rank_out[i] = rank
        if wp.static(form.total):
            s, _P = total(p, fields_out, fields_out.deformation[i], i)
            fields_out.stress[i] = s
        current = points_out.volume[i] * ratio(fields_out, i)
        if wp.static(form.shares):
            points_out.share[i] = points_out.volume[i] / wp.trace(moment)  # rho_0 V_0 = rho V
        cauchy = plane(unpack(fields_out.stress[i]))
        A = current * cauchy * b
        if wp.static(form.remembers):
            F = wp.identity(n=dim, dtype=real) + fields_out.deformation[i]
            spring = points_out.stabilisation * points_out.volume[i]
            pull, of_memory = recalled(spring, F, fields_out.deviation[i], weight, middle, b)
            memory_out.pull[i] = pull
            A = A + of_memory
        answers_out.corrected[i] = A
        if wp.static(opposes):
            answers_out.extra[i] = current * opposed(c, cauchy) * b

    return moments
