"""The one-set total-Lagrangian system: particles at cell centres, operators of the reference configuration.

    dH_i/dt = sum_j (v_j - v_i) (x) B_i w_ij r_ij,         L = dH/dt F^-1,  F = I + H
    rho_0 dv_i/dt = sum_j (P_i B_i + P_j B_j) w_ij r_ij,    P = J stress F^-T

with w_ij = -W'(r)/r V_j one scalar per pair, r_ij = X_j - X_i and B_i = (sum_j w_ij r (x) r)^-1. The pair force carries each
side's own correction and is antisymmetric: linear momentum is kept to round-off. H is evolved, not F: a strain of 1e-5 in
single precision keeps its digits. The stress is Cauchy's, from the material's rate law; faces are free.
"""

import itertools
from functools import cache

import numpy as np
import warp as wp

from wsph.body_force import BodyForce, Parts, acceleration, inertia_struct
from wsph.conditions import layer_conditions
from wsph.constitutive import Constitutive, Laws, blame, packing
from wsph.errors import Refused
from wsph.neighbours import find_pairs
from wsph.operators import generalized_inverse, interpolation_weights
from wsph.particles import Lattice
from wsph.prescribed import BoundaryValues
from wsph.program import Clock
from wsph.scene import Body, Scene
from wsph.smoothing import SMOOTHING, SUPPORT
from wsph.space import Space, determinant_and_inverse
from wsph.state import Layout, State, fields_struct, layout_of
from wsph.system import System
from wsph.units import Scales
from wsph.work import ConstraintWork

DEFAULT_SUPPORT = 2.6


@cache
def _correction_kernel(space: Space, smoothing: str) -> wp.Kernel:
    real, vec, mat = space.scalar, space.vec, space.mat
    _, slope = SMOOTHING[smoothing](space)
    inverse = generalized_inverse(space)

    @wp.kernel(module="unique", enable_backward=False)
    def correction(h: real, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), cell: wp.array(dtype=vec),
                   position: wp.array(dtype=vec), volume: wp.array(dtype=real), weight_out: wp.array(dtype=real), correction_out: wp.array(dtype=mat),
                   rank_out: wp.array(dtype=wp.int32)):  # fmt: skip
        i = wp.tid()
        moment = mat()
        for k in range(offsets[i], offsets[i + 1]):
            j = indices[k]
            r = position[j] - position[i]
            # The kernel is one of grid coordinates: cells of any aspect have the same neighbours.
            w = -slope(wp.length(cell[j] - cell[i]) / h) * volume[j]
            weight_out[k] = w
            moment += w * wp.outer(r, r)
        b, rank = inverse(moment, real(0.0))
        correction_out[i] = b
        rank_out[i] = rank

    return correction


class Kernels:
    """The kernels of a composition: one instance per (space, laws, which fields there are)."""

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: Parts):
        real, vec, mat = space.scalar, space.vec, space.mat
        internal, Params = laws.internal, laws.Params
        Fields = fields_struct(space, layout)
        respond, dim = laws.respond, space.dim
        kept, displacement = "internals" in dict(layout), "displacement" in dict(layout)
        determinant, inverse = determinant_and_inverse(space)
        unpack, _ = packing(space, laws.state)
        accelerated, Inertia = acceleration(space, parts), inertia_struct(space)

        @wp.kernel(module="unique", enable_backward=False)
        def first_piola(correction: wp.array(dtype=mat), fields: Fields, corrected_out: wp.array(dtype=mat)):
            i = wp.tid()
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            full = unpack(fields.stress[i])
            cauchy = mat()
            for a in range(wp.static(dim)):
                for b in range(wp.static(dim)):
                    cauchy[a, b] = full[a, b]
            corrected_out[i] = determinant(F) * cauchy * wp.transpose(inverse(F)) * correction[i]

        @wp.kernel(module="unique", enable_backward=False)
        def rate(p: Params, body: Inertia, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                 position: wp.array(dtype=vec), correction: wp.array(dtype=mat), corrected: wp.array(dtype=mat), fields: Fields, rate_out: Fields):  # fmt: skip
            i = wp.tid()
            x = position[i]
            v = fields.velocity[i]
            own = corrected[i]
            stretching = mat()
            force = vec()
            for k in range(offsets[i], offsets[i + 1]):
                j = indices[k]
                g = weight[k] * (position[j] - x)
                stretching += wp.outer(fields.velocity[j] - v, g)
                force += (own + corrected[j]) * g
            change = stretching * correction[i]
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            q = internal()
            if wp.static(kept):
                q = fields.internals[i]
            ds, dq = respond(p, fields.stress[i], change * inverse(F), q)
            rate_out.velocity[i] = accelerated(body, force, v)
            rate_out.stress[i] = ds
            rate_out.deformation[i] = change
            if wp.static(kept):
                rate_out.internals[i] = dq
            if wp.static(displacement):
                rate_out.displacement[i] = v

        self.first_piola, self.rate = first_piola, rate


@cache
def _kernels(space: Space, laws: Laws, layout: Layout, parts: Parts) -> Kernels:
    return Kernels(space, laws, layout, parts)


@cache
def _combine_kernel(space: Space, plain: int, timed: int) -> wp.Kernel:
    """out = sum of up to three states and up to three rates times dt, over the flat buffer."""
    real = space.scalar
    coefficients = space.vector(6)

    @wp.kernel(module="unique", enable_backward=False)
    def combine(clock: wp.array(dtype=wp.float64), c: coefficients, x0: wp.array(dtype=real), x1: wp.array(dtype=real), x2: wp.array(dtype=real),
                k0: wp.array(dtype=real), k1: wp.array(dtype=real), k2: wp.array(dtype=real), out: wp.array(dtype=real)):  # fmt: skip
        i = wp.tid()
        total = c[0] * x0[i]
        if wp.static(plain > 1):
            total += c[1] * x1[i]
        if wp.static(plain > 2):
            total += c[2] * x2[i]
        slope = real(0.0)
        if wp.static(timed > 0):
            slope += c[3] * k0[i]
        if wp.static(timed > 1):
            slope += c[4] * k1[i]
        if wp.static(timed > 2):
            slope += c[5] * k2[i]
        out[i] = total + real(clock[1]) * slope

    return combine


class OneSetSystem(System):
    """A body as one-set integrators see it: its particles are the cells."""

    formulation = "total-lagrangian"

    def __init__(self, scene: Scene, body: Body, lattice: Lattice, space: Space, constitutive: Constitutive,
                 scales: Scales, clock: Clock, device: str, displacement: bool):  # fmt: skip
        super().__init__(lattice, space, constitutive, scales, clock, device)
        self.position = lattice.cells
        self.volume = lattice.cell_volume / scales.length**space.dim
        self._displacement = displacement
        _, cells = lattice.centred
        self._support = scene.run.support or DEFAULT_SUPPORT
        self._pairs = find_pairs(cells, cells, self._support, device, same=True)
        if lattice.cracks:
            _, sided = lattice.sided
            row = np.repeat(np.arange(self.count), np.diff(self._pairs.offsets.numpy()))
            self._pairs = self._pairs.where(~lattice.apart(sided[row], sided[self._pairs.indices.numpy()]))
        factor = lattice.frame.step / scales.length
        position = cells * np.where(np.abs(factor - 1.0) < 1e-6, 1.0, factor) @ lattice.frame.axes.T
        double = Space(space.dim)
        weight = wp.zeros(self._pairs.count, dtype=wp.float64, device=device)
        correction = wp.zeros(self.count, dtype=double.mat, device=device)
        rank = wp.zeros(self.count, dtype=wp.int32, device=device)
        wp.launch(_correction_kernel(double, scene.run.kernel), self.count, device=device,
                  inputs=[wp.float64(self._support / SUPPORT), self._pairs.offsets, self._pairs.indices, wp.array(cells, dtype=double.vec, device=device),
                          wp.array(position, dtype=double.vec, device=device), wp.array(self.volume, dtype=wp.float64, device=device)],
                  outputs=[weight, correction, rank])  # fmt: skip
        lonely = np.flatnonzero(rank.numpy() < space.dim)
        if len(lonely):
            raise Refused(
                f"{len(lonely)} particles of body {body.name!r}, the first at {self.position[lonely[0]].tolist()} m, see too few"
                f" neighbours for a gradient: raise run.support (now {self._support:g} spacings)"
            )
        self._weight = wp.array(weight.numpy(), dtype=space.scalar, device=device)
        self._correction = wp.array(correction.numpy(), dtype=space.mat, device=device)
        self._x = wp.array(position, dtype=space.vec, device=device)
        self._corrected = wp.zeros(self.count, dtype=space.mat, device=device)
        self.state = self.new()
        self.conditions = layer_conditions(scene, body.name, lattice, f"integrator {scene.run.integrator.name!r}")
        self.boundary = BoundaryValues(
            space, self.conditions, self.state, self.position, {"velocity": scales.velocity}, scales.time, device
        )
        self.force = BodyForce(scene, body, space, scales, self.density, self.volume, device)
        self.work = ConstraintWork(space, self.boundary, self.density * self.volume, device)
        with blame(constitutive.who):
            self.kernels = _kernels(space, constitutive.laws, self.state.layout, self.force.parts)

    @property
    def pairs(self) -> int:
        """Directed pairs."""
        return self._pairs.count

    def new(self) -> State:
        """A state, zero but for the internals' initial values."""
        return self._make(self.count, layout_of(self.space, self.constitutive, self._displacement, deformation=True))

    def rate(self, state: State, out: State) -> None:
        """`out` = the time derivative of every field of `state`."""
        self.clock.launch(self.kernels.first_piola, self.count, [self._correction, state.struct], [self._corrected])
        inputs = [
            self.constitutive.params,
            self.force.struct,
            self._pairs.offsets,
            self._pairs.indices,
            self._weight,
        ]
        self.clock.launch(
            self.kernels.rate,
            self.count,
            [*inputs, self._x, self._correction, self._corrected, state.struct],
            [out.struct],
        )

    def combine(
        self, out: State, plain: list[tuple[float, State]], timed: list[tuple[float, State]] | None = None
    ) -> None:
        """`out` = sum of c x over `plain` + dt times the sum of c k over `timed`.

        Up to three terms each; `out` may be one of them.
        """
        timed = timed or []
        if not 1 <= len(plain) <= 3 or len(timed) > 3:
            raise ValueError(
                f"combine takes one to three states and up to three rates, not {len(plain)} and {len(timed)}"
            )
        coefficients = [0.0] * 6
        for k, (c, _) in enumerate(plain):
            coefficients[k] = c
        for k, (c, _) in enumerate(timed):
            coefficients[3 + k] = c
        states = [x.buffer for _, x in plain] + [plain[0][1].buffer] * (3 - len(plain))
        rates = [x.buffer for _, x in timed] + [plain[0][1].buffer] * (3 - len(timed))
        kernel = _combine_kernel(self.space, len(plain), len(timed))
        inputs = [self.clock.time, self.space.vector(6)(*coefficients), *states, *rates]
        self.clock.launch(kernel, out.buffer.shape[0], inputs, [out.buffer])

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt, and the work of the constraints."""
        self.work.before(state, self.clock)
        self.impose(state, 1.0)
        self.work.after(state, self.clock)
        self.force.add(state, self.clock)

    def spectral_radius(self, rounds: int = 30) -> float:
        """Largest |eigenvalue| of the rate about the current state, times the spacing over the wave speed.

        Power iteration on two applications of the rate's difference quotient (the eigenvalues come as +-i omega), from a
        seeded random start; 2 % low at worst on lattices, so 5 % is added.
        """
        base, moved, first, second = self.state, self.new(), self.new(), self.new()
        self.rate(base, first)
        rest = first.buffer.numpy().astype(np.float64)
        origin = base.buffer.numpy().astype(np.float64)
        free = np.ones(len(origin))
        for (name, component), values in self.conditions.entries.items():
            free[[base.index(name, particle, component) for particle in values]] = 0.0
        x = np.random.default_rng(0).standard_normal(len(origin)) * free
        step = np.sqrt(self.space.epsilon)
        growth = 0.0
        for _ in range(rounds):
            length = np.linalg.norm(x)
            if length == 0.0:
                return 0.0
            x /= length
            for _ in range(2):
                moved.buffer.assign((origin + step * x).astype(self.space.numpy))
                self.rate(moved, second)
                x = (second.buffer.numpy().astype(np.float64) - rest) / step * free
            growth = float(np.sqrt(np.linalg.norm(x)))
        return 1.05 * growth * self.spacing / (self.constitutive.wave_speed * self.scales.time)

    def sample(self, points: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """How to read the state at `points` (m, dim) [m]: particles and weights per point, linear-exact."""
        cells = self.lattice.index[self.lattice.corners].mean(1)
        points = self.lattice.frame.coordinates(points)
        pairs = find_pairs(points, cells, 1.6, "cpu")
        row = np.repeat(np.arange(len(points)), np.diff(pairs.offsets.numpy()))
        pairs = pairs.where(~self.lattice.apart(points[row], cells[pairs.indices.numpy()]))
        weights = interpolation_weights(Space(self.space.dim), pairs, points, cells, self.lattice.cell_volume)
        offsets, indices, values = pairs.offsets.numpy(), pairs.indices.numpy(), weights.values.numpy()
        return [(indices[a:b], values[a:b]) for a, b in itertools.pairwise(offsets)]

    @property
    def nbytes(self) -> int:
        """Device memory of the body [bytes]: pairs, weights and all states, the integrator's too."""
        return (
            self._pairs.nbytes
            + self._weight.capacity
            + 2 * self._correction.capacity
            + self._x.capacity
            + self.state_bytes
        )
