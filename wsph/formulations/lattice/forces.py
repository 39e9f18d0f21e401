"""Forces of cells on their nodes, and of a body's other points."""

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lagrangian.forces import loaded_force, sum_from_points
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lattice.lanes import block_of, capacity_of, field_lanes, lane, pull_of_cells
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct
from wsph.parts.terms import answers_struct, points_struct
from wsph.sph.rows import rows_struct


def force_kernel(
    space: Space, layout: Layout, parts: BodyForceKinds, form: Form, width: int, *, mixed: bool
) -> wp.Kernel:
    """Accelerations of the nodes of a body. `mixed`: other points than its boxes push them too
    (`wsph.formulations.lattice.rest`)."""
    real, vec, dim, Fields = space.scalar, space.vec, space.dim, fields_struct(space, layout)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)
    block, size = block_of(dim, width), dim * capacity_of(width)
    pull, drags, pulled = pull_of_cells(space, width, form.stabilised), form.drags, pull_of_cells(space, width, False)
    damps, resisted = form.damps, form.resisted
    (get, put), loaded, write = lane(space, width, vec), loaded_force(space, form), field_lanes(space, width, vec)[1]
    at = element(real, vec)

    @kernel(ranged=True, lanes=True)
    def force(
        first: int,
        body: Inertia,
        blocks: wp.array(dtype=wp.int32),
        chunks: wp.array(dtype=real),
        drags_of: wp.array(dtype=real),
        loads: wp.array(dtype=vec),
        following: wp.array(dtype=vec),
        own: wp.array(dtype=real),
        pushed: wp.array(dtype=vec),
        fields: Fields,
        rate_out: Fields,
    ):
        b, i, lane, rows, many = block(blocks, first + wp.tid())
        forces = wp.zeros(shape=size, dtype=real)
        pull(blocks, b, lane, rows, chunks, fields.displacement, forces)
        drag = forces
        if wp.static(drags):
            drag = wp.zeros(shape=size, dtype=real)
            if wp.static(damps):
                pulled(blocks, b, lane, rows, drags_of, fields.displacement, drag)
        e = int(0)
        while e < many:
            j = i + e
            f = get(forces, e)
            if wp.static(mixed):
                f += pushed[j]
            f = loaded(f, loads, following, j)
            if wp.static(drags):
                slow = get(drag, e)
                if wp.static(mixed and damps):
                    slow += pushed[pushed.shape[0] // 2 + j]
                if wp.static(resisted):
                    slow += following[following.shape[0] // 2 + j]
                f += slow
                put(drag, e, slow / (at(own, j) * body.density))
            put(forces, e, accelerated(body, j, f / at(own, j), at(fields.velocity, j)))
            e += 1
        write(forces, i, many, rate_out.velocity)
        if wp.static(drags):
            write(drag, i, many, rate_out.drag)

    return force


def push_kernel(space: Space, layout: Layout, form: Form) -> wp.Kernel:
    """Forces of the points on the nodes that see any, and behind them those of the viscous stress."""
    vec, Fields, pushed = space.vec, fields_struct(space, layout), sum_from_points(space, form)
    Rows, Points, Answers, damps = rows_struct(space), points_struct(space), answers_struct(space), form.damps

    @kernel(ranged=True, pairs=True)
    def push(
        first: int,
        rows: Rows,
        points: Points,
        answers: Answers,
        nodes: wp.array(dtype=wp.int32),
        fields: Fields,
        pushed_out: wp.array(dtype=vec),
    ):
        row = first + wp.tid()
        i = nodes[row]
        f, drag = pushed(rows, points, answers, fields.displacement[i], row, i)
        pushed_out[i] = f
        if wp.static(damps):
            pushed_out[pushed_out.shape[0] // 2 + i] = drag

    return push
