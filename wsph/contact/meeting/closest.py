"""The point of a face that is nearest to a place, by its weights on the face's vertices (Ericson, Real-time collision
detection, 2005, 5.1.2 and 5.1.5)."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.contact.surfaces.struct import surface_struct


@cache
def on_segment(space: Space) -> wp.Function:
    """Warp function (place, ends a and b) -> weights of a and b of the nearest point between them, (3,) with a zero last."""
    real, vec, point = space.scalar, space.vec, space.point

    @wp.func
    def segment(p: vec, a: vec, b: vec) -> point:
        along = b - a
        square = wp.dot(along, along)
        t = real(0.5)
        if square > real(0.0):
            t = wp.clamp(wp.dot(p - a, along) / square, real(0.0), real(1.0))
        return point(real(1.0) - t, t, real(0.0))

    return segment


@cache
def on_triangle(space: Space) -> wp.Function:
    """Warp function (place, corners a, b and c) -> weights of the corners at the nearest point of the triangle, (3,)."""
    real, vec, point = space.scalar, space.vec, space.point

    @wp.func
    def triangle(p: vec, a: vec, b: vec, c: vec) -> point:
        zero, one = real(0.0), real(1.0)
        ab, ac = b - a, c - a
        d1, d2 = wp.dot(ab, p - a), wp.dot(ac, p - a)
        if d1 <= zero and d2 <= zero:
            return point(one, zero, zero)
        d3, d4 = wp.dot(ab, p - b), wp.dot(ac, p - b)
        if d3 >= zero and d4 <= d3:
            return point(zero, one, zero)
        over_c = d1 * d4 - d3 * d2
        if over_c <= zero and d1 >= zero and d3 <= zero:
            t = d1 / (d1 - d3)
            return point(one - t, t, zero)
        d5, d6 = wp.dot(ab, p - c), wp.dot(ac, p - c)
        if d6 >= zero and d5 <= d6:
            return point(zero, zero, one)
        over_b = d5 * d2 - d1 * d6
        if over_b <= zero and d2 >= zero and d6 <= zero:
            t = d2 / (d2 - d6)
            return point(one - t, zero, t)
        over_a = d3 * d6 - d5 * d4
        if over_a <= zero and d4 - d3 >= zero and d5 - d6 >= zero:
            t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            return point(zero, one - t, t)
        whole = one / (over_a + over_b + over_c)
        return point(one - over_b * whole - over_c * whole, over_b * whole, over_c * whole)

    return triangle


@cache
def on_face(space: Space) -> wp.Function:
    """Warp function (place, surface, face) -> weights of the face's vertices at its point that is nearest to the place,
    (3,), of which those beyond the dimension are zero."""
    real, vec, point, dim, Surface = space.scalar, space.vec, space.point, space.dim, surface_struct(space)
    segment = on_segment(space)
    triangle = on_triangle(space) if dim == 3 else None

    @wp.func
    def face_point(p: vec, s: Surface, f: int) -> point:
        if wp.static(dim == 1):
            return point(real(1.0), real(0.0), real(0.0))
        a = vec(s.x[s.faces[f, 0]])
        b = vec(s.x[s.faces[f, wp.static(min(1, dim - 1))]])
        if wp.static(dim == 3):
            return triangle(p, a, b, vec(s.x[s.faces[f, wp.static(dim - 1)]]))
        return segment(p, a, b)

    return face_point
