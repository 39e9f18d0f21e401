"""The velocity gradient in the configuration that a step leads to."""

from functools import cache

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import generalized_inverse
from wsph.parts.pair_forces import pair_struct
from wsph.sph.smoothing import SMOOTHING


@cache
def gradient_ahead(space: Space, layout: Layout, smoothing: str) -> wp.Function:
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
