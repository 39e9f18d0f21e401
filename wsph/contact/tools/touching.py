"""Kernels of vertices against rigid tools: what acts on the vertices, and what acts back on the tool."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.contact.meeting.forces import contact_force, open_contact
from wsph.contact.meeting.nearest import met_struct
from wsph.contact.meeting.structs import law_struct, memory_struct, reading, writing
from wsph.contact.surfaces.struct import surface_struct
from wsph.contact.tools.gaps import gap_function, shape_struct
from wsph.contact.tools.moving import pose_struct


@cache
def meeting_tool(space: Space, kind: str) -> wp.Function:
    """Warp function (shape, pose, place, way, speed) -> where a point meets the tool: ways and speeds are against the point
    of the tool that is there."""
    real, vec, dim = space.scalar, space.vec, space.dim
    Shape, Pose, Met, gap = shape_struct(space), pose_struct(space), met_struct(space), gap_function(space, kind)

    @wp.func
    def around(spin: space.point, arm: vec) -> vec:
        speed = vec()
        if wp.static(dim == 2):
            speed[0] = -spin[2] * arm[1]
            speed[1] = spin[2] * arm[0]
        elif wp.static(dim == 3):
            speed[0] = spin[1] * arm[2] - spin[2] * arm[1]
            speed[1] = spin[2] * arm[0] - spin[0] * arm[2]
            speed[2] = spin[0] * arm[1] - spin[1] * arm[0]
        return speed

    @wp.func
    def meet(shape: Shape, pose: Pose, x: vec, moved: vec, speed: vec) -> Met:
        axes = pose.axes[0]
        arm = x - pose.place[0]
        apart, normal = gap(shape, wp.transpose(axes) * arm)
        met = Met()
        met.gap = apart
        met.normal = axes * normal
        # By the turning where the point is now: the work of a force on it is that of its torque.
        met.way = moved - pose.shift[0] - around(pose.about[0], arm)
        met.speed = speed - pose.velocity[0] - around(pose.spin[0], arm)
        met.inner = real(1.0)
        return met

    return meet


@cache
def facing_area(space: Space) -> wp.Function:
    """Warp function (surface, vertex, normal of the tool) -> the vertex's share of the area around it that faces the tool,
    in the reference configuration."""
    real, vec, dim, Surface = space.scalar, space.vec, space.dim, surface_struct(space)

    @wp.func
    def facing(own: Surface, i: int, normal: vec) -> real:
        size = real(0.0)
        for k in range(own.starts[i], own.starts[i + 1]):
            f = own.around[k]
            size += wp.max(-wp.dot(wp.normalize(own.area[f]), normal), real(0.0)) * own.size[f]
        return size / real(wp.static(dim))

    return facing


@cache
def touch_kernel(space: Space, kind: str, lagged: bool) -> wp.Kernel:
    """What acts on the vertices of a surface from a tool whose shape is of a kind. `lagged`: damping sees the way of the
    last step over its length."""
    real, vec = space.scalar, space.vec
    Law, Shape, Pose, Surface, Memory = (
        law_struct(space),
        shape_struct(space),
        pose_struct(space),
        surface_struct(space),
        memory_struct(space),
    )
    meet, facing = meeting_tool(space, kind), facing_area(space)
    held, hold, contact, opened = reading(space), writing(space), contact_force(space), open_contact(space)

    @kernel(ranged=True)
    def touch(
        first: int,
        law: Law,
        shape: Shape,
        pose: Pose,
        own: Surface,
        which: wp.array(dtype=wp.int32),
        clock: wp.array(dtype=wp.float64),
        kept: Memory,
        trial_out: Memory,
        push_out: wp.array(dtype=vec),
        force_out: wp.array(dtype=vec),
    ):
        i = which[first + wp.tid()]
        dt = real(dt_of(clock))
        met = meet(shape, pose, own.x[i], own.moved[i], own.speed[i])
        if wp.static(lagged):
            met.speed = met.way / dt
        h = held(kept, i)
        h.gap = met.gap
        force = vec()
        if met.gap < real(0.0):
            size = facing(own, i, met.normal)
            h = contact(law, met, met.gap, size, dt, h)
            force = h.elastic + h.damper - law.tangent * law.stiffness * size * h.stick
        else:
            h = opened(met.way, dt, h)
        hold(trial_out, i, h)
        push_out[i] = force
        force_out[i] = force_out[i] + force

    return touch


@cache
def react_kernel(space: Space) -> wp.Kernel:
    """Force and torque of blocks of vertices on a tool, about its point."""
    real, dim, vec, Pose, Surface = space.scalar, space.dim, space.vec, pose_struct(space), surface_struct(space)

    @kernel(ranged=True)
    def react(
        first: int,
        push: wp.array(dtype=vec),
        own: Surface,
        pose: Pose,
        count: int,
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.vec3d()
        torque = wp.vec3d()
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            # Most touch nothing.
            if wp.dot(push[i], push[i]) > real(0.0):
                arm = wp.vec3d()
                force = wp.vec3d()
                for a in range(wp.static(dim)):
                    arm[a] = wp.float64(own.x[i][a] - pose.place[0][a])
                    force[a] = -wp.float64(push[i][a])
                total += force
                torque += wp.cross(arm, force)
        for a in range(3):
            sums_out[block, a] = total[a]
            sums_out[block, 3 + a] = torque[a]

    return react


@cache
def gather_kernel() -> wp.Kernel:
    """Add the sums of blocks to what acts on a tool."""

    @kernel()
    def gather(sums: wp.array2d(dtype=wp.float64), load_out: wp.array(dtype=wp.float64)):
        a = wp.tid()
        total = wp.float64(0.0)
        for block in range(sums.shape[0]):
            total += sums[block, a]
        load_out[a] = load_out[a] + total

    return gather


@cache
def gaps_kernel(space: Space, kind: str) -> wp.Kernel:
    """Gaps and normals of places at a tool."""
    vec = space.vec
    Shape, Pose, meet = shape_struct(space), pose_struct(space), meeting_tool(space, kind)

    @kernel(ranged=True)
    def gaps(
        first: int,
        shape: Shape,
        pose: Pose,
        x: wp.array(dtype=vec),
        gap_out: wp.array(dtype=space.scalar),
        normal_out: wp.array(dtype=vec),
    ):
        i = first + wp.tid()
        met = meet(shape, pose, x[i], vec(), vec())
        gap_out[i] = met.gap
        normal_out[i] = met.normal

    return gaps
