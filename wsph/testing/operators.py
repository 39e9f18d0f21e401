"""Operators applied to fields, one at a time."""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.sph.rows import rows_of, rows_struct
from wsph.sph.weights import Weights


@cache
def _apply_kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    real, vec, dim = space.scalar, space.vec, space.dim
    Rows, VectorRows = rows_struct(space), rows_struct(space, vectors=True)
    module = space.module("apply")

    @kernel(module=module)
    def interpolate(rows: Rows, field: wp.array2d(dtype=real), field_out: wp.array2d(dtype=real)):
        i, c = wp.tid()
        total = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            total += rows.weight[k] * field[rows.indices[k], c]
        field_out[i, c] = total

    @kernel(module=module)
    def gradient(
        rows: VectorRows,
        field: wp.array2d(dtype=real),
        at: wp.array2d(dtype=real),
        gradient_out: wp.array3d(dtype=real),
    ):
        i, c = wp.tid()
        total = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            total += (field[rows.indices[k], c] - at[i, c]) * rows.weight[k]
        for a in range(wp.static(dim)):
            gradient_out[i, c, a] = total[a]

    @kernel(module=module)
    def divergence(
        rows: VectorRows,
        field: wp.array3d(dtype=real),
        at: wp.array3d(dtype=real),
        divergence_out: wp.array2d(dtype=real),
    ):
        i, c = wp.tid()
        total = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            for a in range(wp.static(dim)):
                total += (field[rows.indices[k], c, a] - at[i, c, a]) * rows.weight[k][a]
        divergence_out[i, c] = total

    return interpolate, gradient, divergence


def _launch(made: wp.Kernel, space: Space, weights: Weights, arrays: list[wp.array], out: wp.array) -> None:
    rows, threads = rows_of(space, weights.pairs, weights.values), (weights.pairs.targets, arrays[0].shape[1])
    wp.launch(made, threads, inputs=[rows, *arrays], outputs=[out], device=out.device)


def interpolate(space: Space, weights: Weights, field: wp.array, out: wp.array) -> None:
    """out (n, k) = the interpolation of `field` (m, k)."""
    _launch(_apply_kernels(space)[0], space, weights, [field], out)


def gradient(space: Space, weights: Weights, field: wp.array, at: wp.array, out: wp.array) -> None:
    """out (n, k, dim) = the gradient of `field` (m, k), whose values at the targets are `at` (n, k)."""
    _launch(_apply_kernels(space)[1], space, weights, [field, at], out)


def divergence(space: Space, weights: Weights, field: wp.array, at: wp.array, out: wp.array) -> None:
    """out (n, k) = the divergence of `field` (m, k, dim), whose values at the targets are `at` (n, k, dim)."""
    _launch(_apply_kernels(space)[2], space, weights, [field, at], out)
