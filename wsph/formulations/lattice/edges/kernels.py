"""Kernels of the nodes of a lattice that see each other along the edges of its cells: gradients, what forces take of the
averaged answer to their average, forces. `wsph.formulations.lattice.edges.lanes` has the equations."""

# What `wp.static` leaves out is not compiled: a function that is not there is not called.
# pyright: reportOptionalCall=false

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.forces import loaded_force
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import (
    differences,
    flat_lanes,
    pairs_of,
    passed_on,
    pull_along_edges,
)
from wsph.formulations.lattice.lanes import block_of, capacity_of, field_lanes, lane
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct


@cache
def gradient_kernel(space: Space, width: int) -> wp.Kernel:
    """Columns of the gradient of a field along the axes."""
    real, Grid, numbers = space.scalar, grid_struct(space), space.dim**2
    block, find, write = block_of(space.dim, width), differences(space, width), flat_lanes(space, width, numbers)[1]
    size = numbers * capacity_of(width)

    @kernel(ranged=True, lanes=True)
    def gradient(
        first: int,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        field: wp.array(dtype=space.vec),
        columns_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        find(blocks, b, at, rows, field, grid.inverse, values)
        write(values, i, own, grid.stride, columns_out)

    return gradient


@cache
def spread_kernel(space: Space, width: int, stabilised: bool, fades: bool) -> wp.Kernel:
    """What forces take."""
    real, Grid, numbers = space.scalar, grid_struct(space), space.dim**2
    block, find = block_of(space.dim, width), passed_on(space, width, stabilised, fades)
    size, write = numbers * capacity_of(width), flat_lanes(space, width, numbers)[1]

    @kernel(ranged=True, lanes=True)
    def spread(
        first: int,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        nominal: wp.array(dtype=real),
        passed_out: wp.array(dtype=real),
    ):
        b, i, at, rows, own = block(blocks, first + wp.tid())
        values = wp.zeros(shape=size, dtype=real)
        find(blocks, b, at, rows, nominal, columns, grid.hold, grid.left, grid.stride, values)
        write(values, i, own, grid.stride, passed_out)

    return spread


def force_kernel(space: Space, layout: Layout, parts: BodyForceKinds, form: Form, width: int) -> wp.Kernel:
    """Accelerations of the nodes."""
    real, vec, dim, Fields, Grid = space.scalar, space.vec, space.dim, fields_struct(space, layout), grid_struct(space)
    accelerated, Inertia, Coefficients = (
        acceleration(space, parts),
        inertia_struct(space, parts.varied),
        coefficients_of(space, form),
    )
    block, size, loaded = block_of(dim, width), dim * capacity_of(width), loaded_force(space, form)
    pull, act = pull_along_edges(space, width, form.stabilised, form.fades >= 0), _terms(space, form, width)
    (get, put), write, at = lane(space, width, vec), field_lanes(space, width, vec)[1], element(real, vec)

    @kernel(ranged=True, lanes=True)
    def force(
        first: int,
        body: Inertia,
        c: Coefficients,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=real),
        passed: wp.array(dtype=real),
        loads: wp.array(dtype=vec),
        following: wp.array(dtype=vec),
        fields: Fields,
        holding_out: wp.array(dtype=vec),
        rate_out: Fields,
    ):
        b, i, lane, rows, many = block(blocks, first + wp.tid())
        forces = wp.zeros(shape=size, dtype=real)
        drag = wp.zeros(shape=wp.static(size if form.drags else 1), dtype=real)
        hold = wp.zeros(shape=wp.static(size if form.holds else 1), dtype=real)
        pull(
            blocks, b, lane, rows, passed, fields.displacement, grid.inverse, grid.hold, grid.left, grid.stride, forces
        )
        if wp.static(len(form.pair_terms) > 0):
            act(body.density, c, grid, blocks, b, lane, rows, columns, fields.displacement, fields.velocity, drag, hold)
        e = int(0)
        while e < many:
            j = i + e
            f = get(forces, e)
            if wp.static(form.loaded or form.followed):
                f += loaded(vec(), loads, following, j) / at(grid.volume, j)
            if wp.static(form.drags):
                slow = get(drag, e)
                if wp.static(form.resisted):
                    slow += following[following.shape[0] // 2 + j] / at(grid.volume, j)
                f += slow
                put(drag, e, slow / body.density)
            if wp.static(form.holds):
                held = get(hold, e)
                f += held
                put(hold, e, held / body.density)
            put(forces, e, accelerated(body, j, f, at(fields.velocity, j)))
            e += 1
        write(forces, i, many, rate_out.velocity)
        if wp.static(form.drags):
            write(drag, i, many, rate_out.drag)
        if wp.static(form.holds):
            write(hold, i, many, holding_out)

    return force


@cache
def _terms(space: Space, form: Form, width: int) -> wp.Function:
    """Warp function (density, c, grid, blocks, block, lane, rows, columns, displacement, velocity, drag_out, hold_out) that
    adds the pair terms of the rows of a block, per volume."""
    real, vec, dim, capacity = space.scalar, space.vec, space.dim, capacity_of(width)
    Grid, Coefficients, pairs_along = (
        grid_struct(space),
        coefficients_of(space, form),
        pairs_of(space, width, form.fades >= 0),
    )
    made = {t.sum: t.along(space, Coefficients) for t in form.pair_terms if t.along is not None}
    dragged, held, damps, holds = made.get("drag"), made.get("hold"), "drag" in made, "hold" in made
    fades = form.fades >= 0
    size, (get, put) = (3 * dim + 1 + fades) * capacity, lane(space, width, vec)
    get_rate, get_seen = lane(space, width, vec, dim)[0], lane(space, width, vec, 2 * dim)[0]
    # What holds spurious modes fades, what drags does not.
    get_share, get_left = (lane(space, width, space.vector(1), 3 * dim + k)[0] for k in (0, int(fades)))

    @wp.func
    def act(
        density: real,
        c: Coefficients,
        grid: Grid,
        blocks: wp.array(dtype=wp.int32),
        b: int,
        at: int,
        rows: int,
        columns: wp.array(dtype=real),
        displacement: wp.array(dtype=vec),
        velocity: wp.array(dtype=vec),
        drag_out: wp.array(dtype=real),
        hold_out: wp.array(dtype=real),
    ):
        values = wp.zeros(shape=size, dtype=real)
        side = int(0)
        while side < wp.static(2 * dim):
            k = side // 2
            step = grid.step[k]
            r = (real(2 * (side - 2 * k) - 1) * step) * grid.back[k]
            weight = real(wp.static(2.0 / dim)) / (step * step)
            pairs_along(
                blocks, b, at, rows, side, columns, displacement, velocity, step, grid.left, grid.stride, values
            )
            e = int(0)
            while e < rows:
                apart = r + get(values, e)
                square = wp.dot(apart, apart)
                both = (weight * get_share(values, e)[0]) * apart
                left = both
                if wp.static(fades):
                    left = (weight * get_left(values, e)[0]) * apart
                dv = get_rate(values, e)
                seen = get_seen(values, e)
                if wp.static(damps):
                    put(drag_out, e, get(drag_out, e) + dragged(c, density, dv, seen, r, apart, square) * both)
                if wp.static(holds):
                    put(hold_out, e, get(hold_out, e) + held(c, density, dv, seen, r, apart, square) * left)
                e += 1
            side += 1

    return act
