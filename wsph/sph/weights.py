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

from wsph.backend.space import Space
from wsph.backend.tensors import generalized_inverse
from wsph.sph.pairs import Pairs
from wsph.sph.smoothing import SMOOTHING, SUPPORT


@cache
def _weight_kernels(space: Space, smoothing: str) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat = space.scalar, space.vec, space.mat
    value, slope = SMOOTHING[smoothing](space)
    inverse = generalized_inverse(space)
    dim = space.dim
    module = space.module(f"weights.{smoothing}")

    @wp.kernel(module=module, enable_backward=False)
    def interpolation(reach: wp.array(dtype=real), linear: int, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                      targets: wp.array(dtype=vec), sources: wp.array(dtype=vec), volume: wp.array(dtype=real),
                      weight_out: wp.array(dtype=real), rank_out: wp.array(dtype=wp.int32)):  # fmt: skip
        i = wp.tid()
        h = reach[i] / real(SUPPORT)
        total = real(0.0)
        mean = vec()
        for k in range(offsets[i], offsets[i + 1]):
            r = sources[indices[k]] - targets[i]
            w = value(wp.length(r) / h) * volume[indices[k]]
            weight_out[k] = w
            total += w
            mean += w * r
        if total <= real(0.0):
            rank_out[i] = -1
            return
        mean = mean / total
        spread = mat()
        for k in range(offsets[i], offsets[i + 1]):
            d = sources[indices[k]] - targets[i] - mean
            spread += weight_out[k] / total * wp.outer(d, d)
        # One source alone spans nothing: its distance from the mean is a rounding of the support.
        pinv, rank = inverse(spread, reach[i] * reach[i])
        tilt = pinv * mean
        for k in range(offsets[i], offsets[i + 1]):
            w = weight_out[k] / total
            if linear != 0:
                d = sources[indices[k]] - targets[i] - mean
                w = w * (real(1.0) - wp.dot(tilt, d))
            weight_out[k] = w
        rank_out[i] = rank

    @wp.kernel(module=module, enable_backward=False)
    def gradient(reach: wp.array(dtype=real), offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                 targets: wp.array(dtype=vec), sources: wp.array(dtype=vec), volume: wp.array(dtype=real),
                 weight_out: wp.array(dtype=vec), rank_out: wp.array(dtype=wp.int32)):  # fmt: skip
        i = wp.tid()
        h = reach[i] / real(SUPPORT)
        moment = mat()
        for k in range(offsets[i], offsets[i + 1]):
            r = sources[indices[k]] - targets[i]
            moment += -slope(wp.length(r) / h) * volume[indices[k]] * wp.outer(r, r)
        correction, rank = inverse(moment, real(0.0))
        if rank < dim:
            # Too few directions for the full correction (a corner that sees one particle): each axis by itself.
            correction = mat()
            for a in range(wp.static(dim)):
                if moment[a, a] > real(0.0):
                    correction[a, a] = real(1.0) / moment[a, a]
                else:
                    rank = -1
        for k in range(offsets[i], offsets[i + 1]):
            r = sources[indices[k]] - targets[i]
            weight_out[k] = -slope(wp.length(r) / h) * volume[indices[k]] * (correction * r)
        rank_out[i] = rank

    return interpolation, gradient


@dataclass(frozen=True)
class Weights:
    """Weights of one operator: `values` per pair (scalars, or vectors of dim), `rank` per target.

    rank (targets,) int32: number of directions that the neighbours span; below dim an interpolation is constant in the
    rest and a gradient falls back to each axis by itself; -1 where there is nothing to work with.
    """

    pairs: Pairs
    values: wp.array
    rank: np.ndarray

    def mapped(self, space: Space, linear: np.ndarray) -> "Weights":
        """Gradient weights turned and stretched by `linear` (dim, dim)."""
        values = self.values.numpy().astype(np.float64) @ linear.T
        return replace(self, values=wp.array(values, dtype=space.vec, device=self.values.device))


def _vectors(points: np.ndarray, space: Space, device: str) -> wp.array:
    return wp.array(np.ascontiguousarray(points), dtype=space.vec, device=device)


def _double(space: Space) -> Space:
    return Space(space.dim)


def interpolation_weights(space: Space, pairs: Pairs, targets: np.ndarray, sources: np.ndarray, volume: np.ndarray,
                          smoothing: str = "cubic-spline", order: str = "linear") -> Weights:  # fmt: skip
    """Weights w_IJ of an interpolation: order "linear" (moving least squares) or "constant" (Shepard).

    targets (n, dim), sources (m, dim), volume (m,) in the unit of `pairs.reach`; any constant factor of the volumes
    cancels. Rank 0 and above only: where a target has no source in its support, rank is -1 and its weights are zero.
    """
    if order not in ("linear", "constant"):
        raise ValueError(f"order {order!r} is neither 'linear' nor 'constant'")
    double, device = _double(space), pairs.offsets.device
    weight = wp.zeros(pairs.count, dtype=wp.float64, device=device)
    rank = wp.zeros(pairs.targets, dtype=wp.int32, device=device)
    wp.launch(_weight_kernels(double, smoothing)[0], pairs.targets, device=device,
              inputs=[pairs.reach, int(order == "linear"), pairs.offsets, pairs.indices,
                      _vectors(targets, double, device), _vectors(sources, double, device),
                      wp.array(volume, dtype=wp.float64, device=device)],
              outputs=[weight, rank])  # fmt: skip
    return Weights(pairs, wp.array(weight.numpy(), dtype=space.scalar, device=device), rank.numpy())


def gradient_weights(space: Space, pairs: Pairs, targets: np.ndarray, sources: np.ndarray, volume: np.ndarray,
                     smoothing: str = "cubic-spline") -> Weights:  # fmt: skip
    """Weights g_IJ of the corrected gradient, vectors of dim. Arguments as in `interpolation_weights`."""
    double, device = _double(space), pairs.offsets.device
    weight = wp.zeros(pairs.count, dtype=double.vec, device=device)
    rank = wp.zeros(pairs.targets, dtype=wp.int32, device=device)
    wp.launch(_weight_kernels(double, smoothing)[1], pairs.targets, device=device,
              inputs=[pairs.reach, pairs.offsets, pairs.indices,
                      _vectors(targets, double, device), _vectors(sources, double, device),
                      wp.array(volume, dtype=wp.float64, device=device)],
              outputs=[weight, rank])  # fmt: skip
    return Weights(pairs, wp.array(weight.numpy(), dtype=space.vec, device=device), rank.numpy())
