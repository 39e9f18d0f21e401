"""The misfit of a linear field to the displacements that a point sees."""

from functools import cache

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.sph.rows import rows_struct


@cache
def misfit(space: Space) -> wp.Function:
    """Warp function (i, u, centre, H, rows, node, displacement) -> sum of w |e|^2 over the pairs of i: e is a displacement
    less the linear field of gradient H that is u at the centre."""
    real, vec, mat, at = space.scalar, space.vec, space.mat, element(wp.int32, space.scalar, space.vec)
    Rows = rows_struct(space)

    @wp.func
    def left_over(
        i: int, u: vec, centre: vec, H: mat, rows: Rows, node: wp.array(dtype=vec), displacement: wp.array(dtype=vec)
    ) -> real:
        square = real(0.0)
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            e = at(displacement, j) - u - H * (at(node, j) - centre)
            square = square + at(rows.weight, k) * wp.dot(e, e)
            k += 1
        return square

    return left_over
