"""Where a vertex meets a surface: its nearest faces, the gap along their normal, and the area that it stands for."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.contact.meeting.closest import on_face
from wsph.contact.meeting.structs import SHARED, Faces, candidates_struct, law_struct
from wsph.contact.surfaces.struct import surface_struct

FACING = 0.2
"""A face whose normal times that of a vertex is above this does not face it."""

SAME = {"f64": 1e-9, "f32": 1e-6}
"""Distances that are as good as equal, in spacings: two faces that share an edge have one nearest point on it."""


CORNER = 0.6
"""Of the normal of a face along a ridge, that makes the ridge end at a corner."""

SLANT = 0.5
"""Of a ridge's direction along the normal of a face (sin 30), from which its vertices do not meet the face."""


@cache
def choice_struct(space: Space) -> type:
    """The faces that a vertex meets: `count` of them, their numbers `faces`, at a `distance`."""
    annotations = {"faces": Faces, "count": wp.int32, "distance": space.scalar}
    return wp.struct(type("Choice", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def met_struct(space: Space) -> type:
    """Where a vertex meets faces.

    normal  # unit normal of the surface that is met
    gap     # along it, below zero where the vertex is inside
    way     # of the vertex against the surface since the end of the last step
    speed   # of the vertex against the surface
    aside   # distance of the vertex from the line through the nearest point along the normal
    inner   # weights of the surface's vertices that are not sharp
    """
    annotations = dict.fromkeys(("normal", "way", "speed"), space.vec)
    annotations |= dict.fromkeys(("gap", "aside", "inner"), space.scalar)
    return wp.struct(type("Met", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def outwards(space: Space) -> wp.Function:
    """Warp function (surface, vertex) -> the mean unit normal of the faces around it."""
    vec, Surface = space.vec, surface_struct(space)

    @wp.func
    def outward(s: Surface, i: int) -> vec:
        total = vec()
        for k in range(s.starts[i], s.starts[i + 1]):
            total += s.area[s.around[k]]
        return wp.normalize(total)

    return outward


@cache
def nearest_faces(space: Space) -> wp.Function:
    """Warp function (law, candidates, row, place, its normal, surface) -> the faces that are nearest to the place.

    Of faces that have the nearest point in common, those count that see the place furthest in front of them: seen from
    outside of a sharp edge, the other side of the edge would be a false depth. All that are equal in both share: no order
    of faces shows.
    """
    real, vec, dim = space.scalar, space.vec, space.dim
    Law, Candidates, Surface, Choice = (
        law_struct(space),
        candidates_struct(),
        surface_struct(space),
        choice_struct(space),
    )
    face_point = on_face(space)

    @wp.func
    def nearest(law: Law, rows: Candidates, row: int, p: vec, outward: vec, s: Surface) -> Choice:
        found = Choice()
        found.distance = real(1e30)
        front = real(-1e30)
        same = real(wp.static(SAME[space.precision])) * law.width
        for k in range(rows.offsets[row], rows.offsets[row + 1]):
            f = rows.indices[k]
            a = vec(s.x[s.faces[f, 0]])
            # No point of a face is further from its first vertex than its diameter.
            if wp.length(p - a) < wp.min(found.distance, law.depth) + law.span:
                n = wp.normalize(s.area[f])
                if wp.dot(n, outward) < real(FACING):
                    b = face_point(p, s, f)
                    apart = p
                    for c in range(wp.static(dim)):
                        apart = apart - b[c] * s.x[s.faces[f, c]]
                    distance, side = wp.length(apart), wp.dot(apart, n)
                    level = distance < found.distance + same
                    if distance < found.distance - same or (level and side > front + same):
                        found.distance = distance
                        front = side
                        found.count = int(1)
                        found.faces[0] = f
                    elif level and side > front - same and found.count < wp.static(SHARED):
                        found.faces[found.count] = f
                        found.count = found.count + int(1)
        return found

    return nearest


@cache
def meeting_point(space: Space) -> wp.Function:
    """Warp function (chosen faces, own surface, vertex, other surface) -> where the vertex meets them, mean of the faces.

    The gap is the mean of the distance from the face's nearest point and of those from the tangent planes at the face's
    vertices: a chord lies inside of a curved surface by as much as its tangents lie outside, and on a circle or a sphere
    the two errors cancel.
    """
    real, vec, dim = space.scalar, space.vec, space.dim
    Surface, Choice, Met = surface_struct(space), choice_struct(space), met_struct(space)
    face_point = on_face(space)

    @wp.func
    def meet(found: Choice, own: Surface, i: int, other: Surface) -> Met:
        p = vec(own.x[i])
        apart = vec()
        lift = real(0.0)
        met = Met()
        for k in range(found.count):
            f = found.faces[k]
            b = face_point(p, other, f)
            for c in range(wp.static(dim)):
                v = other.faces[f, c]
                n = vec(other.normal[wp.static(dim) * f + c])
                apart += b[c] * (p - other.x[v])
                lift += b[c] * wp.dot(p - other.x[v], n)
                met.normal = met.normal + b[c] * n
                met.way = met.way + b[c] * (own.moved[i] - other.moved[v])
                met.speed = met.speed + b[c] * (own.speed[i] - other.speed[v])
                if other.sharp[v] == 0:
                    met.inner = met.inner + b[c]
        share = real(1.0) / real(wp.max(found.count, 1))
        met.normal = wp.normalize(met.normal)
        met.way = share * met.way
        met.speed = share * met.speed
        met.inner = share * met.inner
        apart = share * apart
        met.gap = real(0.5) * (wp.dot(apart, met.normal) + share * lift)
        met.aside = wp.length(apart - wp.dot(apart, met.normal) * met.normal)
        return met

    return meet


@cache
def ridge_share(space: Space) -> wp.Function:
    """Warp function (own surface, vertex, normal) -> the share of a vertex's contact with a face that is its own, where
    edges meet edges: 1, but for a vertex on a ridge that slants towards the face.

    The vertex is not what the body has furthest out along the normal then, and the face's normal not the way out: a ridge
    meets another body's ridge, or its end does.
    """
    real, vec, Surface = space.scalar, space.vec, surface_struct(space)
    if space.dim < 3:

        @wp.func
        def whole(own: Surface, i: int, normal: vec) -> real:
            return real(1.0)

        return whole

    @wp.func
    def share(own: Surface, i: int, normal: vec) -> real:
        begin, end = own.starts[i], own.starts[i + 1]
        one = wp.normalize(own.area[own.around[begin]])
        two = vec(one)
        for k in range(begin, end):
            n = wp.normalize(own.area[own.around[k]])
            if wp.dot(n, one) < wp.dot(two, one):
                two = n
        along = wp.normalize(wp.cross(one, two))
        for k in range(begin, end):
            # A face across the ridge: a corner, which is furthest out in a whole cone of directions.
            if wp.abs(wp.dot(wp.normalize(own.area[own.around[k]]), along)) > real(CORNER):
                return real(1.0)
        slant = wp.dot(along, normal) / real(SLANT)
        return wp.max(real(1.0) - slant * slant, real(0.0))

    return share


@cache
def facing_area(space: Space) -> wp.Function:
    """Warp function (law, own surface, vertex, chosen faces, where they are met, other surface) -> the vertex's share of the
    area around it that faces the other surface, in the reference configuration.

    Beside a sharp edge of the other surface it fades, so that no force ends at once where a vertex slides over it: of a
    vertex amid a smooth surface towards the edge, and of a corner, whose area lies to one side, over half a spacing beyond.
    """
    real, dim = space.scalar, space.dim
    Law, Surface, Choice, Met = law_struct(space), surface_struct(space), choice_struct(space), met_struct(space)
    ridged = ridge_share(space)

    @wp.func
    def facing(law: Law, own: Surface, i: int, found: Choice, met: Met, other: Surface) -> real:
        width = law.width
        size = real(0.0)
        for k in range(own.starts[i], own.starts[i + 1]):
            f = own.around[k]
            size += wp.max(-wp.dot(wp.normalize(own.area[f]), met.normal), real(0.0)) * own.size[f]
        size = size / real(wp.static(dim))
        if met.inner < real(1.0):
            if own.sharp[i] == 0:
                span = width
                if wp.static(dim == 2):
                    span = wp.length(other.area[found.faces[0]])
                size = size * wp.min(real(2.0) * met.inner * span / width, real(1.0))
            else:
                size = size * wp.max(real(1.0) - real(2.0) * met.aside / width, real(0.0))
        if law.edges > real(0.0) and own.sharp[i] != 0:
            size = size * ridged(own, i, met.normal)
        return size

    return facing
