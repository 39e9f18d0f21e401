"""Rates of stress and internals of a rate law at nodes that see each other along edges, from the gradients of velocities."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import averages, flat_lanes
from wsph.formulations.lattice.flow import evolving
from wsph.formulations.lattice.lanes import block_of, capacity_of, field_lanes, lane, set_lane


@cache
def dilation_kernel(space: Space, layout: Layout, width: int) -> wp.Kernel:
    """The averaged gradients of the velocities, by their columns, and the rates of the volume, with the volume as weight."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Grid, capacity, get = grid_struct(space), capacity_of(width), lane(space, width, mat)[0]
    block, average, size = block_of(dim, width), averages(space, width), dim**2 * capacity
    write, write_number = flat_lanes(space, width, dim**2)[1], flat_lanes(space, width, 1)[1]
    (determinant, inverse), put_number = determinant_and_inverse(space), set_lane(space, width, 0)
    read_mat, volume_of = field_lanes(space, width, mat)[0], element(real)

    @kernel(ranged=True, lanes=True)
    def dilation(
        first: int,
        clock: wp.array(dtype=wp.float64),
        ahead: real,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        fields: Fields,
        averaged_out: wp.array(dtype=real),
        volume_out: wp.array(dtype=real),
        rate_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        dt = ahead * real(dt_of(clock))
        values = wp.zeros(shape=size, dtype=real)
        tensor = wp.zeros(shape=size, dtype=real)
        volume = wp.zeros(shape=capacity, dtype=real)
        rate = wp.zeros(shape=capacity, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        read_mat(fields.deformation, i, rows, tensor)
        e = int(0)
        while e < rows:
            change = get(values, e) * grid.back
            later = wp.identity(n=dim, dtype=real) + get(tensor, e) + dt * change
            put_number(volume, e, volume_of(grid.volume, i + e) * determinant(later))
            put_number(rate, e, wp.trace(change * inverse(later)))
            e += 1
        write(values, i, own, grid.stride, averaged_out)
        write_number(volume, i, own, grid.stride, volume_out)
        write_number(rate, i, own, grid.stride, rate_out)

    return dilation


def flow_kernel(space: Space, laws: Laws, layout: Layout, form: Form, width: int) -> wp.Kernel:
    """The rates, from columns of the velocities' gradient; where volumes are those of blocks from averaged ones, and the
    `rates` of the volume by row."""
    real, dim, Fields, Grid = space.scalar, space.dim, fields_struct(space, layout), grid_struct(space)
    Params, capacity, evolve = laws.Params, capacity_of(width), evolving(space, laws, layout, width, form.blocks)
    block, average, size = block_of(dim, width), averages(space, width), dim**2 * capacity
    read, read_number = flat_lanes(space, width, dim**2)[0], flat_lanes(space, width, 1)[0]

    @kernel(ranged=True, lanes=True)
    def flow(
        first: int,
        clock: wp.array(dtype=wp.float64),
        ahead: real,
        p: Params,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        rates: wp.array(dtype=real),
        fields: Fields,
        rate_out: Fields,
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        dt = ahead * real(dt_of(clock))
        values = wp.zeros(shape=size, dtype=real)
        number = wp.zeros(shape=capacity, dtype=real)
        if wp.static(form.blocks):
            read(columns, i, rows, grid.stride, values)
            read_number(rates, i, rows, grid.stride, number)
        else:
            average(blocks, b, at, rows, columns, grid.stride, values)
        evolve(dt, p, grid.back, i, own, values, number, fields, rate_out)

    return flow
