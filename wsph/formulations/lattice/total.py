"""Kernels of cells whose stress follows from their deformation: what their nodes take, and the deformation and the stress
themselves, which no step needs."""

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.constitutive.initial import INITIAL, total_of
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.cell import cell_struct
from wsph.formulations.lattice.lanes import (
    beside,
    block_of,
    capacity_of,
    corner_sums,
    field_lanes,
    hand_over,
    lane,
    quantities,
    set_lane,
)


def answer_kernel(space: Space, laws: Laws, layout: Layout, width: int, *, stabilised: bool) -> wp.Kernel:
    """Kernel of what cells hand to their nodes."""
    real, Fields, Cell, Params = space.scalar, fields_struct(space, layout), cell_struct(space), laws.Params
    size = (space.dim**2 + space.dim + 1) * capacity_of(width)
    block, gather = block_of(space.dim, width), corner_sums(space, width, stabilised)
    hand = hand_over(space, width, quantities(space.dim, stabilised))
    put_share = set_lane(space, width, space.dim**2 + space.dim)
    (stresses, begin, answer_of), by_row = answered(space, laws, layout, width), beside(space, laws, width)
    (get, put), seen = by_row.matrix, by_row.widened

    @kernel(ranged=True, lanes=True)
    def answer(
        first: int,
        p: Params,
        cell: Cell,
        blocks: wp.array(dtype=wp.int32),
        fields: Fields,
        chunks_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        gather(blocks, b, at, rows, fields.displacement, values)
        stress = wp.zeros(shape=stresses, dtype=real)
        begin(fields, i, own, stress)
        gradient = seen(cell.gradient)
        force = seen(cell.force)
        restoring = seen(cell.share * cell.restoring)
        hold = cell.hold * cell.share
        e = int(0)
        while e < rows:
            H = get(values, e) * gradient
            A = answer_of(p, H, stress, e) * force
            if wp.static(stabilised):
                A = A - H * restoring
                put_share(values, e, hold)
            put(values, e, A)
            e += 1
        hand(blocks, b, at, own, values, chunks_out)

    return answer


def answered(space: Space, laws: Laws, layout: Layout, width: int) -> tuple[int, wp.Function, wp.Function]:
    """How many numbers a block of rows has of the initial stress that a total law is about, one where there is none; and
    Warp functions (fields, first, rows, stress_out) that reads it, and (p, H, stress, row) -> first Piola stress."""
    by_row, about, Fields, Params = (
        beside(space, laws, width),
        INITIAL in layout,
        fields_struct(space, layout),
        laws.Params,
    )
    law, mat = by_row.laws.total_about if about else by_row.laws.total, by_row.laws.space.mat
    read, get = field_lanes(space, width, laws.stress)[0], by_row.stress[0]
    numbers = laws.stress._length_ * capacity_of(width) if about else 1

    @wp.func
    def begin(fields: Fields, first: int, rows: int, stress_out: wp.array(dtype=space.scalar)):
        if wp.static(about):
            read(fields.initial_stress, first, rows, stress_out)

    @wp.func
    def about_initial(p: Params, H: mat, stress: wp.array(dtype=space.scalar), row: int) -> mat:
        _cauchy, P = law(p, H, get(stress, row))
        return P

    @wp.func
    def about_none(p: Params, H: mat, stress: wp.array(dtype=space.scalar), row: int) -> mat:
        _cauchy, P = law(p, H)
        return P

    return numbers, begin, about_initial if about else about_none


def telling_kernel(space: Space, laws: Laws, layout: Layout, width: int) -> wp.Kernel:
    """Kernel of the deformation and the stress."""
    real, mat, Fields, Params = space.scalar, space.mat, fields_struct(space, layout), laws.Params
    total = total_of(space, laws, layout)
    Cell, size = cell_struct(space), space.dim**2 * capacity_of(width)
    block, gather, get = block_of(space.dim, width), corner_sums(space, width, False), lane(space, width, mat)[0]

    @kernel(ranged=True, lanes=True)
    def tell(
        first: int,
        p: Params,
        cell: Cell,
        blocks: wp.array(dtype=wp.int32),
        others: Fields,
        fields_out: Fields,
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        gather(blocks, b, at, rows, others.displacement, values)
        for e in range(own):
            H = get(values, e) * cell.gradient
            s, _P = total(p, fields_out, H, i + e)
            fields_out.deformation[i + e] = H
            fields_out.stress[i + e] = s

    return tell
