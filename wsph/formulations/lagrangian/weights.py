"""Weights, means, moments and spreads of the pairs, found once before a run, in double precision whatever the run's.

`wsph.formulations.lagrangian.rates` has the equations.
"""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.tensors import generalized_inverse
from wsph.sph.rows import rows_struct
from wsph.sph.smoothing import SMOOTHING

QUANTA = {"f64": 2.0**-34, "f32": 2.0**-20}
"""Weights of stress points on a regular lattice are whole multiples of this, by precision: the weighted mean of a point's
nodes, which are whole or half numbers of cells, and what lies between are then exact up to 2^18 or 8 cells from the middle.
So the forces of a point sum up to zero, where rounding a mean would add a force of its own, always the same one: momentum
would drift, and with the arm of the body angular momentum. In single precision weights of 0.12 change by up to 3e-5 of
themselves, the smallest, of 3e-4, by 1 %; what is linear stays exact, because moments are those of the weights."""


@cache
def _in_quanta(space: Space) -> wp.Function:
    """Warp function (rows, total, quantum, node, i, weight_out) -> the weighted mean of the nodes of point i, whose weights,
    of sum `total`, it makes whole quanta that sum up to 1."""
    real, vec, Rows = space.scalar, space.vec, rows_struct(space)

    @wp.func
    def in_quanta(
        rows: Rows, total: real, quantum: real, node: wp.array(dtype=vec), i: int, weight_out: wp.array(dtype=real)
    ) -> vec:
        largest = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            weight_out[k] = weight_out[k] / total
            largest = wp.max(largest, weight_out[k])
        largest *= real(1.0 - 1e-9)
        nearest = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            if weight_out[k] >= largest:
                nearest += real(1.0)
        # What rounding leaves goes to the nearest in equal parts, for symmetry.
        part = quantum * nearest
        left = real(1.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            left -= wp.round(weight_out[k] / part) * part
        centre = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            w = wp.round(weight_out[k] / part) * part
            if weight_out[k] >= largest:
                w += left / nearest
            weight_out[k] = w
            centre += w * node[rows.indices[k]]
        return centre

    return in_quanta


@cache
def set_up_kernel(space: Space, smoothing: str, points: bool) -> wp.Kernel:
    """Kernel of weights, means, moments, spreads and ranks of every point's nodes; weights are multiples of `quantum`."""
    real, vec, mat = space.scalar, space.vec, space.mat
    value, slope = SMOOTHING[smoothing](space)
    inverse, in_quanta, Rows = generalized_inverse(space), _in_quanta(space), rows_struct(space)

    @kernel()
    def moments(
        h: real,
        quantum: real,
        rows: Rows,
        cell: wp.array(dtype=vec),
        node_cell: wp.array(dtype=vec),
        node: wp.array(dtype=vec),
        weight_out: wp.array(dtype=real),
        centre_out: wp.array(dtype=vec),
        moment_out: wp.array(dtype=mat),
        spread_out: wp.array(dtype=real),
        rank_out: wp.array(dtype=wp.int32),
    ):
        i = wp.tid()
        total = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            # The kernel is one of grid coordinates: cells of any aspect have the same neighbours.
            q = wp.length(node_cell[rows.indices[k]] - cell[i]) / h
            w = -slope(q)
            if wp.static(points):
                w = value(q)
            weight_out[k] = w
            total += w
        if total <= real(0.0):
            rank_out[i] = -1
            return
        centre = node[i]
        if wp.static(points):
            centre = in_quanta(rows, total, quantum, node, i, weight_out)
        moment = mat()
        spread = real(0.0)
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            w = weight_out[k]
            r = node[rows.indices[k]] - centre
            moment += w * wp.outer(r, r)
            spread += w * wp.dot(r, r)
        b, rank = inverse(moment, real(0.0))
        centre_out[i] = centre
        moment_out[i] = b
        spread_out[i] = spread
        rank_out[i] = rank

    return moments
