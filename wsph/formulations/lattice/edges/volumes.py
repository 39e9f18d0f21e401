"""Kernels of nodes whose volumes are those of blocks (`wsph.formulations.lagrangian.blocks` has the equations), by rows.

What a block's nodes have in common is a mean over it, J of F = I + H and the pull q: rows write a number each, means take
their place (`wsph.formulations.lattice.edges.blocks`), and rows go on with these.
"""

# pyright: reportOptionalCall=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.initial import total_of
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.strain import cofactor_of
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import averages, flat_lanes, flat_means
from wsph.formulations.lattice.lanes import ACROSS, block_of, capacity_of, field_lanes, lane, set_lane


@cache
def mean_kernel(space: Space, width: int) -> wp.Kernel:
    """Numbers by row become the mean of their block, by weight."""
    real, columns, means, single = space.scalar, 1 + 2**space.dim, flat_means(space, width), width == 1

    @kernel(ranged=True, lanes=True)
    def mean(
        first: int, runs: wp.array(dtype=wp.int32), weights: wp.array(dtype=real), values_out: wp.array(dtype=real)
    ):
        run = first + wp.tid()
        lane = int(0)
        if wp.static(single):
            run = run // ACROSS
            lane = first + wp.tid() - run * ACROSS
        many = runs[run * columns]
        if wp.static(single):
            many = wp.min(wp.max(many - lane, 0), 1)
        means(runs, run, lane, many, weights, values_out)

    return mean


@cache
def volume_kernel(space: Space, width: int) -> wp.Kernel:
    """The averaged gradients, by their columns, and J."""
    real, dim, Grid = space.scalar, space.dim, grid_struct(space)
    block, average, size = block_of(dim, width), averages(space, width), dim**2 * capacity_of(width)
    write, write_number = flat_lanes(space, width, dim**2)[1], flat_lanes(space, width, 1)[1]
    get, put_number, capacity = lane(space, width, space.mat)[0], set_lane(space, width, 0), capacity_of(width)
    determinant = determinant_and_inverse(space)[0]

    @kernel(ranged=True, lanes=True)
    def volume(
        first: int,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        averaged_out: wp.array(dtype=real),
        ratio_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        number = wp.zeros(shape=capacity, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        e = int(0)
        while e < rows:
            put_number(number, e, determinant(wp.identity(n=dim, dtype=real) + get(values, e) * grid.back))
            e += 1
        write(values, i, own, grid.stride, averaged_out)
        write_number(number, i, own, grid.stride, ratio_out)

    return volume


@cache
def pull_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Columns of the first Piola stress of a total law, a P - q F^-T, and q, from the mean J."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Grid, Params, capacity, cofactor = grid_struct(space), laws.Params, capacity_of(width), cofactor_of(space)
    block, (get, put), size = block_of(dim, width), lane(space, width, mat), dim**2 * capacity
    (read, write), (read_number, write_number) = flat_lanes(space, width, dim**2), flat_lanes(space, width, 1)
    number_of, put_number = lane(space, width, space.vector(1))[0], set_lane(space, width, 0)
    stretch, total, determinant = _stretched(space), total_of(space, laws, layout), determinant_and_inverse(space)[0]

    @kernel(ranged=True, lanes=True)
    def answer_of_blocks(
        first: int,
        p: Params,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        averaged: wp.array(dtype=real),
        means: wp.array(dtype=real),
        fields: Fields,
        nominal_out: wp.array(dtype=real),
        pull_out: wp.array(dtype=real),
    ):
        _b, i, _at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        number = wp.zeros(shape=capacity, dtype=real)
        read(averaged, i, rows, grid.stride, values)
        read_number(means, i, rows, grid.stride, number)
        e = int(0)
        while e < rows:
            H = get(values, e) * grid.back
            F = wp.identity(n=dim, dtype=real) + H
            J = determinant(F)
            scale, whole = stretch(number_of(number, e)[0] / J, H)
            _cauchy, P = total(p, fields, whole, i + e)
            pull = real(wp.static(1.0 / dim)) * scale * wp.ddot(P, F)
            put(values, e, (scale * P - (pull / J) * cofactor(H)) * grid.axes)
            put_number(number, e, pull)
            e += 1
        write(values, i, own, grid.stride, nominal_out)
        write_number(number, i, own, grid.stride, pull_out)

    return answer_of_blocks


@cache
def close_kernel(space: Space, width: int) -> wp.Kernel:
    """The same with the mean pull: plus J/Jbar qbar F^-T."""
    real, dim, Grid, capacity = space.scalar, space.dim, grid_struct(space), capacity_of(width)
    block, (get, put), size = block_of(dim, width), lane(space, width, space.mat), dim**2 * capacity
    (read, write), read_number = flat_lanes(space, width, dim**2), flat_lanes(space, width, 1)[0]
    number_of, cofactor = lane(space, width, space.vector(1))[0], cofactor_of(space)

    @kernel(ranged=True, lanes=True)
    def close(
        first: int,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        averaged: wp.array(dtype=real),
        means: wp.array(dtype=real),
        pulls: wp.array(dtype=real),
        nominal_out: wp.array(dtype=real),
    ):
        _b, i, _at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        nominal = wp.zeros(shape=size, dtype=real)
        number = wp.zeros(shape=capacity, dtype=real)
        pull = wp.zeros(shape=capacity, dtype=real)
        read(averaged, i, rows, grid.stride, values)
        read(nominal_out, i, rows, grid.stride, nominal)
        read_number(means, i, rows, grid.stride, number)
        read_number(pulls, i, rows, grid.stride, pull)
        e = int(0)
        while e < rows:
            push = number_of(pull, e)[0] / number_of(number, e)[0]
            put(nominal, e, get(nominal, e) + push * (cofactor(get(values, e) * grid.back) * grid.axes))
            e += 1
        write(nominal, i, own, grid.stride, nominal_out)

    return close


@cache
def telling_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Deformation and stress of a total law with the volumes of blocks, which no step needs."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Grid, Params, stretch, total = grid_struct(space), laws.Params, _stretched(space), total_of(space, laws, layout)
    block, average, get = block_of(dim, width), averages(space, width), lane(space, width, mat)[0]
    (unpack, pack), determinant, size = (
        packing(space, laws.state),
        determinant_and_inverse(space)[0],
        dim**2 * capacity_of(width),
    )

    @kernel(ranged=True, lanes=True)
    def tell(
        first: int,
        p: Params,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        means: wp.array(dtype=real),
        pulls: wp.array(dtype=real),
        fields_out: Fields,
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        for e in range(own):
            H = get(values, e) * grid.back
            F = wp.identity(n=dim, dtype=real) + H
            J = determinant(F)
            mean = means[i + e]
            scale, whole = stretch(mean / J, H)
            s, P = total(p, fields_out, whole, i + e)
            more = pulls[i + e] / mean - real(wp.static(1.0 / dim)) * scale * wp.ddot(P, F) / J
            fields_out.stress[i + e] = pack((mean / J) * unpack(s) + more * wp.identity(n=3, dtype=real))
            fields_out.deformation[i + e] = whole

    return tell


@cache
def _stretched(space: Space) -> wp.Function:
    """Warp function (change of the volume, H) -> a, that to the power 1/dim, and what H is of a F; not finite where a volume
    is turned inside out. From H, so that small strains keep their digits."""
    real, mat, dim = space.scalar, space.mat, space.dim

    @wp.func
    def stretched(change: real, H: mat):
        scale = wp.pow(change, real(wp.static(1.0 / dim)))
        return scale, scale * H + (scale - real(1.0)) * wp.identity(n=dim, dtype=real)

    return stretched


def current_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """The deformation of a state whose stress is integrated, and the trace of that, with the volume as its weight."""
    real, mat, dim, Fields = space.scalar, space.mat, space.dim, fields_struct(space, layout)
    Grid, capacity, (get, put) = grid_struct(space), capacity_of(width), lane(space, width, mat)
    block, average, size = block_of(dim, width), averages(space, width), dim**2 * capacity
    write, write_number = field_lanes(space, width, mat)[1], flat_lanes(space, width, 1)[1]
    put_number, determinant, plane = set_lane(space, width, 0), determinant_and_inverse(space)[0], in_plane(space)
    unpack, stresses = packing(space, laws.state)[0], laws.stress._length_ * capacity
    read_stress, get_stress = field_lanes(space, width, laws.stress)[0], lane(space, width, laws.stress)[0]
    volume_of = element(real)

    @kernel(ranged=True, lanes=True)
    def current(
        first: int,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        fields_out: Fields,
        volume_out: wp.array(dtype=real),
        trace_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        volume = wp.zeros(shape=capacity, dtype=real)
        trace = wp.zeros(shape=capacity, dtype=real)
        average(blocks, b, at, rows, columns, grid.stride, values)
        read_stress(fields_out.stress, i, rows, stress)
        e = int(0)
        while e < rows:
            H = get(values, e) * grid.back
            put(values, e, H)
            put_number(volume, e, volume_of(grid.volume, i + e) * determinant(wp.identity(n=dim, dtype=real) + H))
            put_number(trace, e, wp.trace(plane(unpack(get_stress(stress, e)))))
            e += 1
        write(values, i, own, fields_out.deformation)
        write_number(volume, i, own, grid.stride, volume_out)
        write_number(trace, i, own, grid.stride, trace_out)

    return current
