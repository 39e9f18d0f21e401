"""Points that see the corners of their own cells and nothing else: what stress points do, unless a scene names a kernel.

With k corners, w = 1/k, Xbar_p their mean, and as the gradient of a point the mean of the multilinear field's over its cell,

    V_p g_pj = integral over the cell of grad N_j,   H_p = sum_j u_j (x) g_pj

(Flanagan & Belytschko 1981: the cell of uniform gradient, whose hourglass control is the residual here). On the cells of a
grid g_pj = w M_p r_j, the weights' own gradient, to rounding: there weights are scalars, as with a kernel of up to 1.5
spacings. Elsewhere g_pj are vectors, since no scalars meet the three conditions of the linear patch test,

    sum_j g_pj = 0,   sum_j g_pj (x) X_j = I,   sum_p V_p g_pj = integral over the surface of N_j n,

of which weights of a kernel miss the third on every cell that is no box: the forces of a uniform stress are then 20 to 60 %
off at nodes inside. Vectors are whole multiples of a quantum, as weights are, so that those of a point sum up to zero
exactly, and its forces keep momentum in single precision too.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np
import warp as wp

from wsph.formulations.lagrangian.set_up import Reference
from wsph.geometry.gradients import PointRows
from wsph.geometry.lattice import Lattice
from wsph.parts.part import Host
from wsph.sph.pairs import Pairs

QUANTA = {"f64": 2.0**-48, "f32": 2.0**-21}
"""Vectors are whole multiples of this part of the largest power of two below the largest of their point, by precision."""


def corner_reference(host: Host, device: str, points: np.ndarray | None = None) -> Reference:
    """Pairs from points to the corners of their cells, weights, places and moments, or vectors in place of these; of some
    `points` (k,) alone, where these have vectors."""
    body, length, dim = host.geometry, host.scales.length, host.space.dim
    rows = body.rows if points is None else body.rows.taken(points)
    many = np.diff(rows.offsets)
    m, n = len(many), len(body.nodes)
    weight = np.repeat(1.0 / many, many)
    if rows.slope is None and isinstance(body, Lattice):
        place, centre, moment, spread = _of_boxes(body, length)
        slope = None
    else:
        place = body.places(length)
        centre = np.add.reduceat(weight[:, None] * place[rows.indices], rows.offsets[:-1])
        apart = place[rows.indices] - np.repeat(centre, many, axis=0)
        spread = np.add.reduceat(weight * np.einsum("ea,ea->e", apart, apart), rows.offsets[:-1])
        if rows.held is not None:
            # Without a spread a point has no share in the residual.
            spread = np.where(rows.held, spread, np.inf)
        volume = (body.cell_volume if points is None else body.cell_volume[points]) / length**dim
        moment = np.eye(dim) / volume[:, None, None]
        slope = _in_quanta(rows, length ** (1 - dim), QUANTA[host.space.precision])
    ends, others = (wp.array(each, dtype=wp.int32, device=device) for each in (rows.offsets, rows.indices))
    reach = wp.array(np.ones(m), dtype=wp.float64, device=device)
    pairs = Pairs(ends, others, m, n, reach)
    return Reference(pairs, weight, place, centre, moment, spread, np.full(m, dim), None, slope)


def _of_boxes(body: Lattice, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, dim), centres, moments and spreads of the cells of a grid."""
    steps, axes, m = body.steps(length), body.frame.axes, len(body.cell_volume)
    nodes, cells = body.centred
    moment = axes @ np.diag(4.0 / steps**2) @ axes.T
    whole = np.broadcast_to(0.5 * (moment + moment.T), (m, *moment.shape))
    return nodes * steps @ axes.T, cells * steps @ axes.T, whole, np.full(m, 0.25 * (steps**2).sum())


def _in_quanta(rows: PointRows, scale: float, quantum: float) -> np.ndarray:
    """The vectors of all points times `scale`, (pairs, dim), of which each point's sum up to zero exactly."""
    if rows.slope is None:
        raise TypeError("points of a regular lattice have no vectors of their own")
    slope = scale * rows.slope
    starts, many = rows.offsets[:-1], np.diff(rows.offsets)
    largest = np.maximum.reduceat(np.abs(slope).max(1), starts)
    part = np.repeat(quantum * 2.0 ** np.floor(np.log2(largest)), many)[:, None]
    whole = np.rint(slope / part)
    left = np.add.reduceat(whole, starts)
    # What rounding leaves goes to the largest, a quantum or two of it.
    size = np.abs(whole).max(1)
    top = np.flatnonzero(size == np.repeat(np.maximum.reduceat(size, starts), many))
    first = top[np.searchsorted(top, starts)]
    whole[first] -= left
    return whole * part
