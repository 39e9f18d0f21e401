"""Kernels of vertices against faces: what acts on the vertices, what acts back, and what is kept of a step."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.contact.meeting.closest import on_face
from wsph.contact.meeting.forces import contact_force, open_contact
from wsph.contact.meeting.nearest import facing_area, meeting_point, nearest_faces, outwards
from wsph.contact.meeting.structs import (
    FAR,
    candidates_struct,
    law_struct,
    memory_struct,
    reading,
    record_struct,
    writing,
)
from wsph.contact.surfaces.struct import surface_struct


@cache
def touch_kernel(space: Space) -> wp.Kernel:
    """What acts on the vertices of a surface from the faces of another, of those that have candidates. Vertices of each
    surface see the other's faces, each way with half of the stiffness."""
    real, vec = space.scalar, space.vec
    Law, Candidates, Surface = law_struct(space), candidates_struct(), surface_struct(space)
    Memory, Record = memory_struct(space), record_struct(space)
    outward, nearest, meet, facing = (
        outwards(space),
        nearest_faces(space),
        meeting_point(space),
        facing_area(space),
    )
    held, hold, contact, opened = reading(space), writing(space), contact_force(space), open_contact(space)

    @kernel(ranged=True)
    def touch(
        first: int,
        law: Law,
        rows: Candidates,
        own: Surface,
        other: Surface,
        clock: wp.array(dtype=wp.float64),
        kept: Memory,
        trial_out: Memory,
        record_out: Record,
        force_out: wp.array(dtype=vec),
    ):
        row = first + wp.tid()
        i = rows.which[row]
        dt = real(dt_of(clock))
        found = nearest(law, rows, row, own.x[i], outward(own, i), other)
        met = meet(found, own, i, other)
        h = held(kept, i)
        if found.count > 0 and met.gap > real(0.0):
            # Clear of the surface, there is nothing to be eased any more.
            h.ease = real(0.0)
        gap = met.gap - h.ease
        h.gap = real(FAR)
        if found.count > 0:
            h.gap = gap
        force = vec()
        count = int(0)
        if found.count > 0 and found.distance < law.depth and gap < real(0.0):
            size = facing(law, own, i, found, met, other)
            h = contact(law, met, gap, size, dt, h)
            force = h.elastic + h.damper - law.tangent * law.stiffness * size * h.stick
            count = found.count
        else:
            h = opened(met.way, dt, h)
        hold(trial_out, i, h)
        record_out.force[i] = force
        record_out.count[i] = count
        record_out.faces[i] = found.faces
        force_out[i] = force_out[i] + force

    return touch


@cache
def ease_kernel(space: Space) -> wp.Kernel:
    """The depths of vertices at the start, which count as none."""
    real, vec = space.scalar, space.vec
    Law, Candidates, Surface = law_struct(space), candidates_struct(), surface_struct(space)
    outward, nearest, meet = outwards(space), nearest_faces(space), meeting_point(space)

    @kernel(ranged=True)
    def ease(
        first: int,
        law: Law,
        rows: Candidates,
        own: Surface,
        other: Surface,
        ease_out: wp.array(dtype=real),
    ):
        row = first + wp.tid()
        i = rows.which[row]
        p = vec(own.x[i])
        found = nearest(law, rows, row, p, outward(own, i), other)
        if found.count > 0 and found.distance < law.depth:
            met = meet(found, own, i, other)
            ease_out[i] = wp.min(met.gap, real(0.0))

    return ease


@cache
def add_kernel(space: Space) -> wp.Kernel:
    """Add what acts on some vertices, as another process has found it."""
    vec = space.vec

    @kernel(ranged=True)
    def add(first: int, which: wp.array(dtype=wp.int32), force: wp.array(dtype=vec), force_out: wp.array(dtype=vec)):
        i = which[first + wp.tid()]
        force_out[i] = force_out[i] + force[i]

    return add


@cache
def answer_kernel(space: Space) -> wp.Kernel:
    """What acts back on the vertices of the faces that were met: minus the force of every vertex that has met a face, by the
    weights of its nearest point. `rows` are the vertices that may have met a face around each of the other surface's."""
    real, vec, dim = space.scalar, space.vec, space.dim
    Candidates, Surface, Record = candidates_struct(), surface_struct(space), record_struct(space)
    face_point = on_face(space)

    @kernel(ranged=True)
    def answer(
        first: int,
        rows: Candidates,
        own: Surface,
        other: Surface,
        record: Record,
        force_out: wp.array(dtype=vec),
    ):
        row = first + wp.tid()
        v = rows.which[row]
        total = vec()
        for k in range(rows.offsets[row], rows.offsets[row + 1]):
            i = rows.indices[k]
            count = record.count[i]
            faces = record.faces[i]
            for s in range(count):
                f = faces[s]
                for c in range(wp.static(dim)):
                    if other.faces[f, c] == v:
                        b = face_point(own.x[i], other, f)
                        total -= (b[c] / real(count)) * record.force[i]
        force_out[v] = force_out[v] + total

    return answer


@cache
def keep_kernel(space: Space) -> wp.Kernel:
    """Take the memory of an evaluation as that of the step, for those that `which` names."""
    Memory = memory_struct(space)
    held, hold = reading(space), writing(space)

    @kernel(ranged=True)
    def keep(first: int, which: wp.array(dtype=wp.int32), trial: Memory, kept_out: Memory):
        i = which[first + wp.tid()]
        hold(kept_out, i, held(trial, i))

    return keep
