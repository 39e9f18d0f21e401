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

from wsph.contiguous import element
from wsph.neighbours import Pairs, find_pairs
from wsph.particles import Lattice
from wsph.smoothing import SMOOTHING, SUPPORT
from wsph.space import Space

# A pivot this far below the largest belongs to a direction that the neighbours do not span.
SINGULAR = 1e-9


@cache
def generalized_inverse(space: Space) -> wp.Function:
    """Warp function: (A, dim x dim symmetric, semidefinite, size) -> (inverse on the directions that A spans, rank).

    `size` is what entries of A are compared with, beside its own largest: below SINGULAR of both they are rounding. Sweeps
    with diagonal pivoting; directions whose pivot vanishes get a zero row and column.
    """
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat

    @wp.func
    def inverse(a: mat, size: real):
        b = a
        largest = size
        for k in range(wp.static(dim)):
            largest = wp.max(largest, a[k, k])
        swept = vec()
        rank = int(0)
        for _ in range(wp.static(dim)):
            pivot = int(-1)
            best = largest * real(SINGULAR)
            for k in range(wp.static(dim)):
                if swept[k] == real(0.0) and b[k, k] > best:
                    best = b[k, k]
                    pivot = k
            if pivot >= 0:
                p = b[pivot, pivot]
                c = b
                for i in range(wp.static(dim)):
                    for j in range(wp.static(dim)):
                        if i != pivot and j != pivot:
                            c[i, j] = b[i, j] - b[i, pivot] * b[pivot, j] / p
                        elif i == pivot and j == pivot:
                            c[i, j] = real(-1.0) / p
                        else:
                            c[i, j] = b[i, j] / p
                b = c
                swept[pivot] = real(1.0)
                rank += 1
        result = mat()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                if swept[i] != real(0.0) and swept[j] != real(0.0):
                    result[i, j] = -b[i, j]
        return result, rank

    return inverse


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


@cache
def misfit(space: Space) -> wp.Function:
    """Warp function (i, u, centre, H, offsets, indices, weight, node, displacement) -> sum of w |e|^2 over the pairs of i:
    what a linear field of gradient H, u at the centre, leaves of the displacements."""
    real, vec, mat, at = space.scalar, space.vec, space.mat, element(wp.int32, space.scalar, space.vec)

    @wp.func
    def left_over(i: int, u: vec, centre: vec, H: mat, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32),
                  weight: wp.array(dtype=real), node: wp.array(dtype=vec), displacement: wp.array(dtype=vec)) -> real:  # fmt: skip
        square = real(0.0)
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            e = at(displacement, j) - u - H * (at(node, j) - centre)
            square = square + at(weight, k) * wp.dot(e, e)
            k += 1
        return square

    return left_over


def average(weights: Weights, values: np.ndarray) -> np.ndarray:
    """Interpolate `values` (sources, k) on the host, (targets, k)."""
    indices, w, row = weights.pairs.indices.numpy(), weights.values.numpy(), weights.pairs.rows()
    return np.stack(
        [np.bincount(row, w * values[indices, c], weights.pairs.targets) for c in range(values.shape[1])], 1
    )


def unparted(pairs: Pairs, lattice: Lattice, targets: np.ndarray, sources: np.ndarray) -> Pairs:
    """The pairs that no crack parts. `targets` (n, dim) and `sources` (m, dim) in grid coordinates, each on its side."""
    if not lattice.cracks:
        return pairs
    return pairs.where(~lattice.apart(targets[pairs.rows()], sources[pairs.indices.numpy()]))


def spanning_weights(lattice: Lattice, support: float, points: tuple[np.ndarray, np.ndarray],
                     sided: tuple[np.ndarray, np.ndarray], volume: np.ndarray) -> Weights:  # fmt: skip
    """Linear-exact interpolation for output, `points` = (targets, sources) in cells: a target looks further than `support`
    until its sources span every direction. `sided`: the same in grid coordinates, each on its side of a crack."""
    targets, sources = points
    reach = np.full(len(targets), support)
    dim = sources.shape[1]
    while True:
        pairs = unparted(find_pairs(targets, sources, reach, "cpu"), lattice, *sided)
        weights = interpolation_weights(Space(dim), pairs, targets, sources, volume)
        narrow = weights.rank < dim
        if not narrow.any() or reach.max() > 6.0:
            return weights
        reach[narrow] *= 1.5


def outward_weights(lattice: Lattice, support: float) -> Weights:
    """Interpolation from cells to nodes that extrapolates linearly to faces: for output. `support` in cells."""
    return spanning_weights(lattice, support, lattice.centred, lattice.sided, lattice.cell_volume)


@cache
def _apply_kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    real, vec = space.scalar, space.vec
    dim = space.dim
    module = space.module("apply")

    @wp.kernel(module=module, enable_backward=False)
    def interpolate(offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                    field: wp.array2d(dtype=real), field_out: wp.array2d(dtype=real)):  # fmt: skip
        i, c = wp.tid()
        total = real(0.0)
        for k in range(offsets[i], offsets[i + 1]):
            total += weight[k] * field[indices[k], c]
        field_out[i, c] = total

    @wp.kernel(module=module, enable_backward=False)
    def gradient(offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=vec),
                 field: wp.array2d(dtype=real), at: wp.array2d(dtype=real), gradient_out: wp.array3d(dtype=real)):  # fmt: skip
        i, c = wp.tid()
        total = vec()
        for k in range(offsets[i], offsets[i + 1]):
            total += (field[indices[k], c] - at[i, c]) * weight[k]
        for a in range(wp.static(dim)):
            gradient_out[i, c, a] = total[a]

    @wp.kernel(module=module, enable_backward=False)
    def divergence(offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=vec),
                   field: wp.array3d(dtype=real), at: wp.array3d(dtype=real), divergence_out: wp.array2d(dtype=real)):  # fmt: skip
        i, c = wp.tid()
        total = real(0.0)
        for k in range(offsets[i], offsets[i + 1]):
            for a in range(wp.static(dim)):
                total += (field[indices[k], c, a] - at[i, c, a]) * weight[k][a]
        divergence_out[i, c] = total

    return interpolate, gradient, divergence


def interpolate(space: Space, weights: Weights, field: wp.array, out: wp.array) -> None:
    """out (n, k) = the interpolation of `field` (m, k)."""
    pairs = weights.pairs
    wp.launch(_apply_kernels(space)[0], (pairs.targets, field.shape[1]), device=field.device,
              inputs=[pairs.offsets, pairs.indices, weights.values, field], outputs=[out])  # fmt: skip


def gradient(space: Space, weights: Weights, field: wp.array, at: wp.array, out: wp.array) -> None:
    """out (n, k, dim) = the gradient of `field` (m, k), whose values at the targets are `at` (n, k)."""
    pairs = weights.pairs
    wp.launch(_apply_kernels(space)[1], (pairs.targets, field.shape[1]), device=field.device,
              inputs=[pairs.offsets, pairs.indices, weights.values, field, at], outputs=[out])  # fmt: skip


def divergence(space: Space, weights: Weights, field: wp.array, at: wp.array, out: wp.array) -> None:
    """out (n, k) = the divergence of `field` (m, k, dim), whose values at the targets are `at` (n, k, dim)."""
    pairs = weights.pairs
    wp.launch(_apply_kernels(space)[2], (pairs.targets, field.shape[1]), device=field.device,
              inputs=[pairs.offsets, pairs.indices, weights.values, field, at], outputs=[out])  # fmt: skip
