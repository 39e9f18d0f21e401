"""Gap and normal of a point at a rigid shape, as Warp functions in the precision of the run.

A gap is below zero inside of the shape. Where a shape has edges and corners it is the distance of the nearest point with its
sign, so that outside they are round (Ericson, Real-Time Collision Detection, 2005, chapter 5).
"""

from functools import cache
from typing import cast

import warp as wp

from wsph.backend.space import Space
from wsph.contact.tools.triangles import closest, triangles_struct

KINDS = ("plane", "sphere", "cylinder", "box", "stl")
"""Shapes by the names of their gaps."""


@cache
def shape_struct(space: Space) -> type:
    """Struct of a shape in the frame of its tool, nondimensional.

    kind    # the place in KINDS
    center  # a point of the plane, the middle of a ball, of a box or of a bar
    axis    # normal of a plane, direction of a bar
    radius  # of a ball or a bar
    half    # half the sides of a box
    axes    # columns are the directions of the sides of a box
    sign    # -1 where the shape is a hole that keeps bodies in, else 1
    mesh    # triangles, of a shape that is made of them
    """
    annotations: dict[str, object] = dict.fromkeys(("center", "axis", "half"), space.vec)
    annotations |= {"radius": space.scalar, "sign": space.scalar, "axes": space.mat}
    annotations |= {"kind": wp.int32, "mesh": triangles_struct(space)}
    return cast(type, wp.struct(type("ToolShape", (), {"__annotations__": annotations, "__module__": __name__})))


@cache
def gap_function(space: Space, kind: str) -> wp.Function:
    """Warp function (shape, place in the frame of the tool) -> gap, and the outward unit normal there."""
    made = {"plane": _plane, "sphere": _sphere, "cylinder": _cylinder, "box": _box, "stl": _stl}[kind](space)
    vec, Shape = space.vec, shape_struct(space)

    @wp.func
    def gap(shape: Shape, r: vec):
        found, normal = made(shape, r)
        return shape.sign * found, shape.sign * normal

    return gap


@cache
def _plane(space: Space) -> wp.Function:
    vec, Shape = space.vec, shape_struct(space)

    @wp.func
    def plane(shape: Shape, r: vec):
        return wp.dot(r - shape.center, shape.axis), shape.axis

    return plane


@cache
def _direction(space: Space) -> wp.Function:
    """Warp function (way, its length, otherwise) -> its direction, or the other one where it has none."""
    real, vec = space.scalar, space.vec

    @wp.func
    def direction(way: vec, length: real, otherwise: vec) -> vec:
        if length > real(0.0):
            return way / length
        return otherwise

    return direction


@cache
def _sphere(space: Space) -> wp.Function:
    vec, Shape, direction = space.vec, shape_struct(space), _direction(space)

    @wp.func
    def sphere(shape: Shape, r: vec):
        way = r - shape.center
        length = wp.length(way)
        return length - shape.radius, direction(way, length, shape.axis)

    return sphere


@cache
def _cylinder(space: Space) -> wp.Function:
    vec, Shape, direction = space.vec, shape_struct(space), _direction(space)

    @wp.func
    def cylinder(shape: Shape, r: vec):
        way = r - shape.center
        way = way - wp.dot(way, shape.axis) * shape.axis
        length = wp.length(way)
        # On the axis itself any direction across it will do: that of the box's first side is one.
        return length - shape.radius, direction(way, length, wp.transpose(shape.axes)[0])

    return cylinder


@cache
def _box(space: Space) -> wp.Function:
    real, vec, dim, Shape = space.scalar, space.vec, space.dim, shape_struct(space)

    @wp.func
    def box(shape: Shape, r: vec):
        q = wp.transpose(shape.axes) * (r - shape.center)
        beyond = vec()
        normal = vec()
        inner = real(-1.0e30)
        side = int(0)
        for a in range(wp.static(dim)):
            over = wp.abs(q[a]) - shape.half[a]
            beyond[a] = wp.max(over, real(0.0))
            if over > inner:
                inner = over
                side = a
        gap = inner
        if inner > real(0.0):
            gap = wp.length(beyond)
            for a in range(wp.static(dim)):
                normal[a] = beyond[a] / gap
        else:
            normal[side] = real(1.0)
        for a in range(wp.static(dim)):
            if q[a] < real(0.0):
                normal[a] = -normal[a]
        return gap, shape.axes * normal

    return box


@cache
def _stl(space: Space) -> wp.Function:
    vec, Shape, nearest = space.vec, shape_struct(space), closest(space)

    @wp.func
    def stl(shape: Shape, r: vec):
        return nearest(shape.mesh, r)

    return stl
