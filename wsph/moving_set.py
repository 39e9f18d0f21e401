"""The two-set system that moves: updated-Lagrangian Taylor-SPH.

Operators are those of the current configuration. The kernel is carried by the material: the weights keep their reference
values, and a gradient is the reference gradient pushed forward with the local deformation, grad_x f = F^-T grad_X f, with
F from the displacements through the same operator. Where the deformation is locally affine this is the corrected gradient
built on current distances, the smoothing length follows the stretch in every direction (a fixed one loses neighbours beyond
a stretch of 2.4), and virtual particles are the centroids of their cells. Density is rho_0/J.

Faces turn with the body: what a face prescribes of the stress, it prescribes in the frame of its current normal
n ~ F^-T N and its material tangents.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.body_force import Parts, acceleration, inertia_struct
from wsph.constitutive import Constitutive, Laws, packing
from wsph.gather import divergence, gather, rows_struct
from wsph.particles import Lattice
from wsph.program import Clock
from wsph.scene import Body, Scene
from wsph.space import Space, determinant_and_inverse
from wsph.state import Layout, State, fields_struct, layout_of
from wsph.two_set import SourceKernels, TwoSetSystem, drift_kernel, turning
from wsph.units import Scales


@cache
def face_frame(space: Space) -> wp.Function:
    """Warp function (F, F^-1, axis) -> rows of an orthonormal frame: the current normal of a face across `axis`, and the
    material directions in the face, each at the index of its reference axis."""
    dim, vec, mat = space.dim, space.vec, space.mat

    @wp.func
    def frame(F: mat, inverse_F: mat, axis: int) -> mat:
        rows = mat()
        n = vec()
        for i in range(wp.static(dim)):
            n[i] = inverse_F[axis, i]
        n = wp.normalize(n)
        for k in range(wp.static(dim)):
            t = n
            if k != axis:
                for i in range(wp.static(dim)):
                    t[i] = F[i, k]
                # Material lines in the face are at right angles to n already; to one another they may not be.
                for before in range(wp.static(dim)):
                    if before < k and before != axis:
                        other = vec()
                        for i in range(wp.static(dim)):
                            other[i] = rows[before, i]
                        t -= wp.dot(t, other) * other
                t = wp.normalize(t)
            for i in range(wp.static(dim)):
                rows[k, i] = t[i]
        return rows

    return frame


class Kernels(SourceKernels):
    """The kernels of a composition that moves."""

    def __init__(self, space: Space, laws: Laws, virtual: Layout, real_layout: Layout, parts: Parts):
        super().__init__(laws, space, (virtual, real_layout))
        real, vec, mat, point = space.scalar, space.vec, space.mat, space.point
        stress, internal, Params = laws.stress, laws.internal, laws.Params
        Rows, Real, Virtual = rows_struct(space), fields_struct(space, real_layout), fields_struct(space, virtual)
        from_real, from_virtual = gather(space, laws, real_layout), gather(space, laws, virtual)
        linear, linear_faces, force_of = laws.linear, laws.linear_faces, divergence(space, laws)
        dim, width, sourced = space.dim, len(laws.state.components), laws.source is not None
        unpack, pack = packing(space, laws.state)
        determinant, inverse = determinant_and_inverse(space)
        frame, turned = face_frame(space), turning(space)
        accelerated, Inertia = acceleration(space, parts), inertia_struct(space)

        @wp.kernel(module="unique", enable_backward=False)
        def half_step(clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows,
                      fields: Real, sources: Real, fields_out: Virtual):  # fmt: skip
            i = wp.tid()
            dt = real(clock[1]) * weight
            near = rows.indices[rows.offsets[i]]
            v0 = fields.velocity[near]
            s0 = fields.stress[near]
            v, s, q, S, Q, Ldot, slope, G = from_real(rows, i, fields, sources, v0, s0)
            H = mat()
            u = vec()
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                du = fields.displacement[rows.indices[k]] - fields.displacement[near]
                u += rows.weight[k] * du
                H += wp.outer(du, rows.gradient[k])
            Ldot -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            H -= wp.outer(u, G)
            F = wp.identity(n=dim, dtype=real) + H
            back = inverse(F)
            v += v0
            s += s0
            change, dq = linear(p, s, Ldot * back, q, S, Q)
            fields_out.velocity[i] = v + dt * accelerated(body, determinant(F) * force_of(slope * back), v)
            fields_out.stress[i] = s + dt * change
            fields_out.deformation[i] = H + dt * Ldot
            if wp.static(sourced):
                fields_out.internals[i] = q + dt * dq

        @wp.kernel(module="unique", enable_backward=False)
        def rate(clock: wp.array(dtype=wp.float64), weight: real, p: Params, body: Inertia, rows: Rows, held: wp.array(dtype=wp.int32),
                 free: wp.array(dtype=wp.int32), face: wp.array(dtype=wp.int32), grid: mat, fields: Virtual, sources: Virtual, imposed: Real,
                 fields_out: Real):  # fmt: skip
            i = wp.tid()
            dt = real(clock[1]) * weight
            v0 = fields_out.velocity[i]
            s0 = fields_out.stress[i]
            v, s, q, S, Q, Ldot, slope, G = from_virtual(rows, i, fields, sources, v0, s0)
            # The virtual particles see whole cells: their deformation is right at corners too, where a gradient is not.
            H = mat()
            for k in range(rows.offsets[i], rows.offsets[i + 1]):
                H += rows.weight[k] * fields.deformation[rows.indices[k]]
            F = wp.identity(n=dim, dtype=real) + H
            back = inverse(F)
            axes = mat()
            local = s
            if face[i] >= 0:
                axes = frame(F * wp.transpose(grid), grid * back, face[i])
                local = pack(turned(unpack(s + s0), axes))
            if held[i] != 0:
                for c in range(wp.static(dim)):
                    if (held[i] >> c) & 1 == 1:
                        v[c] = imposed.velocity[i][c] - v0[c]
                for c in range(wp.static(width)):
                    if (held[i] >> (wp.static(dim) + c)) & 1 == 1:
                        local[c] = imposed.stress[i][c]
                if face[i] >= 0:
                    s = pack(turned(unpack(local), wp.transpose(axes))) - s0
            Ldot -= wp.outer(v, G)
            slope -= wp.outer(s, G)
            L = Ldot * back
            change = stress()
            dq = internal()
            if free[i] == 0:
                change, dq = linear(p, s + s0, L, q, S, Q)
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
            fields_out.deformation[i] = H + real(0.5) * dt * Ldot
            fields_out.displacement[i] = fields_out.displacement[i] + real(0.5) * dt * v0
            if wp.static(sourced):
                fields_out.internals[i] = fields_out.internals[i] + dt * dq

        @wp.kernel(module="unique", enable_backward=False)
        def turn(
            particles: wp.array(dtype=wp.int32),
            face: wp.array(dtype=wp.int32),
            grid: mat,
            to_frame: int,
            fields_out: Real,
        ):
            i = particles[wp.tid()]
            F = wp.identity(n=dim, dtype=real) + fields_out.deformation[i]
            axes = frame(F * wp.transpose(grid), grid * inverse(F), face[i])
            if to_frame == 0:
                axes = wp.transpose(axes)
            fields_out.stress[i] = pack(turned(unpack(fields_out.stress[i]), axes))

        self.half_step, self.rate, self.turn = half_step, rate, turn
        self.drift = drift_kernel(space, real_layout)


@cache
def _kernels(space: Space, laws: Laws, virtual: Layout, real: Layout, parts: Parts) -> Kernels:
    return Kernels(space, laws, virtual, real, parts)


class MovingTwoSetSystem(TwoSetSystem):
    """A body as updated-Lagrangian Taylor-SPH sees it: the calls of `TwoSetSystem`, in the current configuration."""

    formulation = "updated-lagrangian"
    follows_courant = True
    # Each axis by itself is no gradient under shear and rotation: corners would find strain in a rigid turn.
    widenings = 2

    def __init__(self, scene: Scene, body: Body, lattice: Lattice, space: Space, constitutive: Constitutive,
                 scales: Scales, clock: Clock, device: str, displacement: bool):  # fmt: skip
        super().__init__(scene, body, lattice, space, constitutive, scales, clock, device, displacement=True)
        face = np.full(self.count, -1, np.int32)
        for axis in reversed(range(space.dim)):
            face[np.unique(lattice.faces.nodes[lattice.faces.axis == axis])] = axis
        self._face = wp.array(face, dtype=wp.int32, device=device)

    def _layout(self, where: str) -> Layout:
        return layout_of(self.space, self.constitutive, where == "real", True)

    def _make_kernels(self) -> Kernels:
        layouts = self._layout("virtual"), self._layout("real")
        return _kernels(self.space, self.constitutive.laws, *layouts, self.force.parts)

    def rate(self, source: State, out: State, *, imposed: State, weight: float) -> None:
        """As in `TwoSetSystem`; `imposed` holds stress components in the frames of the faces."""
        inputs = [self.clock.time, self.space.scalar(weight), self.constitutive.params, self.force.struct]
        inputs += [self._real_rows, self._held, self._free, self._face, self._axes, source.struct, self._source(source)]
        self.clock.launch(self.kernels.rate, out.n, [*inputs, imposed.struct], [out.struct])

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed values, stresses in the current frames of the faces."""
        n = self._framed.shape[0]
        self.clock.launch(self.kernels.turn, n, [self._framed, self._face, self._axes, 1], [state.struct])
        self.impose(state, c)
        self.clock.launch(self.kernels.turn, n, [self._framed, self._face, self._axes, 0], [state.struct])

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt, and the work of the faces and of the body forces."""
        self.hold(state, 1.0)
        self.work.add(state, self.clock)
        self.force.add(state, self.clock)
        self.clock.launch(self.kernels.drift, state.n, [self.clock.time], [state.struct])
