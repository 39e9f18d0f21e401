"""Kernels of a surface: where it is, how it lies, and what its particles feel. Each goes over some rows alone."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.contact.surfaces.struct import surface_struct
from wsph.sph.rows import rows_struct

TINY = 1e-30
"""Stands for the length of an edge without one, in a quotient."""


@cache
def place_kernel(space: Space, identity: bool, lagged: bool) -> wp.Kernel:
    """Places X + B u, ways since the last step and velocities of vertices, and no forces. `identity`: each is a particle;
    `lagged`: velocities are the ways over the time step."""
    real, vec = space.scalar, space.vec
    Rows, Surface = rows_struct(space), surface_struct(space)

    @kernel(ranged=True)
    def place(
        first: int,
        rows: wp.array(dtype=wp.int32),
        B: Rows,
        X: wp.array(dtype=vec),
        u: wp.array(dtype=vec),
        v: wp.array(dtype=vec),
        before: wp.array(dtype=vec),
        clock: wp.array(dtype=wp.float64),
        surface_out: Surface,
        way_out: wp.array(dtype=vec),
        force_out: wp.array(dtype=vec),
    ):
        i = rows[first + wp.tid()]
        way = vec()
        speed = vec()
        if wp.static(identity):
            way = u[B.indices[i]]
            if wp.static(not lagged):
                speed = v[B.indices[i]]
        else:
            for k in range(B.offsets[i], B.offsets[i + 1]):
                way += B.weight[k] * u[B.indices[k]]
                if wp.static(not lagged):
                    speed += B.weight[k] * v[B.indices[k]]
        moved = way - before[i]
        if wp.static(lagged):
            speed = moved / real(dt_of(clock))
        surface_out.x[i] = X[i] + way
        surface_out.moved[i] = moved
        surface_out.speed[i] = speed
        way_out[i] = way
        force_out[i] = vec()

    return place


@cache
def area_kernel(space: Space) -> wp.Kernel:
    """Area vectors of segments (2D) and triangles (3D)."""
    real, vec, dim, Surface = space.scalar, space.vec, space.dim, surface_struct(space)

    @kernel(ranged=True)
    def area(first: int, rows: wp.array(dtype=wp.int32), surface_out: Surface):
        f = rows[first + wp.tid()]
        a = surface_out.x[surface_out.faces[f, 0]]
        edge = surface_out.x[surface_out.faces[f, 1]] - a
        if wp.static(dim == 2):
            turned = vec()
            turned[0] = edge[1]
            turned[1] = -edge[0]
            surface_out.area[f] = turned
        else:
            surface_out.area[f] = real(0.5) * wp.cross(edge, surface_out.x[surface_out.faces[f, 2]] - a)

    return area


@cache
def normal_kernel(space: Space) -> wp.Kernel:
    """Normals at the corners of faces, of the faces that meet there smoothly.

    A face counts as its area vector over the squares of its edges' lengths at the corner (Max, J. Graphics Tools 4, 1999):
    on a circle or a sphere that is the normal itself, and a side that a vertex sees in two triangles counts as one that it
    sees in one, so that it does not show which way squares were cut.
    """
    real, vec, dim, Surface = space.scalar, space.vec, space.dim, surface_struct(space)

    @wp.func
    def weight(s: Surface, f: int, v: int) -> real:
        product = real(1.0)
        for c in range(wp.static(dim)):
            w = s.faces[f, c]
            if w != v:
                edge = s.x[w] - s.x[v]
                product *= wp.dot(edge, edge)
        return real(1.0) / wp.max(product, real(wp.static(TINY)))

    @kernel(ranged=True)
    def normal(
        first: int,
        rows: wp.array(dtype=wp.int32),
        starts: wp.array(dtype=wp.int32),
        smooth: wp.array(dtype=wp.int32),
        surface_out: Surface,
    ):
        f = rows[first + wp.tid()]
        for c in range(wp.static(dim)):
            corner = wp.static(dim) * f + c
            v = surface_out.faces[f, c]
            total = vec()
            for k in range(starts[corner], starts[corner + 1]):
                total += weight(surface_out, smooth[k], v) * surface_out.area[smooth[k]]
            surface_out.normal[corner] = wp.normalize(total)

    return normal


@cache
def note_kernel(space: Space) -> wp.Kernel:
    """Ways of vertices as those from which the ways of the next step are counted."""
    vec = space.vec

    @kernel(ranged=True)
    def note(first: int, rows: wp.array(dtype=wp.int32), way: wp.array(dtype=vec), before_out: wp.array(dtype=vec)):
        i = rows[first + wp.tid()]
        before_out[i] = way[i]

    return note


@cache
def spread_kernel(space: Space) -> wp.Kernel:
    """Forces on particles, B^T f, and the accelerations by them of those that are here."""
    real, vec, Rows = space.scalar, space.vec, rows_struct(space)

    @kernel(ranged=True)
    def spread(
        first: int,
        rows: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32),
        back: Rows,
        share: wp.array(dtype=real),
        force: wp.array(dtype=vec),
        rate_out: wp.array(dtype=vec),
        load_out: wp.array(dtype=vec),
    ):
        s = rows[first + wp.tid()]
        load = vec()
        for k in range(back.offsets[s], back.offsets[s + 1]):
            load += back.weight[k] * force[back.indices[k]]
        load_out[s] = load
        j = particle[s]
        if j >= 0:
            rate_out[j] = rate_out[j] + share[s] * load

    return spread
