"""Kernels of both half steps by rows of the lattice: of particles inside, which see 2^dim of the other set."""

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.constitutive.laws import Laws
from wsph.formulations.lattice.lanes import beside, block_of, capacity_of, corner_sums, field_lanes, lane
from wsph.formulations.taylor.sums.row_sums import means, stress_sums
from wsph.parts.body_force import BodyForceKinds, acceleration, inertia_struct


def _gathering(space: Space, laws: Laws, source: Layout, width: int, rotated: bool) -> wp.Function:
    """Warp function (blocks, block, lane, rows, fields, sources, gradient, motion_out, bearing_out, memory_out, rest_out,
    change_out): of the rows of a block sums of differences and mean of the velocities, mean and divergence of the stresses,
    means of the internals and of the sources of both."""
    real, Source = space.scalar, fields_struct(space, source)
    kept, sourced = "internals" in source, laws.source is not None
    of_velocity, of_stress = corner_sums(space, width, True), stress_sums(space, laws, width, rotated)
    mean_stress, mean_memory = means(space, width, laws.stress), means(space, width, laws.internal)

    @wp.func
    def gather(
        blocks: wp.array(dtype=wp.int32),
        b: int,
        at: int,
        rows: int,
        fields: Source,
        sources: Source,
        gradient: space.mat,
        motion_out: wp.array(dtype=real),
        bearing_out: wp.array(dtype=real),
        memory_out: wp.array(dtype=real),
        rest_out: wp.array(dtype=real),
        change_out: wp.array(dtype=real),
    ):
        of_velocity(blocks, b, at, rows, fields.velocity, motion_out)
        of_stress(blocks, b, at, rows, fields.stress, gradient, bearing_out)
        if wp.static(kept):
            mean_memory(blocks, b, at, rows, fields.internals, memory_out)
        if wp.static(sourced):
            mean_stress(blocks, b, at, rows, sources.stress, rest_out)
            mean_memory(blocks, b, at, rows, sources.internals, change_out)

    return gather


def _own(space: Space, laws: Laws, layout: Layout, width: int, drifts: bool) -> tuple[wp.Function, wp.Function]:
    """Warp functions (fields, first, rows, velocity_out, stress_out, memory_out, place_out) that reads what neighbouring
    particles have, and (velocity, stress, memory, place, first, rows, fields_out) that writes it; displacements where a
    particle `drifts`."""
    real, Fields, kept = space.scalar, fields_struct(space, layout), "internals" in layout
    (read_v, write_v), (read_s, write_s), (read_q, write_q) = (
        field_lanes(space, width, each) for each in (space.vec, laws.stress, laws.internal)
    )

    @wp.func
    def read(
        fields: Fields,
        first: int,
        rows: int,
        velocity_out: wp.array(dtype=real),
        stress_out: wp.array(dtype=real),
        memory_out: wp.array(dtype=real),
        place_out: wp.array(dtype=real),
    ):
        read_v(fields.velocity, first, rows, velocity_out)
        read_s(fields.stress, first, rows, stress_out)
        if wp.static(kept):
            read_q(fields.internals, first, rows, memory_out)
        if wp.static(drifts):
            read_v(fields.displacement, first, rows, place_out)

    @wp.func
    def write(
        velocity: wp.array(dtype=real),
        stress: wp.array(dtype=real),
        memory: wp.array(dtype=real),
        place: wp.array(dtype=real),
        first: int,
        rows: int,
        fields_out: Fields,
    ):
        write_v(velocity, first, rows, fields_out.velocity)
        write_s(stress, first, rows, fields_out.stress)
        if wp.static(kept):
            write_q(memory, first, rows, fields_out.internals)
        if wp.static(drifts):
            write_v(place, first, rows, fields_out.displacement)

    return read, write


@cache
def step_kernel(
    space: Space,
    laws: Laws,
    source: Layout,
    target: Layout,
    parts: BodyForceKinds,
    width: int,
    *,
    rotated: bool,
    adds: bool,
) -> wp.Kernel:
    """Kernel that gives targets the mean of their sources and the rate there; where it `adds`, their own values and that
    rate. All sums are of differences, and need no value nearby that they are about; means of the sources of internals are
    within the range of these by themselves (`wsph.formulations.taylor.sums.gather`)."""
    real, vec, mat, dim, capacity = space.scalar, space.vec, space.mat, space.dim, capacity_of(width)
    Source, Target, Params = fields_struct(space, source), fields_struct(space, target), laws.Params
    sourced, drifts = laws.source is not None, adds and "displacement" in target
    block, by_row, w = block_of(dim, width), beside(space, laws, width), laws.stress._length_
    linear, stress, internal = by_row.laws.linear, by_row.laws.stress, by_row.laws.internal
    get_gradient, seen = by_row.matrix[0], by_row.widened
    (get_s, put_s), (get_q, put_q), (get_v, put_v) = by_row.stress, by_row.memory, lane(space, width, vec)
    get_mean, get_force = lane(space, width, vec, dim * dim)[0], lane(space, width, vec, w)[0]
    gather, (read, write) = _gathering(space, laws, source, width, rotated), _own(space, laws, target, width, drifts)
    accelerated, Inertia = acceleration(space, parts), inertia_struct(space, parts.varied)
    vectors, stresses, memories = dim * capacity, w * capacity, laws.internal._length_ * capacity
    motions, bearings = (dim + 1) * vectors, stresses + vectors
    (of_rest, of_change), of_place = (stresses, memories) if sourced else (1, 1), vectors if drifts else 1

    @kernel(ranged=True, lanes=True)
    def step_by_rows(
        first: int,
        p: Params,
        body: Inertia,
        gradient: mat,
        blocks: wp.array(dtype=wp.int32),
        fields: Source,
        sources: Source,
        clock: wp.array(dtype=wp.float64),
        weight: real,
        fields_out: Target,
    ):
        b, i, at, rows, many = block(blocks, first + wp.tid())
        dt = real(dt_of(clock)) * weight
        motion = wp.zeros(shape=motions, dtype=real)
        bearing = wp.zeros(shape=bearings, dtype=real)
        memory = wp.zeros(shape=memories, dtype=real)
        rest = wp.zeros(shape=of_rest, dtype=real)
        change = wp.zeros(shape=of_change, dtype=real)
        gather(blocks, b, at, rows, fields, sources, gradient, motion, bearing, memory, rest, change)
        velocity = wp.zeros(shape=vectors, dtype=real)
        old_s = bearing
        old_q = memory
        place = wp.zeros(shape=of_place, dtype=real)
        if wp.static(adds):
            old_s = wp.zeros(shape=stresses, dtype=real)
            old_q = wp.zeros(shape=memories, dtype=real)
            read(fields_out, i, many, velocity, old_s, old_q, place)
        turn = seen(gradient)
        e = int(0)
        while e < many:
            S = stress()
            Q = internal()
            if wp.static(sourced):
                S = get_s(rest, e)
                Q = get_q(change, e)
            ds, dq = linear(p, get_s(bearing, e), get_gradient(motion, e) * turn, get_q(memory, e), S, Q)
            mean = get_mean(motion, e)
            v = mean
            if wp.static(adds):
                v = get_v(velocity, e)
            if wp.static(drifts):
                put_v(place, e, get_v(place, e) + real(0.5) * dt * v)
            put_v(velocity, e, v + dt * accelerated(body, i + e, get_force(bearing, e), mean))
            put_s(bearing, e, get_s(old_s, e) + dt * ds)
            put_q(memory, e, get_q(old_q, e) + dt * dq)
            e += 1
        write(velocity, bearing, memory, place, i, many, fields_out)

    return step_by_rows
