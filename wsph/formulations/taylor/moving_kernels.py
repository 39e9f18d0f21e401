"""Kernels of Taylor-SPH in the current configuration."""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, spin, turning
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.taylor.gather import divergence, gather, rows_struct
from wsph.formulations.taylor.kernels import SourceKernels, drift_kernel
from wsph.parts.body_force import Parts, acceleration, inertia_struct


class Kernels(SourceKernels):
    """The kernels of a composition that moves."""

    def __init__(self, space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: Parts):
        super().__init__(laws, space, (virtual, real_layout))
        real, vec, mat, point = space.scalar, space.vec, space.mat, space.point
        stress, internal, Params = laws.stress, laws.internal, laws.Params
        Rows, Real, Virtual = rows_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
        from_real, from_virtual = gather(space, laws, real_layout), gather(space, laws, virtual)
        linear, linear_faces, force_of = laws.linear, laws.linear_faces, divergence(space, laws)
        dim, width, kept = space.dim, len(laws.state.components), "internals" in dict(virtual)
        turns = laws.depends_on_stress
        unpack, pack = packing(space, laws.state)
        determinant, inverse = determinant_and_inverse(space)
        turned, spins = turning(space), space.vector(max(dim * (dim - 1) // 2, 1))
        spin_of, turn_of = spin(space)
        accelerated, Inertia = acceleration(space, parts), inertia_struct(space)

        @wp.kernel(module="unique", enable_backward=False)
        def half_step(first: int, clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows,
                      fields: Real, sources: Real, fields_out: Virtual):  # fmt: skip
            i = first + wp.tid()
            dt = real(clock[1]) * weight
            near = rows.indices[rows.offsets[i]]
            v0 = fields.velocity[near]
            s0 = fields.stress[near]
            v, s, q, S, Q, Ldot, slope, G = from_real(rows, i, fields, sources, v0, s0)
            H = mat()
            u = vec()
            u0 = fields.displacement[near]
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                du = fields.displacement[rows.indices[k]] - u0
                u += rows.weight[k] * du
                H += wp.outer(du, rows.gradient[k])
            Ldot -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            H -= wp.outer(u, G)
            F = wp.identity(n=dim, dtype=real) + H
            back = inverse(F)
            v += v0
            s += s0
            L = Ldot * back
            change, dq = linear(p, s, L, q, S, Q)
            if wp.static(dim > 1):
                fields_out.spin[i] = spin_of(L)
            fields_out.displacement[i] = u + u0 + dt * v
            fields_out.velocity[i] = v + dt * accelerated(body, determinant(F) * force_of(slope * back), v)
            fields_out.stress[i] = s + dt * change
            fields_out.deformation[i] = H + dt * Ldot
            if wp.static(kept):
                fields_out.internals[i] = q + dt * dq

        @wp.kernel(module="unique", enable_backward=False)
        def rate(first: int, clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows, held: wp.array(dtype=wp.int32),
                 free: wp.array(dtype=wp.int32), slot: wp.array(dtype=wp.int32), frames: wp.array(dtype=mat), position: wp.array(dtype=vec),
                 cells: wp.array(dtype=vec), fields: Virtual, sources: Virtual, imposed: Real, fields_out: Real):  # fmt: skip
            i = first + wp.tid()
            dt = real(clock[1]) * weight
            v0 = fields_out.velocity[i]
            s0 = fields_out.stress[i]
            v, s, q, S, Q, Ldot, slope, G = from_virtual(rows, i, fields, sources, v0, s0)
            # The virtual particles see whole cells: their deformation is right at corners too, where a gradient is not.
            H = mat()
            spin = spins()
            u0 = fields_out.displacement[i] + real(0.5) * dt * v0
            x = vec()
            placed = mat()
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                j = rows.indices[k]
                H += rows.weight[k] * fields.deformation[j]
                if wp.static(dim > 1):
                    spin += rows.weight[k] * fields.spin[j]
                dx = cells[j] - position[i] + (fields.displacement[j] - u0)
                x += rows.weight[k] * dx
                placed += wp.outer(dx, rows.gradient[k])
            F = wp.identity(n=dim, dtype=real) + H
            back = inverse(F)
            axes = mat()
            local = s
            if slot[i] >= 0:
                axes = frames[slot[i]]
                local = pack(turned(unpack(s + s0), axes))
            if held[i] != 0:
                for c in range(wp.static(dim)):
                    if (held[i] >> c) & 1 == 1:
                        v[c] = imposed.velocity[i][c] - v0[c]
                        x[c] = real(0.0)
                for c in range(wp.static(width)):
                    if (held[i] >> (wp.static(dim) + c)) & 1 == 1:
                        local[c] = imposed.stress[i][c]
                if slot[i] >= 0:
                    s = pack(turned(unpack(local), wp.transpose(axes))) - s0
            Ldot -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            # Less the turning, by the same operator on the positions: a body that only turns strains nowhere, whatever
            # odd-even part its displacement has, and a face sees no gradient across it of either.
            placed -= wp.outer(x, G)
            W = mat()
            if wp.static(dim > 1):
                W = turn_of(spin)
            L = W + (Ldot - W * placed) * back
            change = stress()
            dq = internal()
            if free[i] == 0:
                # The particle's own stress turns with it, not the interpolated one: its odd-even part would stay behind.
                own = s + s0
                if wp.static(turns):
                    start_rate, _ = linear(p, s0, L, q, S, Q)
                    own = s0 + real(0.5) * dt * start_rate
                change, dq = linear(p, own, L, q, S, Q)
            else:
                # In the frame of the face, whose normal stress is prescribed at both ends of the step.
                target = point()
                start = turned(unpack(s0), axes)
                end = unpack(local)
                for a in range(3):
                    if (free[i] >> a) & 1 == 1:
                        target[a] = (end[a, a] - start[a, a]) * real(2.0) / dt
                turned_S = pack(turned(unpack(S), axes))
                change, dq = linear_faces(p, local, axes * L * wp.transpose(axes), q, turned_S, Q, free[i], target)
                change = pack(turned(unpack(change), wp.transpose(axes)))
            fields_out.velocity[i] = v0 + dt * accelerated(body, determinant(F) * force_of(slope * back), v + v0)
            fields_out.stress[i] = s0 + dt * change
            fields_out.deformation[i] = H + real(0.5) * dt * (L * F)
            fields_out.displacement[i] = fields_out.displacement[i] + real(0.5) * dt * v0
            if wp.static(kept):
                fields_out.internals[i] = fields_out.internals[i] + dt * dq

        @wp.kernel(module="unique", enable_backward=False)
        def turn(
            first: int,
            particles: wp.array(dtype=wp.int32),
            frames: wp.array(dtype=mat),
            to_frame: int,
            fields_out: Real,
        ):
            e = first + wp.tid()
            i = particles[e]
            axes = frames[e]
            if to_frame == 0:
                axes = wp.transpose(axes)
            fields_out.stress[i] = pack(turned(unpack(fields_out.stress[i]), axes))

        self.half_step, self.rate, self.turn = half_step, rate, turn
        self.drift = drift_kernel(space, real_layout)


@cache
def kernels(space: Space, laws: Laws, virtual: Layout, real: Layout, parts: Parts) -> Kernels:
    return Kernels(space, laws, virtual, real, parts)
