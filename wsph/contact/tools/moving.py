"""Kernels of the motion of a rigid body: one thread each, in double precision whatever the run's is.

Turning is kept as a unit quaternion q and as the angular momentum L about the centre of mass, along the axes of the scene:
where nothing turns it, L does not change to the last bit. With the inertia J in the frame of the body, omega = R J^-1 R^T L.
A prescribed body has omega itself in place of L. In 2D and 1D the other components are zero.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache
from typing import cast

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, fields_struct
from wsph.boundary.programs.stack_machine import Bank, evaluate_mean

SPACE = Space(3, "f64")
"""Three dimensions in double precision."""

LAYOUT = Layout.of(
    (
        Field("velocity", 3, "m/s", leads=True),
        Field("spin", 3, leads=True),
        Field("place", 3, "m"),
        Field("turn", 4),
    )
)
"""A rigid body's state: velocity of its point, angular momentum (or angular velocity, where that is prescribed), place of
its point about the origin, and quaternion (x, y, z, w)."""

MODULE = "wsph.contact.tools.moving"
Fields = fields_struct(SPACE, LAYOUT)
vec, mat, four = SPACE.vec, SPACE.mat, SPACE.vector(4)

TURNS = 40
"""Iterations for the angular velocity in the middle of a drift: each gains the digits of omega dt/2."""


@wp.struct
class Rigid:
    """Numbers of a rigid body, nondimensional: `free` 1 where forces move it, its mass and 1/mass, gravity, its inertia in
    its own frame and the inverse of that."""

    free: wp.int32
    mass: wp.float64
    inverse_mass: wp.float64
    gravity: vec
    inertia: mat
    inverse: mat


@wp.func
def quaternion(turn: four) -> wp.quatd:
    return wp.normalize(wp.quatd(turn[0], turn[1], turn[2], turn[3]))


@wp.func
def numbers(q: wp.quatd) -> four:
    return four(q[0], q[1], q[2], q[3])


@wp.func
def rotation(way: vec) -> wp.quatd:
    """The rotation by a vector's length about its direction."""
    angle = wp.length(way)
    # sin(a/2)/a, whose series is exact to rounding where a is small.
    s = wp.float64(0.5) - angle * angle / wp.float64(48.0)
    if angle > wp.float64(1.0e-4):
        s = wp.sin(wp.float64(0.5) * angle) / angle
    return wp.quatd(s * way[0], s * way[1], s * way[2], wp.cos(wp.float64(0.5) * angle))


@wp.func
def rotation_way(q: wp.quatd) -> vec:
    """The vector of a rotation: its axis times its angle, at most half a turn."""
    v = vec(q[0], q[1], q[2])
    w = q[3]
    if w < wp.float64(0.0):
        v = -v
        w = -w
    s = wp.length(v)
    if s < wp.float64(1.0e-12):
        return wp.float64(2.0) * v
    return (wp.float64(2.0) * wp.atan2(s, w) / s) * v


@wp.func
def turned(q: wp.quatd, v: vec) -> vec:
    w = wp.quat_rotate(q, wp.vec3d(v[0], v[1], v[2]))
    return vec(w[0], w[1], w[2])


@wp.func
def angular_velocity(body: Rigid, q: wp.quatd, spin: vec) -> vec:
    if body.free == 0:
        return spin
    return turned(q, body.inverse * turned(wp.quat_inverse(q), spin))


@kernel(module=MODULE)
def rate(body: Rigid, fields: Fields, velocity: int, rest: int, rate_out: Fields):
    """Time derivatives, without forces but gravity: of what integrators call the velocity, and of the rest."""
    if velocity != 0:
        acceleration = vec()
        if body.free != 0:
            acceleration = body.gravity
        rate_out.velocity[0] = acceleration
        rate_out.spin[0] = vec()
    if rest != 0:
        rate_out.place[0] = fields.velocity[0]
        t = fields.turn[0]
        w = angular_velocity(body, quaternion(t), fields.spin[0])
        half = wp.quatd(w[0], w[1], w[2], wp.float64(0.0)) * wp.quatd(t[0], t[1], t[2], t[3])
        rate_out.turn[0] = wp.float64(0.5) * numbers(half)


@kernel(module=MODULE)
def drift(body: Rigid, clock: wp.array(dtype=wp.float64), part: wp.float64, fields_out: Fields):
    """The place and the turning after a part of a step at constant velocity and angular momentum: implicit midpoint rule
    in q, which reads the same backwards in time."""
    dt = part * dt_of(clock)
    q = quaternion(fields_out.turn[0])
    spin = fields_out.spin[0]
    w = angular_velocity(body, q, spin)
    for _ in range(TURNS):
        w = angular_velocity(body, rotation(wp.float64(0.5) * dt * w) * q, spin)
    fields_out.place[0] = fields_out.place[0] + dt * fields_out.velocity[0]
    fields_out.turn[0] = numbers(wp.normalize(rotation(dt * w) * q))


@kernel(module=MODULE)
def impose(
    bank: Bank,
    clock: wp.array(dtype=wp.float64),
    axis: vec,
    from_dt: wp.float64,
    to_dt: wp.float64,
    second: wp.float64,
    metre: wp.float64,
    fields_out: Fields,
):
    """Prescribed velocity and angular velocity: programs 0 to 2 are components [m/s], 3 is the rate about `axis` [1/s]."""
    v = vec()
    for a in range(3):
        value = evaluate_mean(bank, a, wp.vec3d(), clock, second, from_dt, to_dt)
        v[a] = value * second / metre
    rate = evaluate_mean(bank, 3, wp.vec3d(), clock, second, from_dt, to_dt)
    fields_out.velocity[0] = v
    fields_out.spin[0] = (rate * second) * axis


@kernel(module=MODULE)
def unify(fields_out: Fields):
    """Give the quaternion its length of one."""
    fields_out.turn[0] = numbers(quaternion(fields_out.turn[0]))


@kernel(module=MODULE)
def push(body: Rigid, load: wp.array(dtype=wp.float64), rate_out: Fields):
    """Accelerations by what acts on the body: force and torque, one after the other."""
    if body.free != 0:
        for a in range(3):
            rate_out.velocity[0][a] = rate_out.velocity[0][a] + body.inverse_mass * load[a]
            rate_out.spin[0][a] = rate_out.spin[0][a] + load[3 + a]


@kernel(module=MODULE)
def close(
    fields: Fields,
    load: wp.array(dtype=wp.float64),
    began_out: Fields,
    before_out: wp.array(dtype=wp.float64),
    told_out: wp.array(dtype=wp.float64),
):
    """Close a step: the work that the body has done, by the mean of the loads at the ends of the step; `told_out` has force
    and torque on others, and that work."""
    way = fields.place[0] - began_out.place[0]
    about = rotation_way(quaternion(fields.turn[0]) * wp.quat_inverse(quaternion(began_out.turn[0])))
    taken = wp.float64(0.0)
    for a in range(3):
        taken += (load[a] + before_out[a]) * way[a] + (load[3 + a] + before_out[3 + a]) * about[a]
    for a in range(6):
        before_out[a] = load[a]
        told_out[a] = -load[a]
    told_out[6] = told_out[6] - wp.float64(0.5) * taken
    began_out.place[0] = fields.place[0]
    began_out.turn[0] = fields.turn[0]


@cache
def pose_struct(space: Space) -> type:
    """Struct of where a rigid body is, in the precision of the run: arrays of one element.

    place     # of its point, vec
    axes      # R: columns are the axes of its own frame, mat
    shift     # way of its point since the end of the last step, vec
    about     # its turning since then, axis times angle, three numbers
    velocity  # of its point, vec
    spin      # angular velocity, three numbers
    """
    annotations = dict.fromkeys(("place", "shift", "velocity"), wp.array(dtype=space.vec))
    annotations |= dict.fromkeys(("about", "spin"), wp.array(dtype=space.point))
    annotations["axes"] = wp.array(dtype=space.mat)
    return cast(type, wp.struct(type("Pose", (), {"__annotations__": annotations, "__module__": __name__})))


@cache
def stand_kernel(space: Space) -> wp.Kernel:
    """Where a rigid body is, for the kernels of the run; nothing acts on it yet."""
    real, dim, Pose = space.scalar, space.dim, pose_struct(space)
    here, matrix, point = space.vec, space.mat, space.point

    @kernel()
    def stand(body: Rigid, fields: Fields, began: Fields, pose_out: Pose, load_out: wp.array(dtype=wp.float64)):
        q = quaternion(fields.turn[0])
        R = wp.quat_to_matrix(q)
        about = rotation_way(q * wp.quat_inverse(quaternion(began.turn[0])))
        w = angular_velocity(body, q, fields.spin[0])
        place = here()
        shift = here()
        velocity = here()
        axes = matrix()
        for a in range(wp.static(dim)):
            place[a] = real(fields.place[0][a])
            shift[a] = real(fields.place[0][a] - began.place[0][a])
            velocity[a] = real(fields.velocity[0][a])
            for b in range(wp.static(dim)):
                axes[a, b] = real(R[a, b])
        pose_out.place[0] = place
        pose_out.shift[0] = shift
        pose_out.velocity[0] = velocity
        pose_out.axes[0] = axes
        pose_out.about[0] = point(real(about[0]), real(about[1]), real(about[2]))
        pose_out.spin[0] = point(real(w[0]), real(w[1]), real(w[2]))
        for a in range(6):
            load_out[a] = wp.float64(0.0)

    return stand
