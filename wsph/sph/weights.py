"""SPH operators between a source set and a target set, exact on linear fields.

An operator is a weight per pair, computed once for a Lagrangian kernel, and a gather over the pairs:

    interpolation   f_I = sum_J w_IJ f_J,              sum_J w_IJ = 1, sum_J w_IJ (X_J - X_I) = 0
    gradient        (grad f)_I = sum_J (f_J - f_I) g_IJ,   sum_J (X_J - X_I) (x) g_IJ = I

with g_IJ = C_I w_IJ r_IJ, w_IJ = -W'(r)/r Omega_J, r_IJ = X_J - X_I and C_I = (sum_J w_IJ r_IJ (x) r_IJ)^-1 (Randles &
Libersky's normalisation; Herreros & Mabssout 2011, eqs 32-36, with the sign that makes it the gradient). Measured order:
2 in the interior of a lattice, about 1 on a jittered cloud.

Weights are computed in double precision whatever the run's: a set-up cost, and single-precision runs then lose nothing to
cancellation in the corrections.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.tensors import generalized_inverse
from wsph.sph.pairs import Pairs
from wsph.sph.rows import rows_of, rows_struct
from wsph.sph.smoothing import SMOOTHING, SUPPORT


def _interpolation_kernel(space: Space, smoothing: str, module: wp.Module | str) -> wp.Kernel:
    real, vec, mat, Rows = space.scalar, space.vec, space.mat, rows_struct(space)
    value, _ = SMOOTHING[smoothing](space)
    inverse = generalized_inverse(space)

    @kernel(module=module)
    def interpolation(
        rows: Rows,
        targets: wp.array(dtype=vec),
        sources: wp.array(dtype=vec),
        volume: wp.array(dtype=real),
        reach: wp.array(dtype=real),
        linear: int,
        weight_out: wp.array(dtype=real),
        rank_out: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        h = reach[i] / real(SUPPORT)
        total = real(0.0)
        mean = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            r = sources[rows.indices[k]] - targets[i]
            w = value(wp.length(r) / h) * volume[rows.indices[k]]
            weight_out[k] = w
            total += w
            mean += w * r
        if total <= real(0.0):
            rank_out[i] = -1
            return
        mean = mean / total
        spread = mat()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            d = sources[rows.indices[k]] - targets[i] - mean
            spread += weight_out[k] / total * wp.outer(d, d)
        # One source alone spans nothing: its distance from the mean is a rounding of the support.
        pinv, rank = inverse(spread, reach[i] * reach[i])
        tilt = pinv * mean
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            w = weight_out[k] / total
            if linear != 0:
                d = sources[rows.indices[k]] - targets[i] - mean
                w = w * (real(1.0) - wp.dot(tilt, d))
            weight_out[k] = w
        rank_out[i] = rank

    return interpolation


def _gradient_kernel(space: Space, smoothing: str, module: wp.Module | str) -> wp.Kernel:
    real, vec, mat, dim, Rows = space.scalar, space.vec, space.mat, space.dim, rows_struct(space)
    _, slope = SMOOTHING[smoothing](space)
    inverse = generalized_inverse(space)

    @kernel(module=module)
    def gradient(
        rows: Rows,
        targets: wp.array(dtype=vec),
        sources: wp.array(dtype=vec),
        volume: wp.array(dtype=real),
        reach: wp.array(dtype=real),
        weight_out: wp.array(dtype=vec),
        rank_out: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        h = reach[i] / real(SUPPORT)
        moment = mat()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            r = sources[rows.indices[k]] - targets[i]
            moment += -slope(wp.length(r) / h) * volume[rows.indices[k]] * wp.outer(r, r)
        correction, rank = inverse(moment, real(0.0))
        if rank < dim:
            # Too few directions for the full correction (a corner that sees one particle): each axis by itself.
            correction = mat()
            for a in range(wp.static(dim)):
                if moment[a, a] > real(0.0):
                    correction[a, a] = real(1.0) / moment[a, a]
                else:
                    rank = -1
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            r = sources[rows.indices[k]] - targets[i]
            weight_out[k] = -slope(wp.length(r) / h) * volume[rows.indices[k]] * (correction * r)
        rank_out[i] = rank

    return gradient


_together: set[tuple[Space, str]] = set()
"""Of which interpolation and gradients are asked for."""


@cache
def _weight_kernels(space: Space, smoothing: str) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels of interpolation and of gradient weights, together: they are in one module."""
    _together.add((space, smoothing))
    module = space.module(f"weights.{smoothing}")
    return _interpolation_kernel(space, smoothing, module), _gradient_kernel(space, smoothing, module)


@cache
def _alone(space: Space, smoothing: str) -> wp.Kernel:
    return _interpolation_kernel(space, smoothing, "unique")


def _interpolating(space: Space, smoothing: str) -> wp.Kernel:
    """The kernel of interpolation weights: by itself where nobody has asked for gradients, which halves the compiling."""
    if (space, smoothing) in _together:
        return _weight_kernels(space, smoothing)[0]
    return _alone(space, smoothing)


@dataclass(frozen=True)
class Weights:
    """Weights of one operator: `values` per pair (scalars, or vectors of dim), `rank` per target.

    rank (targets,) int32: number of directions that the neighbours span; below dim an interpolation is constant in the
    rest and a gradient falls back to each axis by itself; -1 where there is nothing to work with.
    """

    pairs: Pairs
    values: Array
    rank: np.ndarray

    def mapped(self, space: Space, linear: np.ndarray) -> "Weights":
        """Gradient weights turned and stretched by `linear` (dim, dim)."""
        values = self.values.numpy().astype(np.float64) @ linear.T
        return replace(self, values=wp.array(values, dtype=space.vec, device=self.values.device))

    def between(self, targets: slice, sources: slice) -> "Weights":
        """Those of the pairs of some targets with some sources, both from one up to another."""
        pairs, where = self.pairs.between(targets, sources)
        values = wp.array(self.values.numpy()[where], dtype=self.values.dtype, device=self.values.device)
        return Weights(pairs, values, self.rank[targets])


def _found(
    kernel: wp.Kernel, of: type, pairs: Pairs, points: tuple[np.ndarray, np.ndarray], volume: np.ndarray, *settings: int
) -> tuple[np.ndarray, np.ndarray]:
    """Weights of pairs, numbers or vectors as `of` says, in double precision, and ranks. `points` = (targets, sources)."""
    space, device = Space(points[0].shape[1]), pairs.offsets.device
    weight = wp.zeros(pairs.count, dtype=of, device=device)
    rank = wp.zeros(pairs.targets, dtype=wp.int32, device=device)
    places = [wp.array(np.ascontiguousarray(p), dtype=space.vec, device=device) for p in points]
    volumes = wp.array(volume, dtype=wp.float64, device=device)
    inputs = [rows_of(space, pairs), *places, volumes, pairs.reach, *settings]
    wp.launch(kernel, pairs.targets, inputs=inputs, outputs=[weight, rank], device=device)
    return weight.numpy(), rank.numpy()


def interpolation_weights(
    space: Space,
    pairs: Pairs,
    targets: np.ndarray,
    sources: np.ndarray,
    volume: np.ndarray,
    smoothing: str = "cubic-spline",
    order: str = "linear",
) -> Weights:
    """Weights w_IJ of an interpolation: order "linear" (moving least squares) or "constant" (Shepard).

    targets (n, dim), sources (m, dim), volume (m,) in the unit of `pairs.reach`; any constant factor of the volumes
    cancels. Rank 0 and above only: where a target has no source in its support, rank is -1 and its weights are zero.
    """
    if order not in ("linear", "constant"):
        raise ValueError(f"order {order!r} is neither 'linear' nor 'constant'")
    made = _interpolating(Space(space.dim), smoothing)
    values, rank = _found(made, wp.float64, pairs, (targets, sources), volume, int(order == "linear"))
    return Weights(pairs, wp.array(values, dtype=space.scalar, device=pairs.offsets.device), rank)


def gradient_weights(
    space: Space,
    pairs: Pairs,
    targets: np.ndarray,
    sources: np.ndarray,
    volume: np.ndarray,
    smoothing: str = "cubic-spline",
) -> Weights:
    """Weights g_IJ of the corrected gradient, vectors of dim. Arguments as in `interpolation_weights`."""
    double = Space(space.dim)
    values, rank = _found(_weight_kernels(double, smoothing)[1], double.vec, pairs, (targets, sources), volume)
    return Weights(pairs, wp.array(values, dtype=space.vec, device=pairs.offsets.device), rank)
