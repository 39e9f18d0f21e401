"""Rates of stress and internals of a rate law at the cells of a lattice."""

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.evolution import evolution
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.cell import cell_struct
from wsph.formulations.lattice.lanes import block_of, capacity_of, corner_sums, lane_matrix


def flow_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Kernel of the rates, from the velocities of the corners."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Params, internal, evolve, Cell = laws.Params, laws.internal, evolution(space, laws), cell_struct(space)
    kept, inverse, size = "internals" in layout, determinant_and_inverse(space)[1], dim**2 * capacity_of(width)
    block, gather, get = block_of(dim, width), corner_sums(space, width, False), lane_matrix(space, width)[0]

    @kernel(ranged=True, lanes=True)
    def flow(
        first: int,
        clock: wp.array(dtype=wp.float64),
        ahead: real,
        p: Params,
        cell: Cell,
        blocks: wp.array(dtype=wp.int32),
        fields: Fields,
        rate_out: Fields,
    ):
        b, i, lane, rows, own = block(blocks, first + wp.tid())
        dt = ahead * real(dt_of(clock))
        values = wp.zeros(shape=size, dtype=real)
        gather(blocks, b, lane, rows, fields.velocity, values)
        e = int(0)
        while e < own:
            change = get(values, e) * cell.gradient
            later = wp.identity(n=dim, dtype=real) + fields.deformation[i + e] + dt * change
            q = internal()
            if wp.static(kept):
                q = fields.internals[i + e]
            ds, dq = evolve(p, fields.stress[i + e], q, later, change * inverse(later), dt)
            rate_out.stress[i + e] = ds
            if wp.static(kept):
                rate_out.internals[i + e] = dq
            e += 1

    return flow
