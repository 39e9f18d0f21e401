"""Deformation and stress at the points."""

import warp as wp

from wsph.backend.pair_loops import PAIR_LOOPS
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, gathered
from wsph.parts.artificial_stress import opposing_stress
from wsph.parts.pair_forces import pair_struct
from wsph.parts.phase_field.field import damage_around
from wsph.parts.phase_field.response import damaged, phase_struct
from wsph.parts.viscosity import viscous_stress


def strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """Deformation at the points from the displacements, and the stress that forces take, with what folds into it."""
    real, mat, dim, vec = space.scalar, space.mat, space.dim, space.vec
    Params, Fields, Pair = laws.Params, fields_struct(space, layout), pair_struct(space)
    total, artificial, averaged = laws.total or laws.respond, form.parts.artificial, form.points and form.residual
    breaks, Phase, apart = form.damage in ("AT1", "AT2"), phase_struct(space), not form.total
    of_displacement, around = gathered(space, layout, form, smoothing, averaged), damage_around(space)
    damaging = damaged(space, laws, form.damage)[0] if breaks else laws.respond
    determinant, inverse = determinant_and_inverse(space)
    (unpack, _), opposing, plane = packing(space, laws.state), opposing_stress(space), in_plane(space)
    # Between particles of one set viscosity is a force of pairs, at points of their own it is a stress.
    viscous, drags = form.points and bool(form.parts.viscosity), viscous_stress(space, form.parts.viscosity)
    of_velocity = gathered(space, layout, form, smoothing, False)

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
