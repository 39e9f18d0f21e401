"""Frames of faces that turn with the body."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.sph.rows import rows_struct


@cache
def _normal(space: Space) -> wp.Function:
    """Warp function (tangents, k) -> the axis that completes the others to a right-handed frame, not normalised: the normal
    of a face across axis k of the grid, of the tangents along the grid's axes, in rows."""
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat
    if dim == 1:

        @wp.func
        def alone(tangents: mat, k: int) -> vec:
            return vec(real(1.0))

        return alone
    if dim == 2:

        @wp.func
        def beside(tangents: mat, k: int) -> vec:
            if k == 0:
                return vec(tangents[1, 1], -tangents[1, 0])
            return vec(-tangents[0, 1], tangents[0, 0])

        return beside

    @wp.func
    def across(tangents: mat, k: int) -> vec:
        return wp.cross(tangents[(k + 1) % 3], tangents[(k + 2) % 3])

    return across


@cache
def _nearest(space: Space) -> wp.Function:
    """Warp function: a matrix -> the rotation nearest to it, by Higham's iteration (SIAM J. Sci. Stat. Comput. 7, 1986)."""
    real, mat, inverse = space.scalar, space.mat, determinant_and_inverse(space)[1]
    # Convergence is quadratic: what the last change leaves is its square.
    enough = 1.0e-16 if space.precision == "f64" else 1.0e-8

    @wp.func
    def nearest(near: mat) -> mat:
        turn = near
        for _ in range(12):
            next = real(0.5) * (turn + wp.transpose(inverse(turn)))
            change = next - turn
            turn = next
            if wp.ddot(change, change) < real(wp.static(enough)):
                break
        return turn

    return nearest


PASSES = 1
"""Averages of the displacement along a face, over the cells beside a particle, before its slope is taken. More
passes calm a compressed face (growth at 1 % strain 4e-3 a step with one, 1e-3 with two) and excite a stretched one (3e-4,
8e-4)."""


@cache
def frame_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Orthonormal frames of the faces, rows at the index of their axis of the grid, from where the faces' particles are.

    `across` has a bit for every axis of the grid across which a face lies whose frame the particle takes. It is the nearest
    to those faces' normals and the tangents along the other axes: the normal itself on a face, and at an edge or a corner no
    face comes before another for the number of its axis.
    """
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat
    Fields, Rows = fields_struct(space, layout), rows_struct(space, vectors=True)
    normal, nearest = _normal(space), _nearest(space)

    @kernel(ranged=True)
    def frames(
        first: int,
        grid: mat,
        rows: Rows,
        fields: Fields,
        clock: wp.array(dtype=wp.float64),
        across: wp.array(dtype=wp.int32),
        share: real,
        frame_out: wp.array(dtype=mat),
    ):
        e = first + wp.tid()
        dt = share * real(dt_of(clock))
        near = rows.indices[rows.offsets[e]]
        start = fields.displacement[near] + dt * fields.velocity[near]
        tangents = grid
        for k in range(rows.offsets[e], rows.offsets[e + 1]):
            j = rows.indices[k]
            tangents += wp.outer(rows.weight[k], fields.displacement[j] + dt * fields.velocity[j] - start)
        frame = mat()
        for k in range(wp.static(dim)):
            axis = vec()
            if (across[e] >> k) & 1 == 1:
                axis = normal(tangents, k)
            else:
                for i in range(wp.static(dim)):
                    axis[i] = tangents[k, i]
            axis = wp.normalize(axis)
            for i in range(wp.static(dim)):
                frame[k, i] = axis[i]
        frame_out[e] = nearest(frame)

    return frames
