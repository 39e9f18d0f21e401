"""What particles remember of the motion that their gradients do not see.

A gradient does not see fields with sum w (v_j - v_i) (x) r = 0, among them every sawtooth, so that no stress would answer
them. Where pairs follow the motion there is no reference configuration to measure displacements from. So every particle
keeps one vector, the deviation d_i of the neighbours from the linear field that its gradient says:

    S_i = sum w,   c_i = sum w r,   e_i = (sum w (v_j - v_i) - L_i c_i)/S_i,   D_i = F_i^-1 d_i,   dD_i/dt = F_i^-1 e_i
    k_i = alpha E V_0i/spacing^2,   q_i = k_i d_i/S_i,   energy sum k_i |d_i|^2/2

What is remembered stands still while the body is turned, by any angle, and stretched: d' = e + L d, as the deviation of the
lattice of a Lagrangian form goes. The forces are the dual of that, so that they do the work of the energy:

    f_i = sum_j w ((A_i + A_j) r + q_i - q_j),   A_i = V_i sigma_i M_i + k_i d_i (x) d_i M_i - q_i (x) M_i c_i

e vanishes for every linear field: patch tests, momentum and angular momentum are as without. By the maximum principle it
vanishes everywhere for those alone, so that no other motion is free.
"""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.parts.terms import points_struct


@cache
def memory_struct(space: Space) -> type:
    """Struct of what particles remember: `pull` (n,) vec, the forces q_i over the weights of pairs."""
    annotations = {"pull": wp.array(dtype=space.vec)}
    return wp.struct(type("Memory", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def remembered(space: Space) -> wp.Function:
    """Warp function (spring, F, D, total, middle, M) -> (q_i, what A_i takes of it), from k_i, S_i and c_i."""
    real, vec, mat = space.scalar, space.vec, space.mat

    @wp.func
    def recall(spring: real, F: mat, deviation: vec, total: real, middle: vec, M: mat):
        d = F * deviation
        pull = vec()
        if total > real(0.0):
            pull = (spring / total) * d
        return pull, (wp.outer(spring * d, d) - wp.outer(pull, middle)) * M

    return recall


def remembered_energy_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Partial sums of the energy sum k_i |d_i|^2/2 over blocks of particles."""
    real, dim, Fields, Points = space.scalar, space.dim, fields_struct(space, layout), points_struct(space)

    @kernel()
    def remembered_energy(low: int, end: int, points: Points, fields: Fields, energy_out: wp.array(dtype=wp.float64)):
        block = wp.tid()
        total = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            d = (wp.identity(n=dim, dtype=real) + fields.deformation[i]) * fields.deviation[i]
            total += wp.float64(real(0.5) * points.stabilisation * points.volume[i] * wp.dot(d, d))
        energy_out[block] = total

    return remembered_energy
