"""Rates of stress and internals of a rate law at the cells of a lattice."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.evolution import evolution
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.cell import cell_struct
from wsph.formulations.lattice.lanes import beside, block_of, capacity_of, corner_sums, field_lanes, lane


@cache
def evolving(space: Space, laws: Laws, layout: Layout, width: int, blocks: bool) -> wp.Function:
    """Warp function (dt, p, turn, first, rows, values, theta, fields, rate_out) that writes the rates of neighbouring rows,
    dt ahead: the gradients of the velocities are the rows' `values` times `turn`; with `blocks` their volumes' rates are
    `theta`."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    by_row, capacity, kept = beside(space, laws, width), capacity_of(width), "internals" in layout
    own, seen, size = by_row.laws, by_row.widened, dim**2 * capacity
    Params, evolve, inverse = laws.Params, evolution(own.space, own), determinant_and_inverse(own.space)[1]
    law_dim, get, read_mat = own.space.dim, by_row.matrix[0], field_lanes(space, width, mat)[0]
    stresses, memories = laws.stress._length_ * capacity, laws.internal._length_ * capacity
    (get_stress, put_stress), (get_memory, put_memory) = by_row.stress, by_row.memory
    read_stress, write_stress = field_lanes(space, width, laws.stress)
    read_memory, write_memory = field_lanes(space, width, laws.internal)
    number_of = lane(space, width, space.vector(1))[0]

    @wp.func
    def rates(
        dt: real,
        p: Params,
        turn: mat,
        first: int,
        rows: int,
        values: wp.array(dtype=real),
        theta: wp.array(dtype=real),
        fields: Fields,
        rate_out: Fields,
    ):
        deformation = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        read_mat(fields.deformation, first, rows, deformation)
        read_stress(fields.stress, first, rows, stress)
        if wp.static(kept):
            read_memory(fields.internals, first, rows, memory)
        one = wp.identity(n=law_dim, dtype=real)
        widened = seen(turn)
        within = seen(wp.identity(n=dim, dtype=real))
        e = int(0)
        while e < rows:
            change = get(values, e) * widened
            later = one + get(deformation, e) + dt * change
            L = change * inverse(later)
            if wp.static(blocks):
                L += (real(wp.static(1.0 / dim)) * (number_of(theta, e)[0] - wp.trace(L))) * within
            ds, dq = evolve(p, get_stress(stress, e), get_memory(memory, e), later, L, dt)
            put_stress(stress, e, ds)
            put_memory(memory, e, dq)
            e += 1
        write_stress(stress, first, rows, rate_out.stress)
        if wp.static(kept):
            write_memory(memory, first, rows, rate_out.internals)

    return rates


def flow_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Kernel of the rates, from the velocities of the corners."""
    real, dim, Fields, Cell = space.scalar, space.dim, fields_struct(space, layout), cell_struct(space)
    Params, size, evolve = laws.Params, dim**2 * capacity_of(width), evolving(space, laws, layout, width, False)
    block, gather = block_of(dim, width), corner_sums(space, width, False)

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
        values = wp.zeros(shape=size, dtype=real)
        gather(blocks, b, at, rows, fields.velocity, values)
        evolve(ahead * real(dt_of(clock)), p, cell.gradient, i, own, values, values, fields, rate_out)

    return flow
