"""Frames of faces that turn with the body."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.sph.rows import rows_struct


@cache
def _normal(space: Space) -> wp.Function:
    """Warp function (rows, axis, grid) -> the axis that completes the others to a right-handed frame."""
    dim, vec, mat = space.dim, space.vec, space.mat
    if dim == 1:

        @wp.func
        def alone(rows: mat, axis: int, grid: mat) -> vec:
            return vec(grid[0, 0])

        return alone
    if dim == 2:

        @wp.func
        def beside(rows: mat, axis: int, grid: mat) -> vec:
            if axis == 0:
                return vec(rows[1, 1], -rows[1, 0])
            return vec(-rows[0, 1], rows[0, 0])

        return beside

    @wp.func
    def across(rows: mat, axis: int, grid: mat) -> vec:
        return wp.cross(rows[(axis + 1) % 3], rows[(axis + 2) % 3])

    return across


PASSES = 1
"""Averages of the displacement along a face, over the cells beside a particle, before its slope is taken. More
passes calm a compressed face (growth at 1 % strain 4e-3 a step with one, 1e-3 with two) and excite a stretched one (3e-4,
8e-4)."""


@cache
def frame_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Orthonormal frames of the faces, rows at the index of their axis of the grid: the normal at `axis`, the directions in
    the face from where its particles are."""
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat
    Fields, Rows = fields_struct(space, layout), rows_struct(space, vectors=True)
    across = _normal(space)

    @kernel(ranged=True)
    def frames(
        first: int,
        grid: mat,
        rows: Rows,
        fields: Fields,
        clock: wp.array(dtype=wp.float64),
        axis: wp.array(dtype=wp.int32),
        share: real,
        frame_out: wp.array(dtype=mat),
    ):
        e = first + wp.tid()
        dt = share * real(dt_of(clock))
        near = rows.indices[rows.offsets[e]]
        start = fields.displacement[near] + dt * fields.velocity[near]
        slopes = mat()
        for k in range(rows.offsets[e], rows.offsets[e + 1]):
            j = rows.indices[k]
            slopes += wp.outer(rows.weight[k], fields.displacement[j] + dt * fields.velocity[j] - start)
        frame = mat()
        for k in range(wp.static(dim)):
            if k != axis[e]:
                t = vec()
                for i in range(wp.static(dim)):
                    t[i] = grid[k, i] + slopes[k, i]
                for before in range(wp.static(dim)):
                    if before < k and before != axis[e]:
                        other = vec()
                        for i in range(wp.static(dim)):
                            other[i] = frame[before, i]
                        t -= wp.dot(t, other) * other
                t = wp.normalize(t)
                for i in range(wp.static(dim)):
                    frame[k, i] = t[i]
        n = across(frame, axis[e], grid)
        for i in range(wp.static(dim)):
            frame[axis[e], i] = n[i]
        frame_out[e] = frame

    return frames
