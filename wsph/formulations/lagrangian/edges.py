"""Pairs along the edges of the cells: weights with which the faces of a lattice get exactly what they are due.

Forces f_i = -sum_p V_p P_p g_pi are in equilibrium with a uniform stress P only where b_i = sum_p V_p g_pi equals what the
faces hand their particles, the sum of A n over the faces at i, and zero inside: the discrete divergence theorem. Kernels
with a radius miss it beside every face, by a part that no refinement changes. Particles on the faces whose pairs are the
edges of the cells, with

    w_ij = n_ij V_c/(2^(dim-1) h^2)       n_ij cells of the body around the edge, h its length, V_c the volume of a cell

meet it to rounding for every union of cells, in any dimension: sum_j w r (x) r = 2 V_i I, so that V_i times the derivative
along an axis is the sum over the edges at i of n_ij V_c/2^dim times the difference quotient; in the sum over i every edge
counts twice, which is the sum over the cells of the mean of their parallel edges: what the cell's two faces get by the
trapezoidal rule. Neighbouring cells cancel. The same weights come from d-linear finite elements with quadrature at the
corners and gradients averaged in the nodes.

Gradients and stresses are then averaged once more over the same edges, A_p + a/V_p sum_q w h^2 (A_q - A_p): with a = 1/12
that takes the trapezoidal rule's error out of bending, n^2/(n^2 - 1) in a beam of n rows of cells, and it keeps linear
fields, the sums over the faces, and the symmetry that makes forces the gradient of an energy. No node's own part falls below
1 - 2 dim a.

On lattices whose cells differ no weights meet the theorem; there the gradient of a particle is that of the cells around it
(`wsph.geometry.gradients`), a vector a pair, which does on any cells, and nothing is averaged.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import numpy as np
import warp as wp

from wsph.formulations.lagrangian.set_up import Reference
from wsph.geometry.edges import cell_edges
from wsph.geometry.gradients import NodalGradients
from wsph.parts.part import Host
from wsph.sph.pairs import Pairs


def edge_reference(host: Host, gradients: NodalGradients | None, device: str) -> Reference:
    """Pairs along the edges, weights, places and moments of a lattice with particles at its nodes. Where cells differ, pairs
    are those of `gradients`, of nodes that share a cell, and their weights, which hold the misfit of a linear field, are
    zero but along the edges."""
    lattice, dim, n = host.lattice, host.space.dim, len(host.lattice.nodes)
    place, edges = lattice.places(host.scales.length), cell_edges(lattice.corners, n)
    along = place[edges.end] - place[edges.start]
    cell = lattice.mean_volume / host.scales.length**dim
    weight = edges.cells * (cell / 2.0 ** (dim - 1)) / np.einsum("ea,ea->e", along, along)
    start, end = edges.start, edges.end
    if gradients is not None:
        at = np.searchsorted(gradients.start * n + gradients.end, start.astype(np.int64) * n + end)
        start, end = gradients.start, gradients.end
        whole = np.zeros(len(start))
        whole[at] = weight
        weight, along = whole, place[end] - place[start]
    moment = np.zeros((n, dim, dim))
    for a in range(dim):
        for b in range(dim):
            moment[:, a, b] = np.bincount(start, weight * along[:, a] * along[:, b], n)
    spread = np.einsum("naa->n", moment)
    inverse = np.linalg.inv(moment) if gradients is None else np.eye(dim) / gradients.volume[:, None, None]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(start, minlength=n))])
    ends, others = (wp.array(each, dtype=wp.int32, device=device) for each in (offsets, end))
    reach = wp.array(np.ones(n), dtype=wp.float64, device=device)
    pairs = Pairs(ends, others, n, n, reach)
    return Reference(pairs, weight, place, place, inverse, spread, np.full(n, dim), gradients)
