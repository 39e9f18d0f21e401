"""Kernels of the nodes' answers to the averaged gradient: of laws that give the stress of a deformation, and of those that
integrate it, whose answer is what the stress of a state pulls by in the deformation of it."""

# pyright: reportOptionalCall=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import in_plane
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.lagrangian.strain import cofactor_of
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import averages, flat_lanes
from wsph.formulations.lattice.lanes import beside, block_of, capacity_of, field_lanes, lane, set_lane
from wsph.formulations.lattice.strain import acting_stress
from wsph.formulations.lattice.total import answered
from wsph.parts.fading import faded


@cache
def answer_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Columns of the first Piola stress of a total law, from those of the gradient."""
    real, Grid, Params, Fields = space.scalar, grid_struct(space), laws.Params, fields_struct(space, layout)
    block, average = block_of(space.dim, width), averages(space, width)
    size, write = space.dim**2 * capacity_of(width), flat_lanes(space, width, space.dim**2)[1]
    (stresses, begin, answer_of), by_row = answered(space, laws, layout, width), beside(space, laws, width)
    (get, put), seen = by_row.matrix, by_row.widened

    @kernel(ranged=True, lanes=True)
    def answer(
        first: int,
        p: Params,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        fields: Fields,
        nominal_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        stress = wp.zeros(shape=stresses, dtype=real)
        begin(fields, i, rows, stress)
        back = seen(grid.back)
        axes = seen(grid.axes)
        e = int(0)
        while e < rows:
            put(values, e, answer_of(p, get(values, e) * back, stress, e) * axes)
            e += 1
        write(values, i, own, grid.stride, nominal_out)

    return answer


@cache
def telling_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Deformation and stress of a total law, which no step needs."""
    real, Grid, Params, Fields = space.scalar, grid_struct(space), laws.Params, fields_struct(space, layout)
    block, average, get = block_of(space.dim, width), averages(space, width), lane(space, width, space.mat)[0]
    size, total = space.dim**2 * capacity_of(width), total_of(space, laws, layout)

    @kernel(ranged=True, lanes=True)
    def tell(
        first: int,
        p: Params,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        fields_out: Fields,
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        for e in range(own):
            H = get(values, e) * grid.back
            s, _P = total(p, fields_out, H, i + e)
            fields_out.deformation[i + e] = H
            fields_out.stress[i + e] = s

    return tell


def strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form, width: int) -> wp.Kernel:
    """Columns of the first Piola stress of a stress that is integrated, and the deformation; where volumes are those of
    blocks the deformation is there, and the stress has the mean `pressures` of its block, flat, times the dimension."""
    real, dim, Fields, Grid = space.scalar, space.dim, fields_struct(space, layout), grid_struct(space)
    by_row, capacity, size = beside(space, laws, width), capacity_of(width), dim**2 * capacity_of(width)
    own, seen, Coefficients, left_of = by_row.laws, by_row.widened, coefficients_of(space, form), faded(space)
    acting, cofactor = acting_stress(own.space, own), cofactor_of(own.space)
    block, average = block_of(dim, width), averages(space, width)
    read_mat, write_mat = field_lanes(space, width, space.mat)
    unpack, plane, (get, put) = packing(own.space, own.state)[0], in_plane(own.space), by_row.matrix
    write, (read_number, write_number) = flat_lanes(space, width, dim**2)[1], flat_lanes(space, width, 1)
    number_of, put_number = lane(space, width, space.vector(1))[0], set_lane(space, width, 0)
    stresses, memories = laws.stress._length_ * capacity, laws.internal._length_ * capacity
    read_stress, get_stress = field_lanes(space, width, laws.stress)[0], by_row.stress[0]
    read_memory, get_memory = field_lanes(space, width, laws.internal)[0], by_row.memory[0]
    kept = laws.kept.thinning >= 0 or form.fades >= 0

    @kernel(ranged=True, lanes=True)
    def strain(
        first: int,
        c: Coefficients,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        pressures: wp.array(dtype=real),
        fields_out: Fields,
        nominal_out: wp.array(dtype=real),
        left_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        tensor = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        number = wp.zeros(shape=capacity, dtype=real)
        read_stress(fields_out.stress, i, rows, stress)
        if wp.static(kept):
            read_memory(fields_out.internals, i, rows, memory)
        if wp.static(form.blocks):
            read_mat(fields_out.deformation, i, rows, tensor)
            read_number(pressures, i, rows, grid.stride, number)
        else:
            average(blocks, b, at, rows, columns, grid.stride, values)
        back = seen(grid.back)
        axes = seen(grid.axes)
        within = seen(wp.identity(n=dim, dtype=real))
        e = int(0)
        while e < rows:
            q = get_memory(memory, e)
            s = get_stress(stress, e)
            H = get(tensor, e)
            if wp.static(not form.blocks):
                H = get(values, e) * back
                put(tensor, e, H)
            P = acting(s, q, H)
            if wp.static(form.blocks):
                more = number_of(number, e)[0] - wp.ddot(within, plane(unpack(s)))
                P = P + (real(wp.static(1.0 / dim)) * more) * cofactor(H)
            if wp.static(form.fades >= 0):
                put_number(number, e, left_of(c.yields * q[wp.static(form.fades)]))
            put(values, e, P * axes)
            e += 1
        write(values, i, own, grid.stride, nominal_out)
        if wp.static(not form.blocks):
            write_mat(tensor, i, own, fields_out.deformation)
        if wp.static(form.fades >= 0):
            write_number(number, i, own, grid.stride, left_out)

    return strain
