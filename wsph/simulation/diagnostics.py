"""Energies, momentum and the finite check of a body, in blocks of fixed size: the same sums for any number of threads."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.laws import Laws
from wsph.parts.phase_field.field import BROKEN
from wsph.parts.phase_field.response import damaged

BLOCK = 1024

SMALL = 0.02
"""A strain below which a bound of the distortion is as good as the distortion: limits are found anew beyond 5 %."""

_KINETIC, _STRAIN, _DISSIPATED, _NOT_FINITE, _FIRST, _STRETCH, _DISTORTION, _MOMENTUM = range(8)


@dataclass
class BodySums:
    """Sums over a body, nondimensional: energies, momentum (dim,), `bad` (first particle that is not finite or is turned
    inside out, or -1), `stretch`, the largest factor by which deformation has raised a particle's Courant number, and
    `distortion`, the largest factor by which it has lengthened or shortened a line."""

    kinetic: float
    strain: float
    dissipated: float
    momentum: np.ndarray
    bad: int
    stretch: float
    distortion: float


@cache
def _kernel(space: Space, laws: Laws, layout: Layout, model: str, follows: bool) -> wp.Kernel:
    real, dim = space.scalar, space.dim
    Fields, Params, energy = fields_struct(space, layout), laws.Params, laws.energy
    internals, deformed = dict(layout).get("internals", 0), "deformation" in dict(layout)
    determinant, inverse = determinant_and_inverse(space)
    mat, vec = space.mat, space.vec

    @wp.func
    def shortening(back: mat) -> real:
        # The largest singular value of a matrix, by power iteration from a fixed start.
        square = back * wp.transpose(back)
        x = vec()
        for a in range(wp.static(dim)):
            x[a] = real(1.0) + real(0.1) * real(a)
        for _ in range(wp.static(12 if dim > 1 else 1)):
            x = wp.normalize(square * x)
        return wp.sqrt(wp.dot(x, square * x))

    total, total_energy = laws.total_energy is not None, laws.total_energy or energy
    breaks, phased = model != "", model in ("AT1", "AT2")
    damaged_energy = damaged(space, laws, model)[1] if phased else energy
    dissipates, last = laws.dissipates, internals - 1

    @wp.kernel(module="unique", enable_backward=False)
    def ledger(
        n: int,
        m: int,
        p: Params,
        density: real,
        volume: wp.array(dtype=real),
        points: wp.array(dtype=real),
        fields: Fields,
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        block = wp.tid()
        kinetic = wp.float64(0.0)
        strain = wp.float64(0.0)
        dissipated = wp.float64(0.0)
        broken = wp.float64(0.0)
        first = wp.float64(-1.0)
        stretch = wp.float64(1.0)
        distortion = wp.float64(1.0)
        momentum = wp.vec3d()
        # A body may have its velocities and its stresses at different places: nodes and points.
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, n)):
            v = fields.velocity[i]
            mass = density * volume[i]
            square = wp.dot(v, v)
            kinetic += wp.float64(real(0.5) * mass * square)
            for a in range(wp.static(dim)):
                momentum[a] = momentum[a] + wp.float64(mass * v[a])
            if not wp.isfinite(square):
                broken += wp.float64(1.0)
                if first < wp.float64(0.0):
                    first = wp.float64(i)
        for i in range(block * BLOCK, wp.min((block + 1) * BLOCK, m)):
            s = fields.stress[i]
            stored = energy(p, s)
            current = points[i]
            if wp.static(deformed):
                F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
                J = determinant(F)
                whole = True
                if wp.static(breaks):
                    # Across a crack F is the opening's: it says nothing of stiffness, and may turn over.
                    whole = fields.damage[i][0] < real(BROKEN)
                if wp.static(phased):
                    stored = damaged_energy(p, fields.deformation[i], s, fields.damage[i][0])
                elif wp.static(total):
                    stored = total_energy(p, fields.deformation[i])
                if wp.static(total):
                    if whole and not (real(0.0) < J):
                        current = -current
                elif whole:
                    current *= J
                # Where the Courant number itself does not follow, a bound is enough for what has hardly deformed.
                size = wp.ddot(fields.deformation[i], fields.deformation[i])
                if wp.static(not follows) and size < real(wp.static(SMALL * SMALL)):
                    distortion = wp.max(distortion, wp.float64(real(1.0) / (real(1.0) - wp.sqrt(size))))
                elif whole:
                    shortest = shortening(inverse(F))
                    stretch = wp.max(stretch, wp.float64(shortest * wp.sqrt(J)))
                    distortion = wp.max(distortion, wp.float64(wp.max(shortest, shortening(F))))
            strain += wp.float64(current * stored)
            if wp.static(dissipates):
                dissipated += wp.float64(current * fields.internals[i][last])
            # A maximum drops NaN; a sum keeps it, so the check is on the sum.
            if not (wp.isfinite(stored) and current > real(0.0)):
                broken += wp.float64(1.0)
                if first < wp.float64(0.0):
                    first = wp.float64(i)
        sums_out[block, 0] = kinetic
        sums_out[block, 1] = strain
        sums_out[block, 2] = dissipated
        sums_out[block, 3] = broken
        sums_out[block, 4] = first
        sums_out[block, 5] = stretch
        sums_out[block, 6] = distortion
        for a in range(3):
            sums_out[block, 7 + a] = momentum[a]

    return ledger


class Diagnostics:
    """Sums over one body. `measure(state)` is one launch and one small copy."""

    def __init__(
        self,
        space: Space,
        constitutive: Constitutive,
        volume: np.ndarray,
        points: np.ndarray,
        density: float,
        device: str,
        model: str = "",
        follows: bool = True,
    ):
        """`model` is how the body breaks, where it can; `follows`: its Courant number follows the deformation, to
        rounding."""
        self._model, self._follows = model, follows
        self._space, self._constitutive, self._density, self._device = space, constitutive, density, device
        self._volume = wp.array(volume, dtype=space.scalar, device=device)
        self._points = self._volume if points is volume else wp.array(points, dtype=space.scalar, device=device)
        self._n, self._m = len(volume), len(points)
        self._sums = wp.zeros((-(-max(self._n, self._m) // BLOCK), 10), dtype=wp.float64, device=device)

    def kernel(self, state: State) -> wp.Kernel:
        """The kernel that sums up `state`."""
        return _kernel(self._space, self._constitutive.laws, state.layout, self._model, self._follows)

    def measure(self, state: State) -> BodySums:
        """Sum up a state."""
        wp.launch(self.kernel(state), self._sums.shape[0], device=self._device,
                  inputs=[self._n, self._m, self._constitutive.params, self._space.scalar(self._density), self._volume, self._points, state.struct],
                  outputs=[self._sums])  # fmt: skip
        sums = self._sums.numpy()
        total = sums.sum(0)
        first = sums[sums[:, _NOT_FINITE] > 0, _FIRST]
        return BodySums(
            float(total[_KINETIC]), float(total[_STRAIN]), float(total[_DISSIPATED]),
            total[_MOMENTUM : _MOMENTUM + self._space.dim].copy(),
            int(first[0]) if len(first) else -1,
            float(sums[:, _STRETCH].max()),
            float(sums[:, _DISTORTION].max()),
        )  # fmt: skip
