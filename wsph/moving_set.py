"""The two-set system that moves: updated-Lagrangian Taylor-SPH.

Operators are those of the current configuration. The kernel is carried by the material: the weights keep their reference
values, and a gradient is the reference gradient pushed forward with the local deformation, grad_x f = F^-T grad_X f, with
F from the displacements through the same operator. Where the deformation is locally affine this is the corrected gradient
built on current distances, the smoothing length follows the stretch in every direction (a fixed one loses neighbours beyond
a stretch of 2.4), and virtual particles are the centroids of their cells. Density is rho_0/J.

Faces turn with the body: what a face prescribes of the stress, it prescribes in the frame of its current normal
n and its material tangents, from where the face's own particles are. (Frames from the deformation inside, F^-T N, see a
shear half a cell below the face that the face does not have: under 1 % of strain along it modes grew by 2 % a step; now by
.03 % in tension and .4 % in compression at ten cells, and by less in proportion to the stress.)
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.body_force import Parts, acceleration, inertia_struct
from wsph.clock import Clock
from wsph.constitutive import Constitutive, Laws
from wsph.gather import divergence, gather, rows_struct
from wsph.particles import Lattice
from wsph.scene import Body, Scene
from wsph.space import Space, determinant_and_inverse
from wsph.state import Layout, State, fields_struct, layout_of
from wsph.stress_state import packing
from wsph.two_set import SourceKernels, TwoSetSystem, drift_kernel, turning
from wsph.units import Scales


@cache
def _spin(space: Space) -> tuple[wp.Function, wp.Function]:
    """Warp functions: velocity gradient -> the components above the diagonal of its skew part, and these -> skew matrix."""
    dim, real, mat = space.dim, space.scalar, space.mat
    spins = space.vector(max(dim * (dim - 1) // 2, 1))

    @wp.func
    def spin_of(L: mat) -> spins:
        w = spins()
        n = int(0)
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if j > i:
                    w[n] = real(0.5) * (L[i, j] - L[j, i])
                    n += 1
        return w

    @wp.func
    def turn_of(w: spins) -> mat:
        W = mat()
        n = int(0)
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if j > i:
                    W[i, j] = w[n]
                    W[j, i] = -w[n]
                    n += 1
        return W

    return spin_of, turn_of


@cache
def _normal(space: Space) -> wp.Function:
    """Warp function (rows, axis, grid) -> the axis that completes the others to a right-handed frame."""
    dim, vec, mat = space.dim, space.vec, space.mat
    if dim == 1:

        @wp.func
        def alone(rows: mat, axis: int, grid: mat) -> vec:
            return vec(grid[0, 0])

        return alone
    if dim == 2:

        @wp.func
        def beside(rows: mat, axis: int, grid: mat) -> vec:
            if axis == 0:
                return vec(rows[1, 1], -rows[1, 0])
            return vec(-rows[0, 1], rows[0, 0])

        return beside

    @wp.func
    def across(rows: mat, axis: int, grid: mat) -> vec:
        return wp.cross(rows[(axis + 1) % 3], rows[(axis + 2) % 3])

    return across


PASSES = 1
"""How often the displacement along a face is averaged over the cells beside a particle before its slope is taken. More
passes calm a compressed face (growth at 1 % strain 4e-3 a step with one, 1e-3 with two) and excite a stretched one (3e-4,
8e-4)."""


@cache
def _frame_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Orthonormal frames of the faces, rows at the index of their axis of the grid: the normal at `axis`, the directions in
    the face from where its particles are."""
    dim, real, vec, mat, Fields = space.dim, space.scalar, space.vec, space.mat, fields_struct(space, layout)
    across = _normal(space)

    @wp.kernel(module="unique", enable_backward=False)
    def frames(first: int, clock: wp.array(dtype=wp.float64), share: real, axis: wp.array(dtype=wp.int32), offsets: wp.array(dtype=wp.int32),
               indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=vec), grid: mat, fields: Fields, frame_out: wp.array(dtype=mat)):  # fmt: skip
        e = first + wp.tid()
        dt = share * real(clock[1])
        near = indices[offsets[e]]
        start = fields.displacement[near] + dt * fields.velocity[near]
        slopes = mat()
        for k in range(offsets[e], offsets[e + 1]):
            j = indices[k]
            slopes += wp.outer(weight[k], fields.displacement[j] + dt * fields.velocity[j] - start)
        rows = mat()
        for k in range(wp.static(dim)):
            if k != axis[e]:
                t = vec()
                for i in range(wp.static(dim)):
                    t[i] = grid[k, i] + slopes[k, i]
                for before in range(wp.static(dim)):
                    if before < k and before != axis[e]:
                        other = vec()
                        for i in range(wp.static(dim)):
                            other[i] = rows[before, i]
                        t -= wp.dot(t, other) * other
                t = wp.normalize(t)
                for i in range(wp.static(dim)):
                    rows[k, i] = t[i]
        n = across(rows, axis[e], grid)
        for i in range(wp.static(dim)):
            rows[axis[e], i] = n[i]
        frame_out[e] = rows

    return frames


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
        spin_of, turn_of = _spin(space)
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
        axis = np.full(self.count, -1, np.int32)
        for k in reversed(range(space.dim)):
            axis[np.unique(lattice.faces.nodes[lattice.faces.axis == k])] = k
        on = np.flatnonzero(axis >= 0)
        slot = np.full(self.count, -1, np.int32)
        slot[on] = np.arange(len(on))
        self._slot = wp.array(slot, dtype=wp.int32, device=device)
        self._axis = wp.array(axis[on], dtype=wp.int32, device=device)
        self._slopes = self._face_slopes(on)
        # About the body's middle: single precision has no digits for how far away it stands.
        middle = lattice.nodes.mean(0)
        self._position = wp.array((lattice.nodes - middle) / scales.length, dtype=space.vec, device=device)
        self._cells = wp.array((lattice.cells - middle) / scales.length, dtype=space.vec, device=device)
        self._frames = wp.zeros(len(on), dtype=space.mat, device=device)

    def _turn_faces(self, state: State, share: float) -> None:
        """The frames of the faces at the displacement + share dt velocity of `state` (a launch)."""
        inputs = [self.clock.time, self.space.scalar(share), self._axis, *self._slopes, self._axes]
        kernel = _frame_kernel(self.space, state.layout)
        self.clock.launch(kernel, self._framed.shape[0], [*inputs, state.struct], [self._frames])

    def _face_slopes(self, on: np.ndarray) -> tuple[wp.array, wp.array, wp.array]:
        """Rows over the particles `on` faces: offsets, particles and weights whose k-th component gives the slope along the
        k-th axis of the grid.

        A slope is that of values averaged PASSES times over the cells beside a particle: an odd-even displacement is
        invisible to the virtual particles, nothing restores it, and frames that saw it would feed it.
        """
        beside, x = self.lattice.neighbours, self.lattice.index
        keys, values = [], []
        for k in range(self.space.dim):
            before, after = beside[on, k, 0], beside[on, k, 1]
            row = np.concatenate([np.arange(len(on))] * 2)
            node, weight = np.concatenate([after, before]), np.repeat([1.0, -1.0], len(on))
            for _ in range(PASSES):
                sides = beside[node, k]
                there = sides != node[:, None]
                share = weight[:, None] * there / (2.0 * np.maximum(there.sum(1), 1))[:, None]
                share = np.where(there.any(1)[:, None], share, 0.5 * weight[:, None])
                row = np.concatenate([row, row, row])
                node, weight = (
                    np.concatenate([node, sides[:, 0], sides[:, 1]]),
                    np.concatenate([share.sum(1), *share.T]),
                )
            length = np.bincount(row, weight * x[node, k], len(on)) * (self.lattice.frame.step[k] / self.scales.length)
            keys.append(row.astype(np.int64) * self.count + node)
            values.append(np.where(length > 0.0, 1.0 / np.where(length > 0.0, length, 1.0), 0.0)[row] * weight)
        kept, place = np.unique(np.concatenate(keys), return_inverse=True)
        axis = np.repeat(np.arange(self.space.dim), [len(v) for v in values])
        weights = np.zeros((len(kept), self.space.dim))
        np.add.at(weights, (place, axis), np.concatenate(values))
        offsets = np.searchsorted(kept, np.arange(len(on) + 1, dtype=np.int64) * self.count)
        return (
            wp.array(offsets, dtype=wp.int32, device=self.device),
            wp.array(kept % self.count, dtype=wp.int32, device=self.device),
            wp.array(weights, dtype=self.space.vec, device=self.device),
        )

    def _layout(self, where: str) -> Layout:
        return layout_of(self.space, self.constitutive, True, True, spin=where == "virtual")

    def _make_kernels(self) -> Kernels:
        layouts = self._layout("virtual"), self._layout("real")
        return _kernels(self.space, self.constitutive.laws, *layouts, self.force.parts)

    def rate(self, source: State, out: State, *, imposed: State, weight: float) -> None:
        """As in `TwoSetSystem`; `imposed` holds stress components in the frames of the faces."""
        self._turn_faces(out, 0.5)
        inputs = [self.clock.time, self.space.scalar(weight), self.constitutive.params, self.force.struct]
        inputs += [
            self._real_rows,
            self._held,
            self._free,
            self._slot,
            self._frames,
            self._position,
            self._cells,
            source.struct,
            self._source(source),
        ]
        self.clock.launch(self.kernels.rate, out.n, [*inputs, imposed.struct], [out.struct])

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed values, stresses in the current frames of the faces."""
        self._turn_faces(state, 0.0)
        self._hold(state, c)

    def _hold(self, state: State, c: float | tuple[float, float]) -> None:
        n = self._framed.shape[0]
        self.clock.launch(self.kernels.turn, n, [self._framed, self._frames, 1], [state.struct])
        self.impose(state, c)
        self.clock.launch(self.kernels.turn, n, [self._framed, self._frames, 0], [state.struct])

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt, and the work of the faces and of the body forces."""
        self.project(state)
        # The displacement has had the first half of its step; the second half is with the velocity at the end.
        self._turn_faces(state, 0.5)
        self._hold(state, 1.0)
        self.work.add(state, self.clock)
        self.force.add(state, self.clock)
        self.clock.launch(self.kernels.drift, state.n, [self.clock.time], [state.struct])
