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
from wsph.formulations.lattice.lanes import block_of, capacity_of, corner_sums, field_lanes, lane


def flow_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Kernel of the rates, from the velocities of the corners."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Params, internal, evolve, Cell = laws.Params, laws.internal, evolution(space, laws), cell_struct(space)
    kept, inverse, size = "internals" in layout, determinant_and_inverse(space)[1], dim**2 * capacity_of(width)
    stresses, memories = laws.stress._length_ * capacity_of(width), internal._length_ * capacity_of(width)
    block, gather, get = block_of(dim, width), corner_sums(space, width, False), lane(space, width, mat)[0]
    read_mat, (get_stress, put_stress) = field_lanes(space, width, mat)[0], lane(space, width, laws.stress)
    (read_stress, write_stress), (get_memory, put_memory) = (
        field_lanes(space, width, laws.stress),
        lane(space, width, internal),
    )
    read_memory, write_memory = field_lanes(space, width, internal)

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
        b, i, at, rows, own = block(blocks, first + wp.tid())
        dt = ahead * real(dt_of(clock))
        values = wp.zeros(shape=size, dtype=real)
        deformation = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        gather(blocks, b, at, rows, fields.velocity, values)
        read_mat(fields.deformation, i, own, deformation)
        read_stress(fields.stress, i, own, stress)
        if wp.static(kept):
            read_memory(fields.internals, i, own, memory)
        e = int(0)
        while e < own:
            change = get(values, e) * cell.gradient
            later = wp.identity(n=dim, dtype=real) + get(deformation, e) + dt * change
            L = change * inverse(later)
            ds, dq = evolve(p, get_stress(stress, e), get_memory(memory, e), later, L, dt)
            put_stress(stress, e, ds)
            put_memory(memory, e, dq)
            e += 1
        write_stress(stress, i, own, rate_out.stress)
        if wp.static(kept):
            write_memory(memory, i, own, rate_out.internals)

    return flow
