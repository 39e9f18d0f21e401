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
    about, stresses, read = began(space, laws, layout, width)
    by_row = beside(space, laws, width)
    law = by_row.laws.total_about if about else by_row.laws.total
    (get, put), seen, get_stress = by_row.matrix, by_row.widened, by_row.stress[0]

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
        if wp.static(about):
            read(fields.initial_stress, i, own, stress)
        gradient = seen(cell.gradient)
        force = seen(cell.force)
        restoring = seen(cell.share * cell.restoring)
        hold = cell.hold * cell.share
        e = int(0)
        while e < rows:
            H = get(values, e) * gradient
            if wp.static(about):
                _cauchy, P = law(p, H, get_stress(stress, e))
                A = P * force
            else:
                _cauchy, P = law(p, H)
                A = P * force
            if wp.static(stabilised):
                A = A - H * restoring
                put_share(values, e, hold)
            put(values, e, A)
            e += 1
        hand(blocks, b, at, own, values, chunks_out)

    return answer


def began(space: Space, laws: Laws, layout: Layout, width: int) -> tuple[bool, int, wp.Function]:
    """Whether a total law is about an initial stress, how many numbers a block of rows has of that, one where there is none,
    and how rows read it."""
    about, numbers = INITIAL in layout, laws.stress._length_ * capacity_of(width)
    return about, numbers if about else 1, field_lanes(space, width, laws.stress)[0]


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
