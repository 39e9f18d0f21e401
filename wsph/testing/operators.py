"""Operators applied to fields, one at a time."""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.sph.weights import Weights


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
