"""Kernels of Taylor-SPH in small strain."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import turning
from wsph.constitutive.evolution import volume_ratio
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.taylor.faces import faces_struct, replacing
from wsph.formulations.taylor.sums.gather import divergence, gather, operator_struct, target_of
from wsph.formulations.taylor.sums.row_kernels import step_kernel
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct


@dataclass(frozen=True)
class TaylorKernels:
    """The kernels of a composition.

    `half_step` advances the virtual particles from the real ones, `rate` the real ones from the virtual ones, `turn` turns
    stresses on faces into the axes of the faces and back, `source`, by the layout of the state, evaluates a law that
    relaxes at L = 0. Those `by_rows` do both half steps of particles whose rows follow from the lattice, None where there
    are none.
    """

    half_step: wp.Kernel
    rate: wp.Kernel
    turn: wp.Kernel
    source: dict[Layout, wp.Kernel]
    by_rows: tuple[wp.Kernel | None, wp.Kernel | None] = (None, None)


def source_kernels(space: Space, laws: Laws, *layouts: Layout) -> dict[Layout, wp.Kernel]:
    """The kernel that evaluates the law at L = 0, for every layout, where the law relaxes."""
    if laws.source is None:
        return {}
    return {layout: _source_kernel(space, laws, layout) for layout in dict.fromkeys(layouts)}


def _source_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    Params, at_rest, Fields = laws.Params, laws.source or laws.respond, fields_struct(space, layout)
    ratio, last = volume_ratio(space, laws, layout), laws.kept.dissipation

    @kernel(ranged=True)
    def source(first: int, p: Params, fields: Fields, source_out: Fields):
        i = first + wp.tid()
        rate, dq = at_rest(p, fields.stress[i], fields.internals[i])
        if wp.static("deformation" in layout):
            # Energies are per volume at the start.
            dq[last] = ratio(fields, i) * dq[last]
        source_out.stress[i] = rate
        source_out.internals[i] = dq

    return source


def _half_step_kernel(
    space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: BodyForceKinds, mixed: bool
) -> wp.Kernel:
    real, Params, kept = space.scalar, laws.Params, "internals" in dict(virtual)
    Operator, Real, Virtual = operator_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
    from_real, linear, force_of = gather(space, laws, real_layout), laws.linear, divergence(space, laws)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)
    target = target_of(space, mixed)

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
        row = first + wp.tid()
        i = target(rows, row)
        dt = real(dt_of(clock)) * weight
        near = rows.indices[rows.offsets[row]]
        v0 = fields.velocity[near]
        s0 = fields.stress[near]
        v, s, q, S, Q, L, slope, G = from_real(rows, row, fields, sources, v0, s0)
        # At a virtual particle f_I is the interpolated value itself.
        L -= wp.outer(v, G)
        slope -= wp.outer(s, G)
        change, dq = linear(p, s + s0, L, q, S, Q)
        fields_out.velocity[i] = v + v0 + dt * accelerated(body, i, force_of(slope), v + v0)
        fields_out.stress[i] = s + s0 + dt * change
        if wp.static(kept):
            fields_out.internals[i] = q + dt * dq

    return half_step


def _face_values(space: Space, laws: Laws, rotated: bool) -> wp.Function:
    """Warp function (axes, s, s0, imposed, bits) -> s with the imposed components, in the axes of the face; s less s0."""
    mat, stress = space.mat, laws.stress
    (unpack, pack), turned = packing(space, laws.state), turning(space)
    replaced = replacing(space, len(laws.state.components))

    @wp.func
    def prescribed(axes: mat, s: stress, s0: stress, imposed: stress, bits: int) -> stress:
        if wp.static(rotated):
            local = replaced(pack(turned(unpack(s + s0), axes)), imposed, bits)
            return pack(turned(unpack(local), wp.transpose(axes))) - s0
        return replaced(s, imposed - s0, bits)

    return prescribed


def _face_rate(space: Space, laws: Laws, rotated: bool) -> wp.Function:
    """Warp function (p, axes, s, s0, L, q, S, Q, mask, dt) -> rates where the normal stresses of `mask` are prescribed; s
    less s0."""
    real, mat, point = space.scalar, space.mat, space.point
    Params, stress, internal = laws.Params, laws.stress, laws.internal
    (unpack, pack), turned, linear_faces = packing(space, laws.state), turning(space), laws.linear_faces

    @wp.func
    def at_face(
        p: Params,
        axes: mat,
        s: stress,
        s0: stress,
        L: mat,
        q: internal,
        S: stress,
        Q: internal,
        mask: int,
        dt: real,
    ):
        # The face's stress is prescribed at both ends of the step: its rate is known, the strain rate is not.
        target = point()
        difference = unpack(s)
        if wp.static(rotated):
            difference = turned(difference, axes)
        for a in range(3):
            if (mask >> a) & 1 == 1:
                target[a] = difference[a, a] * real(2.0) / dt
        if wp.static(rotated):
            own = pack(turned(unpack(s + s0), axes))
            own_S = pack(turned(unpack(S), axes))
            change, dq = linear_faces(p, own, axes * L * wp.transpose(axes), q, own_S, Q, mask, target)
            return pack(turned(unpack(change), wp.transpose(axes))), dq
        else:
            change, dq = linear_faces(p, s + s0, L, q, S, Q, mask, target)
            return change, dq

    return at_face


def _rate_kernel(
    space: Space,
    laws: Laws,
    virtual: Layout,
    real_layout: Layout,
    parts: BodyForceKinds,
    rotated: bool,
    mixed: bool,
) -> wp.Kernel:
    real, dim, Params, stress, internal = space.scalar, space.dim, laws.Params, laws.stress, laws.internal
    kept, displacement = "internals" in dict(virtual), "displacement" in dict(real_layout)
    Operator, Real, Virtual = operator_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
    from_virtual, linear, force_of = gather(space, laws, virtual), laws.linear, divergence(space, laws)
    Faces, replaced, at_face = faces_struct(space), replacing(space, space.dim), _face_rate(space, laws, rotated)
    prescribed, target = _face_values(space, laws, rotated), target_of(space, mixed)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)

    @kernel(ranged=True)
    def rate(
        first: int,
        p: Params,
        body: Inertia,
        rows: Operator,
        faces: Faces,
        fields: Virtual,
        sources: Virtual,
        imposed: Real,
        clock: wp.array(dtype=wp.float64),
        weight: real,
        fields_out: Real,
    ):
        row = first + wp.tid()
        i = target(rows, row)
        dt = real(dt_of(clock)) * weight
        v0 = fields_out.velocity[i]
        s0 = fields_out.stress[i]
        v, s, q, S, Q, L, slope, G = from_virtual(rows, row, fields, sources, v0, s0)
        # f_I: the interpolated value, or the prescribed one.
        held = faces.held[i]
        if held != 0:
            v = replaced(v, imposed.velocity[i] - v0, held)
            s = prescribed(faces.axes, s, s0, imposed.stress[i], held >> wp.static(dim))
        L -= wp.outer(v, G)
        slope -= wp.outer(s, G)
        change = stress()
        dq = internal()
        if faces.free[i] == 0:
            change, dq = linear(p, s + s0, L, q, S, Q)
        else:
            change, dq = at_face(p, faces.axes, s, s0, L, q, S, Q, faces.free[i], dt)
        fields_out.velocity[i] = v0 + dt * accelerated(body, i, force_of(slope), v + v0)
        fields_out.stress[i] = s0 + dt * change
        if wp.static(kept):
            fields_out.internals[i] = fields_out.internals[i] + dt * dq
        if wp.static(displacement):
            fields_out.displacement[i] = fields_out.displacement[i] + real(0.5) * dt * v0

    return rate


def _turn_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    mat, Fields, turned = space.mat, fields_struct(space, layout), turning(space)
    unpack, pack = packing(space, laws.state)

    @kernel(ranged=True)
    def turn(first: int, axes: mat, particles: wp.array(dtype=wp.int32), fields_out: Fields):
        i = particles[first + wp.tid()]
        fields_out.stress[i] = pack(turned(unpack(fields_out.stress[i]), axes))

    return turn


@cache
def drift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """The second half of the displacement's trapezoidal step: u += dt/2 v."""
    real, Fields = space.scalar, fields_struct(space, layout)

    @kernel(ranged=True)
    def drift(first: int, clock: wp.array(dtype=wp.float64), fields_out: Fields):
        i = first + wp.tid()
        half = real(0.5) * real(dt_of(clock))
        fields_out.displacement[i] = fields_out.displacement[i] + half * fields_out.velocity[i]

    return drift


@cache
def kernels(
    space: Space,
    laws: Laws,
    virtual: Layout,
    real: Layout,
    parts: BodyForceKinds,
    rotated: bool,
    mixed: tuple[bool, bool],
    width: int,
) -> TaylorKernels:
    """The kernels of a body in small strain. `virtual` and `real` are the layouts of the two sets' states; `rotated`: the
    axes of its faces are not the coordinate axes; `mixed`: whether the virtual and the real particles have rows that follow
    from the lattice, `width` of them a thread."""

    def by_rows(source: Layout, target: Layout, adds: bool) -> wp.Kernel | None:
        if not mixed[adds]:
            return None
        return step_kernel(space, laws, source, target, parts, width, rotated=rotated, adds=adds)

    return TaylorKernels(
        _half_step_kernel(space, laws, virtual, real, parts, mixed[0]),
        _rate_kernel(space, laws, virtual, real, parts, rotated, mixed[1]),
        _turn_kernel(space, laws, real),
        source_kernels(space, laws, virtual, real),
        (by_rows(real, virtual, False), by_rows(virtual, real, True)),
    )
