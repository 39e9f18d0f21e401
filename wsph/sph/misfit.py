"""What a linear field leaves of the displacements that a point sees."""

from functools import cache

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space


@cache
def misfit(space: Space) -> wp.Function:
    """Warp function (i, u, centre, H, offsets, indices, weight, node, displacement) -> sum of w |e|^2 over the pairs of i:
    what a linear field of gradient H, u at the centre, leaves of the displacements."""
    real, vec, mat, at = space.scalar, space.vec, space.mat, element(wp.int32, space.scalar, space.vec)

    @wp.func
    def left_over(
        i: int,
        u: vec,
        centre: vec,
        H: mat,
        offsets: wp.array(dtype=wp.int32),
        indices: wp.array(dtype=wp.int32),
        weight: wp.array(dtype=real),
        node: wp.array(dtype=vec),
        displacement: wp.array(dtype=vec),
    ) -> real:
        square = real(0.0)
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            e = at(displacement, j) - u - H * (at(node, j) - centre)
            square = square + at(weight, k) * wp.dot(e, e)
            k += 1
        return square

    return left_over
