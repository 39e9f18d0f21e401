"""What two particles in contact do to each other."""

from functools import cache

import warp as wp

from wsph.backend.space import Space


@cache
def law_struct(space: Space) -> type:
    """Struct of what a contact's kernel takes of its law, nondimensional."""
    real = space.scalar
    names = ("stiffness", "shear", "friction", "reach", "curvature", "own_density", "other_density")
    return wp.struct(type("ContactLaw", (), {"__annotations__": dict.fromkeys(names, real), "__module__": __name__}))


@cache
def push_kernel(space: Space, law: str, rubbing: bool, itself: bool) -> wp.Kernel:
    real, vec, Law = space.scalar, space.vec, law_struct(space)

    @wp.kernel(module="unique", enable_backward=False)
    def push(first: int, clock: wp.array(dtype=wp.float64), c: Law, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
             slot: wp.array(dtype=wp.int32), weight: wp.array(dtype=real), x: wp.array(dtype=vec), u: wp.array(dtype=vec), v: wp.array(dtype=vec),
             volume: wp.array(dtype=real), x_other: wp.array(dtype=vec), u_other: wp.array(dtype=vec), v_other: wp.array(dtype=vec),
             volume_other: wp.array(dtype=real), impulse_out: wp.array(dtype=vec)):  # fmt: skip
        i = first + wp.tid()
        dt = real(clock[1])
        total = vec()
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            r = (x[i] - x_other[j]) + (u[i] - u_other[j])
            distance = wp.length(r)
            acts = distance < c.reach and distance > real(0.0)
            # Neighbours in one body push only where the link between them has broken.
            if wp.static(itself) and slot[k] >= 0:
                acts = acts and weight[slot[k]] == real(0.0)
            if acts:
                n = r / distance
                delta = c.reach - distance
                moving = v[i] - v_other[j]
                closing = -wp.dot(moving, n)
                own = c.own_density * volume[i]
                other = c.other_density * volume_other[j]
                mass = own * other / (own + other)
                size = real(0.0)
                if wp.static(law == "penalty"):
                    size = c.stiffness * delta
                else:
                    elastic = c.shear * delta
                    if wp.static(space.dim == 3):
                        elastic = c.shear * c.curvature * wp.sqrt(delta) * delta
                    size = c.stiffness * wp.min(wp.max(mass * closing / dt, real(0.0)), elastic)
                total += dt * size * n
                if wp.static(rubbing):
                    sliding = moving + closing * n
                    speed = wp.length(sliding)
                    if speed > real(0.0):
                        total -= wp.min(c.friction * dt * size, mass * speed) * (sliding / speed)
        impulse_out[i] = impulse_out[i] + total

    return push


@cache
def kick_kernel(space: Space, viscous: bool) -> wp.Kernel:
    real, vec = space.scalar, space.vec

    @wp.kernel(module="unique", enable_backward=False)
    def kick(first: int, density: real, volume: wp.array(dtype=real), free: wp.array(dtype=vec), impulse_out: wp.array(dtype=vec),
             velocity_out: wp.array(dtype=vec), before_out: wp.array(dtype=vec), work_out: wp.array(dtype=wp.float64),
             held_out: wp.array(dtype=wp.float64)):  # fmt: skip
        i = first + wp.tid()
        J = impulse_out[i]
        if wp.dot(J, J) > real(0.0):
            old = velocity_out[i]
            new = old + wp.cw_mul(free[i], J) / (density * volume[i])
            velocity_out[i] = new
            if wp.static(viscous):
                before_out[i] = new
            work_out[i] = work_out[i] + wp.float64(real(0.5) * wp.dot(J, old + new))
            # What holds a prescribed component takes the impulse, and the work.
            held_out[i] = held_out[i] - wp.float64(wp.dot(J - wp.cw_mul(free[i], J), old))
            impulse_out[i] = vec()

    return kick
