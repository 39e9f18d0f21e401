"""A return to the yield surface at a face whose normal stress is prescribed.

The strain along such a normal is not known: it is the one after which the return ends at the prescribed stress. So is that
along the normals that a stress state leaves free. All of them come together by Broyden's method (Math. Comp. 19, 1965) from
the elastic stiffness, of which a secant of one strain is the case of one normal.
"""

import warp as wp

from wsph.backend.space import Space
from wsph.constitutive.free_normals import LEAST_SECANT, flowed, returning, straining
from wsph.constitutive.kept import Kept
from wsph.constitutive.stress_state import StressState, packing
from wsph.plugins.traits import gives, own_internals

LEAST_SLOPE = 0.05
"""Least part of the elastic stiffness of a secant that is taken."""

ROUNDS = 10
"""Most steps: one or two of small increments, eight from twice the yield stress to rounding."""


def _unknown(space: Space, Params: type) -> tuple[wp.Function, wp.Function]:
    """Warp functions: (p, mask) -> the elastic compliance of the normals of `mask` with the others held, 3 x 3; and
    (stress, given stress, mask) -> how far the normals of `mask` are from the given ones."""
    real, tensor, point = space.scalar, space.tensor, space.point

    @wp.func
    def compliance(p: Params, mask: int) -> tensor:
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        stiffness = tensor()
        for i in range(3):
            stiffness[i, i] = lame + real(2.0) * p.elastic_shear
            for j in range(3):
                if i != j and ((mask >> i) & 1) * ((mask >> j) & 1) == 1:
                    stiffness[i, j] = lame
        return wp.inverse(stiffness)

    @wp.func
    def apart(t: tensor, s: tensor, mask: int) -> point:
        gap = point()
        for k in range(3):
            if (mask >> k) & 1 == 1:
                gap[k] = t[k, k] - s[k, k]
        return gap

    return compliance, apart


def face_return(
    space: Space,
    material: object,
    state: StressState,
    Params: type,
    internal: type,
    kept: Kept,
    project: wp.Function | None,
) -> wp.Function | None:
    """Warp function (p, packed stress, internals, mask) -> both, brought back with the normal stresses of `mask` as they
    are; None where the material has no return. Where all three are given the loads say what the stress is: there it is
    `project`, that of a point inside."""
    if project is None or not gives(material, "project"):
        return None
    count, static_mask, thinning = len(own_internals(material)), sum(1 << k for k in state.free), kept.thinning
    real, point, stress = space.scalar, space.point, space.packed(len(state.components))
    own, (unpack, pack), last = space.vector(max(count, 1)), packing(space, state), kept.dissipation
    returned = returning(space, material.project(space, Params), Params, count)
    strained, plastic, (compliance, apart) = straining(space, Params), flowed(space, Params), _unknown(space, Params)

    @wp.func
    def keeping(p: Params, packed: stress, q: internal, mask: int):
        free = mask | static_mask
        if free == 7:
            inner, inner_q = project(p, packed, q)
            return inner, inner_q
        s = unpack(packed)
        mine = own()
        for k in range(wp.static(count)):
            mine[k] = q[k]
        trial = s
        t, changed = returned(p, s, mine)
        gap = apart(t, s, free)
        slope = compliance(p, free)
        strain = point()
        step = -(slope * gap)
        rounds = int(0)
        while rounds < ROUNDS and wp.length(step) > real(LEAST_SECANT):
            strain += step
            trial = strained(p, s, wp.diag(strain))
            t, changed = returned(p, trial, mine)
            next_gap = apart(t, s, free)
            change = slope * (next_gap - gap)
            along = wp.dot(step, change)
            if along > real(LEAST_SLOPE) * wp.dot(step, step):
                slope += wp.outer(step - change, wp.transpose(slope) * step) / along
            gap = next_gap
            step = -(slope * gap)
            rounds += 1
        after = q
        for k in range(wp.static(count)):
            after[k] = changed[k]
        if wp.static(thinning >= 0):
            for k in range(3):
                if (static_mask >> k) & 1 == 1:
                    after[thinning] = after[thinning] + strain[k]
        after[last] = q[last] + plastic(p, t, trial - t)
        return pack(t), after

    return keeping
