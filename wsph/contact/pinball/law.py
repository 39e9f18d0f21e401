"""The forces of two balls in contact on each other, and the kernels that apply them."""

from functools import cache
from typing import Protocol

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.sph.rows import rows_struct


class ContactLaw(Protocol):
    """What a contact's kernel takes of its law, as `law_struct` has it."""

    stiffness: float
    shear: float
    friction: float
    reach: float
    curvature: float
    own_density: float
    other_density: float


class Balls(Protocol):
    """What it takes of a body's particles, as `body_struct` has them."""

    x: Array
    u: Array
    v: Array
    volume: Array


@cache
def law_struct(space: Space) -> type:
    """Struct of a contact's law as kernels take it, nondimensional.

    stiffness      # the factor K_s
    shear          # G_i G_j/(G_i + G_j) of the shear moduli
    friction       # coefficient mu
    reach          # R_i + R_j, the distance at which two particles touch
    curvature      # sqrt(R_i R_j/(R_i + R_j))
    own_density    # of the body that is pushed
    other_density  # of the body that pushes
    """
    real = space.scalar
    names = ("stiffness", "shear", "friction", "reach", "curvature", "own_density", "other_density")
    return wp.struct(type("ContactLaw", (), {"__annotations__": dict.fromkeys(names, real), "__module__": __name__}))


@cache
def body_struct(space: Space) -> type:
    """Struct of a body as the kernels of contacts take it, nondimensional.

    x       # places at the start, about a middle that all bodies share, (n,) vec
    u       # displacements, (n,) vec
    v       # velocities, (n,) vec
    volume  # (n,) scalar
    """
    annotations = {name: wp.array(dtype=space.vec) for name in ("x", "u", "v")}
    annotations["volume"] = wp.array(dtype=space.scalar)
    return wp.struct(type("ContactBody", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def push_size(space: Space) -> wp.Function:
    """Warp function (law, overlap, closing speed, reduced mass, dt) -> the force between two particles along their line."""
    real, dim, Law = space.scalar, space.dim, law_struct(space)

    @wp.func
    def pinball(c: Law, delta: real, closing: real, mass: real, dt: real) -> real:
        elastic = c.shear * delta
        if wp.static(dim == 3):
            elastic = c.shear * c.curvature * wp.sqrt(delta) * delta
        return c.stiffness * wp.min(wp.max(mass * closing / dt, real(0.0)), elastic)

    return pinball


@cache
def push_kernel(space: Space, rubbing: bool, itself: bool) -> wp.Kernel:
    """Forces on the particles of a body, from those of another one or of itself. `slot` (pairs,): where the weight of the
    link between two neighbours stands in `weight`, -1 for others."""
    real, vec, Law, Body, Rows = space.scalar, space.vec, law_struct(space), body_struct(space), rows_struct(space)
    size_of = push_size(space)

    @kernel(ranged=True)
    def push(
        first: int,
        c: Law,
        rows: Rows,
        own: Body,
        other: Body,
        clock: wp.array(dtype=wp.float64),
        slot: wp.array(dtype=wp.int32),
        weight: wp.array(dtype=real),
        force_out: wp.array(dtype=vec),
    ):
        i = first + wp.tid()
        dt = real(dt_of(clock))
        total = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            j = rows.indices[k]
            r = (own.x[i] - other.x[j]) + (own.u[i] - other.u[j])
            distance = wp.length(r)
            acts = distance < c.reach and distance > real(0.0)
            # Neighbours in one body push only where the link between them has broken.
            if wp.static(itself) and slot[k] >= 0:
                acts = acts and weight[slot[k]] == real(0.0)
            if acts:
                n = r / distance
                moving = own.v[i] - other.v[j]
                closing = -wp.dot(moving, n)
                mine = c.own_density * own.volume[i]
                theirs = c.other_density * other.volume[j]
                mass = mine * theirs / (mine + theirs)
                delta = c.reach - distance
                size = size_of(c, delta, closing, mass, dt)
                total += size * n
                if wp.static(rubbing):
                    sliding = moving + closing * n
                    speed = wp.length(sliding)
                    if speed > real(0.0):
                        total -= wp.min(c.friction * size, mass * speed / dt) * (sliding / speed)
        force_out[i] = force_out[i] + total

    return push


@cache
def kick_kernel(space: Space, opens: bool) -> wp.Kernel:
    """Change the velocities by half of the forces' impulse, and count the work. `free` (n,) vec is one along the axes along
    which a velocity is not prescribed. `opens`: a step begins with it, and the forces are zero after it."""
    real, vec = space.scalar, space.vec

    @kernel(ranged=True)
    def kick(
        first: int,
        volume: wp.array(dtype=real),
        free: wp.array(dtype=vec),
        density: real,
        clock: wp.array(dtype=wp.float64),
        force_out: wp.array(dtype=vec),
        velocity_out: wp.array(dtype=vec),
        taken_out: wp.array(dtype=wp.float64),
        held_out: wp.array(dtype=wp.float64),
    ):
        i = first + wp.tid()
        half = real(0.5) * real(dt_of(clock))
        J = half * force_out[i]
        if wp.dot(J, J) > real(0.0):
            old = velocity_out[i]
            new = old + wp.cw_mul(free[i], J) / (density * volume[i])
            velocity_out[i] = new
            taken_out[i] = taken_out[i] - wp.float64(real(0.5) * wp.dot(J, old + new))
            # What holds a prescribed component takes the impulse, and the work.
            held_out[i] = held_out[i] - wp.float64(wp.dot(J - wp.cw_mul(free[i], J), old))
        if wp.static(opens):
            force_out[i] = vec()

    return kick
