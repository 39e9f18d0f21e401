"""Moments of the pairs as they are, and the stress that forces take."""

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, generalized_inverse, in_plane
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, seen_pair
from wsph.parts.artificial_stress import opposing_stress
from wsph.parts.pair_forces import pair_struct


def moments_kernel(space: Space, laws: Laws, layout: Layout, form: Form, smoothing: str) -> wp.Kernel:
    """What `strain` is in the current configuration: moments of the pairs as they are, stress of a total law from F."""
    real, mat, dim, vec = space.scalar, space.mat, space.dim, space.vec
    Params, Fields, Pair = laws.Params, fields_struct(space, layout), pair_struct(space)
    total, artificial = laws.total or laws.respond, form.parts.artificial
    determinant, _ = determinant_and_inverse(space)
    seen, opposing, plane = seen_pair(space, layout, form, smoothing), opposing_stress(space), in_plane(space)
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
