"""Kernels of Taylor-SPH in small strain."""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import turning
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.taylor.gather import divergence, gather, rows_struct
from wsph.parts.body_force import Parts, acceleration, inertia_struct


class SourceKernels:
    """The kernel that evaluates the law at L = 0, one for each of the two sets' layouts, where the law relaxes."""

    def __init__(self, laws: Laws, space: Space, layouts: tuple[Layout, Layout]):
        if laws.source is not None:
            self.source = {
                layout: _source_kernel(laws, fields_struct(space, layout)) for layout in dict.fromkeys(layouts)
            }


def _source_kernel(laws: Laws, Fields: type) -> wp.Kernel:
    Params, at_rest = laws.Params, laws.source or laws.respond

    @wp.kernel(module="unique", enable_backward=False)
    def source(first: int, p: Params, fields: Fields, source_out: Fields):
        i = first + wp.tid()
        rate, dq = at_rest(p, fields.stress[i], fields.internals[i])
        source_out.stress[i] = rate
        source_out.internals[i] = dq

    return source


class Kernels(SourceKernels):
    """The kernels of a composition. `virtual` and `real_layout` are the layouts of the two sets' states."""

    def __init__(self, space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: Parts, rotated: bool):
        super().__init__(laws, space, (virtual, real_layout))
        real, mat, point = space.scalar, space.mat, space.point
        stress, internal, Params = laws.stress, laws.internal, laws.Params
        Rows, Real, Virtual = rows_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
        from_real, from_virtual = gather(space, laws, real_layout), gather(space, laws, virtual)
        linear, linear_faces, force_of = laws.linear, laws.linear_faces, divergence(space, laws)
        dim, width, kept = space.dim, len(laws.state.components), "internals" in dict(virtual)
        displacement = "displacement" in dict(real_layout)
        unpack, pack = packing(space, laws.state)
        turned, accelerated, Inertia = turning(space), acceleration(space, parts), inertia_struct(space)

        @wp.kernel(module="unique", enable_backward=False)
        def half_step(first: int, clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows,
                      fields: Real, sources: Real, fields_out: Virtual):  # fmt: skip
            i = first + wp.tid()
            dt = real(clock[1]) * weight
            near = rows.indices[rows.offsets[i]]
            v0 = fields.velocity[near]
            s0 = fields.stress[near]
            v, s, q, S, Q, L, slope, G = from_real(rows, i, fields, sources, v0, s0)
            # At a virtual particle f_I is the interpolated value itself.
            L -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            change, dq = linear(p, s + s0, L, q, S, Q)
            fields_out.velocity[i] = v + v0 + dt * accelerated(body, force_of(slope), v + v0)
            fields_out.stress[i] = s + s0 + dt * change
            if wp.static(kept):
                fields_out.internals[i] = q + dt * dq

        @wp.kernel(module="unique", enable_backward=False)
        def rate(first: int, clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows, held: wp.array(dtype=wp.int32),
                 free: wp.array(dtype=wp.int32), axes: mat, fields: Virtual, sources: Virtual, imposed: Real, fields_out: Real):  # fmt: skip
            i = first + wp.tid()
            dt = real(clock[1]) * weight
            v0 = fields_out.velocity[i]
            s0 = fields_out.stress[i]
            v, s, q, S, Q, L, slope, G = from_virtual(rows, i, fields, sources, v0, s0)
            # f_I: the interpolated value, or the prescribed one.
            if held[i] != 0:
                for c in range(wp.static(dim)):
                    if (held[i] >> c) & 1 == 1:
                        v[c] = imposed.velocity[i][c] - v0[c]
                if wp.static(rotated):
                    local = pack(turned(unpack(s + s0), axes))
                    for c in range(wp.static(width)):
                        if (held[i] >> (wp.static(dim) + c)) & 1 == 1:
                            local[c] = imposed.stress[i][c]
                    s = pack(turned(unpack(local), wp.transpose(axes))) - s0
                else:
                    for c in range(wp.static(width)):
                        if (held[i] >> (wp.static(dim) + c)) & 1 == 1:
                            s[c] = imposed.stress[i][c] - s0[c]
            L -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            change = stress()
            dq = internal()
            if free[i] == 0:
                change, dq = linear(p, s + s0, L, q, S, Q)
            else:
                # The face's stress is prescribed at both ends of the step: its rate is known, the strain rate is not.
                target = point()
                difference = unpack(s)
                if wp.static(rotated):
                    difference = turned(difference, axes)
                for a in range(3):
                    if (free[i] >> a) & 1 == 1:
                        target[a] = difference[a, a] * real(2.0) / dt
                if wp.static(rotated):
                    own = pack(turned(unpack(s + s0), axes))
                    own_S = pack(turned(unpack(S), axes))
                    change, dq = linear_faces(p, own, axes * L * wp.transpose(axes), q, own_S, Q, free[i], target)
                    change = pack(turned(unpack(change), wp.transpose(axes)))
                else:
                    change, dq = linear_faces(p, s + s0, L, q, S, Q, free[i], target)
            fields_out.velocity[i] = v0 + dt * accelerated(body, force_of(slope), v + v0)
            fields_out.stress[i] = s0 + dt * change
            if wp.static(kept):
                fields_out.internals[i] = fields_out.internals[i] + dt * dq
            if wp.static(displacement):
                fields_out.displacement[i] = fields_out.displacement[i] + real(0.5) * dt * v0

        @wp.kernel(module="unique", enable_backward=False)
        def turn(first: int, particles: wp.array(dtype=wp.int32), axes: mat, fields_out: Real):
            i = particles[first + wp.tid()]
            fields_out.stress[i] = pack(turned(unpack(fields_out.stress[i]), axes))

        self.half_step, self.rate, self.turn = half_step, rate, turn
        if displacement:
            self.drift = drift_kernel(space, real_layout)


@cache
def drift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """The second half of the displacement's trapezoidal step: u += dt/2 v."""
    real, Fields = space.scalar, fields_struct(space, layout)

    @wp.kernel(module="unique", enable_backward=False)
    def drift(first: int, clock: wp.array(dtype=wp.float64), fields_out: Fields):
        i = first + wp.tid()
        half = real(0.5) * real(clock[1])
        fields_out.displacement[i] = fields_out.displacement[i] + half * fields_out.velocity[i]

    return drift


@cache
def kernels(space: Space, laws: Laws, virtual: Layout, real: Layout, parts: Parts, rotated: bool) -> Kernels:
    return Kernels(space, laws, virtual, real, parts, rotated)
