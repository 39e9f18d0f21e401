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
from wsph.formulations.lattice.lanes import beside, block_of, capacity_of, corner_sums, field_lanes


def flow_kernel(space: Space, laws: Laws, own: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Kernel of the rates, from the velocities of the corners."""
    real, dim, Fields, Params, Cell = (
        space.scalar,
        space.dim,
        fields_struct(space, layout),
        laws.Params,
        cell_struct(space),
    )
    kept, size, law_dim = "internals" in layout, dim**2 * capacity_of(width), own.space.dim
    stresses, memories = laws.stress._length_ * capacity_of(width), laws.internal._length_ * capacity_of(width)
    block, gather, by_row = block_of(dim, width), corner_sums(space, width, False), beside(space, laws, own, width)
    evolve, inverse, seen = evolution(own.space, own), determinant_and_inverse(own.space)[1], by_row.widened
    get, (get_stress, put_stress), (get_memory, put_memory) = by_row.matrix[0], by_row.stress, by_row.memory
    read_mat, (read_stress, write_stress), (read_memory, write_memory) = (
        field_lanes(space, width, space.mat)[0],
        field_lanes(space, width, laws.stress),
        field_lanes(space, width, laws.internal),
    )

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
        b, i, at, rows, many = block(blocks, first + wp.tid())
        dt = ahead * real(dt_of(clock))
        values = wp.zeros(shape=size, dtype=real)
        deformation = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        gather(blocks, b, at, rows, fields.velocity, values)
        read_mat(fields.deformation, i, many, deformation)
        read_stress(fields.stress, i, many, stress)
        if wp.static(kept):
            read_memory(fields.internals, i, many, memory)
        gradient = seen(cell.gradient)
        e = int(0)
        while e < many:
            change = get(values, e) * gradient
            later = wp.identity(n=law_dim, dtype=real) + get(deformation, e) + dt * change
            L = change * inverse(later)
            ds, dq = evolve(p, get_stress(stress, e), get_memory(memory, e), later, L, dt)
            put_stress(stress, e, ds)
            put_memory(memory, e, dq)
            e += 1
        write_stress(stress, i, many, rate_out.stress)
        if wp.static(kept):
            write_memory(memory, i, many, rate_out.internals)

    return flow
