"""Kernels of Taylor-SPH in the current configuration."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, spin, turning
from wsph.constitutive.evolution import stored_over
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.constitutive.turning import turned_gradient
from wsph.formulations.taylor.faces import replacing, turning_faces_struct
from wsph.formulations.taylor.kernels import TaylorKernels, source_kernels
from wsph.formulations.taylor.sums.gather import divergence, gather, handed_on, operator_struct
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct


@cache
def places_struct(space: Space) -> type:
    """Struct of where the particles are at the start, about the body's middle.

    nodes  # real particles, (n,) vec
    cells  # virtual particles, (cells,) vec
    """
    annotations = dict.fromkeys(("nodes", "cells"), wp.array(dtype=space.vec))
    return wp.struct(type("Places", (), {"__annotations__": annotations, "__module__": __name__}))


def _half_step_kernel(
    space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: BodyForceKinds
) -> wp.Kernel:
    real, vec, mat, dim = space.scalar, space.vec, space.mat, space.dim
    Params, kept = laws.Params, "internals" in dict(virtual)
    Operator, Real, Virtual = operator_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
    from_real, linear, force_of = gather(space, laws, real_layout), laws.linear, divergence(space, laws)
    (determinant, inverse), (spin_of, _) = determinant_and_inverse(space), spin(space)
    followed, handed = turned_gradient(space, laws.turned), handed_on(space, laws)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)

    @kernel(ranged=True)
    def half_step(
        first: int,
        p: Params,
        body: Inertia,
        rows: Operator,
        fields: Real,
        sources: Real,
        clock: wp.array(dtype=wp.float64),
        weight: real,
        fields_out: Virtual,
    ):
        i = first + wp.tid()
        dt = real(dt_of(clock)) * weight
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
        slope -= wp.outer(handed(s, s0, q), G)
        H -= wp.outer(u, G)
        F = wp.identity(n=dim, dtype=real) + H
        back = inverse(F)
        v += v0
        s += s0
        L = Ldot * back
        change, dq = linear(p, s, followed(F, L), q, S, Q)
        if wp.static(dim > 1):
            fields_out.spin[i] = spin_of(L)
        fields_out.displacement[i] = u + u0 + dt * v
        fields_out.velocity[i] = v + dt * accelerated(body, i, determinant(F) * force_of(slope * back), v)
        fields_out.stress[i] = s + dt * change
        fields_out.deformation[i] = H + dt * Ldot
        if wp.static(kept):
            fields_out.internals[i] = q + dt * dq

    return half_step


def _surroundings(space: Space, virtual: Layout) -> wp.Function:
    """Warp function (rows, i, fields, places, u0) -> what real particle i, displaced by u0, sees of the virtual ones: their
    mean deformation and spin, their mean place less its own, and the gradient of their places."""
    vec, mat, dim = space.vec, space.mat, space.dim
    spins = space.vector(max(dim * (dim - 1) // 2, 1))
    Operator, Places, Virtual = operator_struct(space), places_struct(space), fields_struct(space, virtual)

    @wp.func
    def seen(rows: Operator, i: int, fields: Virtual, places: Places, u0: vec):
        # The virtual particles see whole cells: their deformation is right at corners too, where a gradient is not.
        H = mat()
        spin = spins()
        x = vec()
        placed = mat()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            j = rows.indices[k]
            H += rows.weight[k] * fields.deformation[j]
            if wp.static(dim > 1):
                spin += rows.weight[k] * fields.spin[j]
            dx = places.cells[j] - places.nodes[i] + (fields.displacement[j] - u0)
            x += rows.weight[k] * dx
            placed += wp.outer(dx, rows.gradient[k])
        return H, spin, x, placed

    return seen


def _inner_rate(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, s, s0, L, q, S, Q, dt) -> rates where no normal stress is prescribed; s less s0, the particle's
    own stress."""
    real, mat, turns = space.scalar, space.mat, laws.depends_on_stress
    Params, stress, internal, linear = laws.Params, laws.stress, laws.internal, laws.linear

    @wp.func
    def inside(p: Params, s: stress, s0: stress, L: mat, q: internal, S: stress, Q: internal, dt: real):
        # The particle's own stress turns with it, not the interpolated one: its odd-even part would stay behind.
        own = s + s0
        if wp.static(turns):
            start_rate, _ = linear(p, s0, L, q, S, Q)
            own = s0 + real(0.5) * dt * start_rate
        change, dq = linear(p, own, L, q, S, Q)
        return change, dq

    return inside


def _face_rate(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, axes, local, s0, L, q, S, Q, mask, dt) -> rates where the normal stresses of `mask` are prescribed;
    `local` is the stress in the frame of the face."""
    real, mat, point = space.scalar, space.mat, space.point
    Params, stress, internal, linear_faces = laws.Params, laws.stress, laws.internal, laws.linear_faces
    (unpack, pack), turned = packing(space, laws.state), turning(space)
    relaxes, at_rest = laws.source is not None, laws.source or laws.respond

    @wp.func
    def at_face(
        p: Params,
        axes: mat,
        local: stress,
        s0: stress,
        L: mat,
        q: internal,
        S: stress,
        Q: internal,
        mask: int,
        dt: real,
    ):
        # In the frame of the face, whose normal stress is prescribed at both ends of the step.
        target = point()
        start = turned(unpack(s0), axes)
        end = unpack(local)
        for a in range(3):
            if (mask >> a) & 1 == 1:
                target[a] = (end[a, a] - start[a, a]) * real(2.0) / dt
        turned_S = pack(turned(unpack(S), axes))
        change, dq = linear_faces(p, local, axes * L * wp.transpose(axes), q, turned_S, Q, mask, target)
        if wp.static(relaxes):
            # Of the particle's own stress in the middle of the step: the source around a face does not see what alternates
            # along it, and nothing else relaxes that.
            own_S, _ = at_rest(p, pack(start) + real(0.5) * dt * change, q)
            change, dq = linear_faces(p, local, axes * L * wp.transpose(axes), q, own_S, Q, mask, target)
        return pack(turned(unpack(change), wp.transpose(axes))), dq

    return at_face


def _rate_kernel(space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: BodyForceKinds) -> wp.Kernel:
    real, vec, mat, dim, stress, internal = space.scalar, space.vec, space.mat, space.dim, laws.stress, laws.internal
    Params, width, kept = laws.Params, len(laws.state.components), "internals" in dict(virtual)
    Operator, Real, Virtual = operator_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
    Faces, Places, Inertia = turning_faces_struct(space), places_struct(space), inertia_struct(space, parts.varied)
    from_virtual, seen, force_of = gather(space, laws, virtual), _surroundings(space, virtual), divergence(space, laws)
    (determinant, inverse), (unpack, pack) = determinant_and_inverse(space), packing(space, laws.state)
    turned, turn_of, accelerated = turning(space), spin(space)[1], acceleration(space, parts)
    replaced, replaced_stress = replacing(space, dim), replacing(space, width)
    inside, at_face = _inner_rate(space, laws), _face_rate(space, laws)
    followed, handed, with_stored = (
        turned_gradient(space, laws.turned),
        handed_on(space, laws),
        stored_over(space, laws),
    )

    @kernel(ranged=True)
    def rate(
        first: int,
        p: Params,
        body: Inertia,
        rows: Operator,
        faces: Faces,
        places: Places,
        fields: Virtual,
        sources: Virtual,
        imposed: Real,
        clock: wp.array(dtype=wp.float64),
        weight: real,
        fields_out: Real,
    ):
        i = first + wp.tid()
        dt = real(dt_of(clock)) * weight
        v0 = fields_out.velocity[i]
        s0 = fields_out.stress[i]
        v, s, q, S, Q, Ldot, slope, G = from_virtual(rows, i, fields, sources, v0, s0)
        H, spin, x, placed = seen(rows, i, fields, places, fields_out.displacement[i] + real(0.5) * dt * v0)
        F = wp.identity(n=dim, dtype=real) + H
        back = inverse(F)
        axes = mat()
        local = s
        if faces.slot[i] >= 0:
            axes = faces.frames[faces.slot[i]]
            local = pack(turned(unpack(s + s0), axes))
        held = faces.held[i]
        if held != 0:
            v = replaced(v, imposed.velocity[i] - v0, held)
            local = replaced_stress(local, imposed.stress[i], held >> wp.static(dim))
            if faces.slot[i] >= 0:
                s = pack(turned(unpack(local), wp.transpose(axes))) - s0
        Ldot -= wp.outer(v, G)
        slope -= wp.outer(handed(s, s0, q), G)
        # Less the turning, by the same operator on the positions: a body that only turns strains nowhere, whatever
        # odd-even part its displacement has, and a face sees no gradient across it of either. About the velocity at the mean
        # place where that is f_I, about the particle's own in components that are prescribed.
        W = mat()
        if wp.static(dim > 1):
            W = turn_of(spin)
        about = replaced(W * x, vec(), held)
        L = W + (Ldot - W * placed + wp.outer(about, G)) * back
        change = stress()
        dq = internal()
        if faces.free[i] == 0:
            change, dq = inside(p, s, s0, followed(F, L), q, S, Q, dt)
        else:
            change, dq = at_face(p, axes, local, s0, followed(F, L), q, S, Q, faces.free[i], dt)
        dq = with_stored(p, s0, change, q, dq, F, dt)
        fields_out.velocity[i] = v0 + dt * accelerated(body, i, determinant(F) * force_of(slope * back), v + v0)
        fields_out.stress[i] = s0 + dt * change
        fields_out.deformation[i] = H + real(0.5) * dt * (L * F)
        fields_out.displacement[i] = fields_out.displacement[i] + real(0.5) * dt * v0
        if wp.static(kept):
            fields_out.internals[i] = fields_out.internals[i] + dt * dq

    return rate


def _turn_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    mat, Fields, turned = space.mat, fields_struct(space, layout), turning(space)
    unpack, pack = packing(space, laws.state)

    @kernel(ranged=True)
    def turn(
        first: int,
        particles: wp.array(dtype=wp.int32),
        frames: wp.array(dtype=mat),
        to_frame: int,
        fields_out: Fields,
    ):
        e = first + wp.tid()
        i = particles[e]
        axes = frames[e]
        if to_frame == 0:
            axes = wp.transpose(axes)
        fields_out.stress[i] = pack(turned(unpack(fields_out.stress[i]), axes))

    return turn


@cache
def kernels(space: Space, laws: Laws, virtual: Layout, real: Layout, parts: BodyForceKinds) -> TaylorKernels:
    """The kernels of a body that moves. `virtual` and `real` are the layouts of the two sets' states."""
    return TaylorKernels(
        _half_step_kernel(space, laws, virtual, real, parts),
        _rate_kernel(space, laws, virtual, real, parts),
        _turn_kernel(space, laws, real),
        source_kernels(space, laws, virtual, real),
    )
