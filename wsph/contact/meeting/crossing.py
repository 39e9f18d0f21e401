"""Kernels of edges against edges, in 3D: where two bars cross, no vertex of one is near a face of the other."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.contact.meeting.forces import elastic_force, open_contact
from wsph.contact.meeting.nearest import met_struct
from wsph.contact.meeting.structs import candidates_struct, memory_struct, reading, writing
from wsph.contact.surfaces.struct import surface_struct

PARALLEL = 0.1
"""Edges whose directions' cross product is below this do not cross."""


@cache
def ridges_struct() -> type:
    """Struct of the edges of a surface: `line` (r, 4) and `sides` (r, 2), as `wsph.contact.meeting.ridges` has them."""
    annotations = dict.fromkeys(("line", "sides"), wp.array2d(dtype=wp.int32))
    return wp.struct(type("RidgeArrays", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def crossings_struct(space: Space) -> type:
    """Struct of what acts on r edges, of one evaluation.

    force  # on each, (r,) vec
    other  # the edge that it is met by, -1 where there is none, (r,) int32
    at     # where on each it acts, from its first end to its second, 0 to 1, (r,) scalar
    to     # where on the other, (r,) scalar
    """
    annotations = dict.fromkeys(("at", "to"), wp.array(dtype=space.scalar))
    annotations |= {"force": wp.array(dtype=space.vec), "other": wp.array(dtype=wp.int32)}
    return wp.struct(type("Crossings", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def crossing_struct(space: Space) -> type:
    """Where two edges cross: the unit vector `normal` out of the second one's body, the `gap` along it, the places `at` and
    `to` on both, whether they cross (`found`)."""
    annotations = {"normal": space.vec, "found": wp.int32} | dict.fromkeys(("gap", "at", "to"), space.scalar)
    return wp.struct(type("Crossing", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def wedge(space: Space) -> wp.Function:
    """Warp function (surface, faces of an edge, direction) -> 1 where the direction lies between the two faces' normals, -1
    where its opposite does, else 0."""
    real, vec, Surface, Ridges = space.scalar, space.vec, surface_struct(space), ridges_struct()

    @wp.func
    def between(s: Surface, r: Ridges, e: int, m: vec) -> int:
        a, b = wp.normalize(s.area[r.sides[e, 0]]), wp.normalize(s.area[r.sides[e, 1]])
        c = wp.dot(a, b)
        p, q = wp.dot(m, a - c * b), wp.dot(m, b - c * a)
        if p > real(0.0) and q > real(0.0):
            return int(1)
        if p < real(0.0) and q < real(0.0):
            return int(-1)
        return int(0)

    return between


@cache
def crossing_of(space: Space) -> wp.Function:
    """Warp function (surface, edges, edge, other surface, its edges, edge) -> where the two cross.

    The points are the nearest ones of the two lines; the normal is that of the two ridges' tangents there, interpolated
    between the mean directions at an edge's ends as normals are on faces, so that it does not turn with one dented edge.
    """
    real, vec = space.scalar, space.vec
    Surface, Ridges, Crossing = surface_struct(space), ridges_struct(), crossing_struct(space)
    between = wedge(space)

    @wp.func
    def tangent(s: Surface, r: Ridges, e: int, at: real) -> vec:
        first = wp.normalize(s.x[r.line[e, 2]] - s.x[r.line[e, 0]])
        last = wp.normalize(s.x[r.line[e, 3]] - s.x[r.line[e, 1]])
        return wp.normalize((real(1.0) - at) * first + at * last)

    @wp.func
    def crossing(s: Surface, r: Ridges, e: int, t: Surface, q: Ridges, d: int) -> Crossing:
        found = Crossing()
        a, b = vec(s.x[r.line[e, 1]]), vec(t.x[q.line[d, 1]])
        one, two = s.x[r.line[e, 2]] - a, t.x[q.line[d, 2]] - b
        aa, ab, bb = wp.dot(one, one), wp.dot(one, two), wp.dot(two, two)
        det = aa * bb - ab * ab
        if det > real(PARALLEL * PARALLEL) * aa * bb:
            w = a - b
            at = (ab * wp.dot(two, w) - bb * wp.dot(one, w)) / det
            to = (aa * wp.dot(two, w) - ab * wp.dot(one, w)) / det
            if at >= real(0.0) and at < real(1.0) and to >= real(0.0) and to < real(1.0):
                m = wp.normalize(wp.cross(tangent(s, r, e, at), tangent(t, q, d, to)))
                way = between(t, q, d, m)
                if way != int(0) and between(s, r, e, m) == -way:
                    found.normal = real(way) * m
                    found.gap = wp.dot(w + at * one - to * two, found.normal)
                    found.at = at
                    found.to = to
                    found.found = int(1)
        return found

    return crossing


@cache
def cross_kernel(space: Space) -> wp.Kernel:
    """What acts on the edges of a surface from those of another, of those that have candidates: of all that an edge crosses
    from inside, the one that it is least deep in."""
    real, vec = space.scalar, space.vec
    Candidates, Surface, Ridges = candidates_struct(), surface_struct(space), ridges_struct()
    Memory, Crossings, Crossing, Met = (
        memory_struct(space),
        crossings_struct(space),
        crossing_struct(space),
        met_struct(space),
    )
    crossing, held, hold = crossing_of(space), reading(space), writing(space)
    elastic, opened = elastic_force(space), open_contact(space)

    @kernel(ranged=True)
    def cross(
        first: int,
        rows: Candidates,
        own: Surface,
        lines: Ridges,
        other: Surface,
        facing: Ridges,
        clock: wp.array(dtype=wp.float64),
        kept: Memory,
        stiffness: real,
        depth: real,
        trial_out: Memory,
        crossings_out: Crossings,
    ):
        row = first + wp.tid()
        e = rows.which[row]
        least = Crossing()
        least.gap = -depth
        d = int(-1)
        for k in range(rows.offsets[row], rows.offsets[row + 1]):
            each = crossing(own, lines, e, other, facing, rows.indices[k])
            if each.found > 0 and each.gap < real(0.0) and each.gap > least.gap:
                least = each
                d = rows.indices[k]
        h = held(kept, e)
        if d >= 0:
            met = Met()
            met.normal = least.normal
            met.way = (real(1.0) - least.at) * own.moved[lines.line[e, 1]] + least.at * own.moved[lines.line[e, 2]]
            met.way = met.way - (real(1.0) - least.to) * other.moved[facing.line[d, 1]]
            met.way = met.way - least.to * other.moved[facing.line[d, 2]]
            h = elastic(met, least.gap, stiffness, h)
        else:
            h = opened(vec(), real(dt_of(clock)), h)
        hold(trial_out, e, h)
        crossings_out.force[e] = h.elastic
        crossings_out.other[e] = d
        crossings_out.at[e] = least.at
        crossings_out.to[e] = least.to

    return cross


@cache
def ends_kernel(space: Space, back: bool) -> wp.Kernel:
    """What acts on the vertices at the ends of edges; `back`, minus that on the vertices of the edges that they are met by.
    `rows` are the crossing surface's edges that each of the vertices may have a part in."""
    real, vec = space.scalar, space.vec
    Candidates, Ridges, Crossings = candidates_struct(), ridges_struct(), crossings_struct(space)

    @kernel(ranged=True)
    def ends(first: int, rows: Candidates, lines: Ridges, crossings: Crossings, force_out: wp.array(dtype=vec)):
        row = first + wp.tid()
        v = rows.which[row]
        total = vec()
        for k in range(rows.offsets[row], rows.offsets[row + 1]):
            e = rows.indices[k]
            d = crossings.other[e]
            if d >= 0:
                at, on = real(crossings.at[e]), int(e)
                if wp.static(back):
                    at, on = real(crossings.to[e]), int(d)
                if lines.line[on, 1] == v:
                    total += (real(1.0) - at) * crossings.force[e]
                if lines.line[on, 2] == v:
                    total += at * crossings.force[e]
        if wp.static(back):
            total = -total
        force_out[v] = force_out[v] + total

    return ends
