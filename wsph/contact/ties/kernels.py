"""Kernels of ties: springs between vertices and points of faces, of which the gap turns with the face.

With q = sum_c b_c y_c the point of a face with corners y_c, R its frame and G the gap in it, the spring stores k |d|^2/2,
d = x - q - R G. Its forces are the exact gradient of that: -k d on the vertex, b_c k d on the corners, and on these what
balances the couple m = R G x k d, since R follows them. A turned joint carries nothing, and momentum and angular momentum
are kept. With n the normal and e the first edge, of length L, a rotation of the frame is w = n x dn + n (n x e).dy/L where
dn = -sum_c (n.dy_c) s_c, s_c the slopes of the corners' weights; w.m = sum_c F_c.dy_c gives the forces F_c.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.contact.meeting.structs import candidates_struct
from wsph.contact.surfaces.struct import surface_struct


@cache
def bonds_struct(space: Space) -> type:
    """Struct of k bonds, nondimensional (`wsph.contact.ties.bonds`).

    vertex   # (k,) int32
    corners  # vertices of the face, (k, dim) int32
    weights  # of its point, (k,) vec
    gap      # in the face's frame, (k,) vec
    area     # (k,) scalar
    whole    # 0 where a bond has broken, else 1, (k,) int32
    """
    annotations: dict[str, object] = dict.fromkeys(("weights", "gap"), wp.array(dtype=space.vec))
    annotations |= dict.fromkeys(("vertex", "whole"), wp.array(dtype=wp.int32))
    annotations["corners"] = wp.array2d(dtype=wp.int32)
    annotations["area"] = wp.array(dtype=space.scalar)
    return wp.struct(type("Bonds", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def turned_gap(space: Space) -> wp.Function:
    """Warp function (bonds, surface of the faces, bond) -> the gap as the face lies now."""
    vec, dim, Bonds, Surface = space.vec, space.dim, bonds_struct(space), surface_struct(space)
    if dim == 1:

        @wp.func
        def turned_1d(bonds: Bonds, other: Surface, k: int) -> vec:
            return bonds.gap[k]

        return turned_1d
    if dim == 2:

        @wp.func
        def turned_2d(bonds: Bonds, other: Surface, k: int) -> vec:
            e = wp.normalize(other.x[bonds.corners[k, 1]] - other.x[bonds.corners[k, 0]])
            return bonds.gap[k][0] * e + bonds.gap[k][1] * vec(e[1], -e[0])

        return turned_2d

    @wp.func
    def turned_3d(bonds: Bonds, other: Surface, k: int) -> vec:
        a = other.x[bonds.corners[k, 0]]
        e = wp.normalize(other.x[bonds.corners[k, 1]] - a)
        n = wp.normalize(wp.cross(e, other.x[bonds.corners[k, 2]] - a))
        return bonds.gap[k][0] * e + bonds.gap[k][1] * wp.cross(n, e) + bonds.gap[k][2] * n

    return turned_3d


@cache
def couple_forces(space: Space) -> wp.Function:
    """Warp function (bonds, surface of the faces, bond, corner, gap, pull k d) -> the force on the corner of the couple that
    the gap makes of the pull."""
    vec, dim, Bonds, Surface = space.vec, space.dim, bonds_struct(space), surface_struct(space)
    if dim == 1:

        @wp.func
        def couple_1d(bonds: Bonds, other: Surface, k: int, c: int, gap: vec, pull: vec) -> vec:
            return vec()

        return couple_1d
    if dim == 2:

        @wp.func
        def couple_2d(bonds: Bonds, other: Surface, k: int, c: int, gap: vec, pull: vec) -> vec:
            e = other.x[bonds.corners[k, 1]] - other.x[bonds.corners[k, 0]]
            m = gap[0] * pull[1] - gap[1] * pull[0]
            force = (m / wp.dot(e, e)) * vec(-e[1], e[0])
            if c == 0:
                return -force
            return force

        return couple_2d

    @wp.func
    def couple_3d(bonds: Bonds, other: Surface, k: int, c: int, gap: vec, pull: vec) -> vec:
        a, b = other.x[bonds.corners[k, 0]], other.x[bonds.corners[k, 1]]
        e = b - a
        area = wp.cross(e, other.x[bonds.corners[k, 2]] - a)
        n = wp.normalize(area)
        m = wp.cross(gap, pull)
        opposite = other.x[bonds.corners[k, (c + 2) % 3]] - other.x[bonds.corners[k, (c + 1) % 3]]
        slope = wp.cross(n, opposite) / wp.length(area)
        force = -wp.dot(slope, wp.cross(m, n)) * n
        twist = (wp.dot(m, n) / wp.dot(e, e)) * wp.cross(n, e)
        if c == 0:
            force = force - twist
        if c == 1:
            force = force + twist
        return force

    return couple_3d


@cache
def pull_kernel(space: Space) -> wp.Kernel:
    """Forces of some bonds on the vertices, and on the corners of their faces each by itself; `stiffness` is a pressure over
    a way. What each stores and its traction, of this evaluation."""
    real, vec, dim, Bonds, Surface = space.scalar, space.vec, space.dim, bonds_struct(space), surface_struct(space)
    turned, couple = turned_gap(space), couple_forces(space)

    @kernel(ranged=True)
    def pull(
        first: int,
        rows: wp.array(dtype=wp.int32),
        stiffness: real,
        bonds: Bonds,
        own: Surface,
        other: Surface,
        force_out: wp.array(dtype=vec),
        corner_out: wp.array2d(dtype=vec),
        stored_out: wp.array(dtype=wp.float64),
        traction_out: wp.array(dtype=real),
    ):
        k = rows[first + wp.tid()]
        stored_out[k] = wp.float64(0.0)
        traction_out[k] = real(0.0)
        for c in range(wp.static(dim)):
            corner_out[k, c] = vec()
        # The vertex of a broken bond may have gone, and its number be another's.
        if bonds.whole[k] == 1:
            i = bonds.vertex[k]
            gap = turned(bonds, other, k)
            d = own.x[i] - gap
            for c in range(wp.static(dim)):
                d -= bonds.weights[k][c] * other.x[bonds.corners[k, c]]
            force = stiffness * bonds.area[k] * d
            force_out[i] = force_out[i] - force
            for c in range(wp.static(dim)):
                corner_out[k, c] = bonds.weights[k][c] * force + couple(bonds, other, k, c, gap, force)
            stored_out[k] = wp.float64(real(0.5) * wp.dot(force, d))
            traction_out[k] = stiffness * wp.length(d)

    return pull


@cache
def answer_kernel(space: Space) -> wp.Kernel:
    """What acts back on the vertices of the faces; `rows`: which corners each of them is, counted through all bonds."""
    vec, dim, Candidates = space.vec, space.dim, candidates_struct()

    @kernel(ranged=True)
    def answer(
        first: int,
        rows: Candidates,
        corner: wp.array2d(dtype=vec),
        force_out: wp.array(dtype=vec),
    ):
        row = first + wp.tid()
        v = rows.which[row]
        total = vec()
        for at in range(rows.offsets[row], rows.offsets[row + 1]):
            c = rows.indices[at]
            total += corner[c // wp.static(dim), c % wp.static(dim)]
        force_out[v] = force_out[v] + total

    return answer


@cache
def part_kernel(space: Space) -> wp.Kernel:
    """Break the bonds whose traction is above a strength, at the end of a step; the energy that they held is lost."""
    real = space.scalar

    @kernel(ranged=True)
    def part(
        first: int,
        strength: real,
        traction: wp.array(dtype=real),
        whole_out: wp.array(dtype=wp.int32),
        stored_out: wp.array(dtype=wp.float64),
        lost_out: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        if whole_out[k] == 1 and traction[k] > strength:
            whole_out[k] = 0
            lost_out[k] = stored_out[k]
            stored_out[k] = wp.float64(0.0)

    return part
