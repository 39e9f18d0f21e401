"""Deformation of cells from the displacements of their corners, and what their nodes take of a stress that is integrated."""

# pyright: reportOptionalMemberAccess=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.evolution import thickness
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.lagrangian.strain import cofactor_of
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
from wsph.parts.fading import faded


def strain_kernel(space: Space, laws: Laws, layout: Layout, form: Form, width: int) -> wp.Kernel:
    """Kernel of what cells hand to their nodes, and of their deformation."""
    real, Fields = space.scalar, fields_struct(space, layout)
    Cell, Coefficients = cell_struct(space), coefficients_of(space, form)
    size = (space.dim**2 + space.dim + 1) * capacity_of(width)
    block, gather = block_of(space.dim, width), corner_sums(space, width, form.stabilised)
    hand = hand_over(space, width, quantities(space.dim, form.stabilised))
    put_share, by_row = set_lane(space, width, space.dim**2 + space.dim), beside(space, laws, width)
    (get, put), seen, acting, left = (
        by_row.matrix,
        by_row.widened,
        acting_stress(by_row.laws.space, by_row.laws),
        faded(space),
    )
    stresses, memories = laws.stress._length_ * capacity_of(width), laws.internal._length_ * capacity_of(width)
    tensors, write_mat = space.dim**2 * capacity_of(width), field_lanes(space, width, space.mat)[1]
    kept, read_stress = "internals" in layout, field_lanes(space, width, laws.stress)[0]
    get_stress, read_memory = by_row.stress[0], field_lanes(space, width, laws.internal)[0]
    get_memory = by_row.memory[0]

    @kernel(ranged=True, lanes=True)
    def strain(
        first: int,
        c: Coefficients,
        cell: Cell,
        blocks: wp.array(dtype=wp.int32),
        others: Fields,
        fields_out: Fields,
        chunks_out: wp.array(dtype=real),
    ):
        b, i, at, rows, many = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        stress = wp.zeros(shape=stresses, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        tensor = wp.zeros(shape=tensors, dtype=real)
        gather(blocks, b, at, rows, others.displacement, values)
        read_stress(fields_out.stress, i, many, stress)
        if wp.static(kept):
            read_memory(fields_out.internals, i, many, memory)
        gradient = seen(cell.gradient)
        force = seen(cell.force)
        restoring = seen(cell.restoring)
        e = int(0)
        while e < many:
            H = get(values, e) * gradient
            q = get_memory(memory, e)
            put(tensor, e, H)
            A = acting(get_stress(stress, e), q, H) * force
            if wp.static(form.stabilised):
                share = cell.share
                if wp.static(form.fades >= 0):
                    share = share * left(c.yields * q[wp.static(form.fades)])
                put_share(values, e, cell.hold * share)
                A = A - share * (H * restoring)
            put(values, e, A)
            e += 1
        write_mat(tensor, i, many, fields_out.deformation)
        hand(blocks, b, at, many, values, chunks_out)

    return strain


@cache
def acting_stress(space: Space, laws: Laws) -> wp.Function:
    """Warp function (stress, internals, H) -> first Piola stress."""
    mat, stress, internal = space.mat, laws.stress, laws.internal
    cofactor, (unpack, _), plane = cofactor_of(space), packing(space, laws.state), in_plane(space)
    thick, thins = thickness(space, laws), laws.kept.thinning >= 0

    @wp.func
    def acting(s: stress, q: internal, H: mat) -> mat:
        back = cofactor(H)
        if wp.static(thins):
            back = thick(q) * back
        return plane(unpack(s)) * back

    return acting


def drag_kernel(space: Space, layout: Layout, form: Form, width: int) -> wp.Kernel:
    """Kernel of what cells hand to their nodes of a viscous stress."""
    real, mat, dim, Fields, term = space.scalar, space.mat, space.dim, fields_struct(space, layout), form.rate_term
    Cell, Coefficients = cell_struct(space), coefficients_of(space, form)
    size = dim**2 * capacity_of(width)
    block, gather = block_of(dim, width), corner_sums(space, width, False)
    hand, (get, put) = hand_over(space, width, dim**2), lane(space, width, mat)
    stress_of, (determinant, inverse) = term.make(space, Coefficients), determinant_and_inverse(space)

    @kernel(ranged=True, lanes=True)
    def drag(
        first: int,
        c: Coefficients,
        density: real,
        cell: Cell,
        blocks: wp.array(dtype=wp.int32),
        others: Fields,
        chunks_out: wp.array(dtype=real),
    ):
        b, _i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        rates = wp.zeros(shape=size, dtype=real)
        gather(blocks, b, at, rows, others.displacement, values)
        gather(blocks, b, at, rows, others.velocity, rates)
        e = int(0)
        while e < own:
            F = wp.identity(n=dim, dtype=real) + get(values, e) * cell.gradient
            stress = mat()
            # Turned inside out, F says nothing.
            if determinant(F) > real(0.1):
                to_start = inverse(F)
                L = get(rates, e) * cell.gradient * to_start
                h = c.h
                if wp.static(form.vectors):
                    h = wp.pow(cell.volume, real(wp.static(1.0 / dim)))
                stress = stress_of(c, h, density, L) * wp.transpose(to_start)
            put(values, e, stress * cell.force)
            e += 1
        hand(blocks, b, at, own, values, chunks_out)

    return drag
