"""The forces of a contact, from its gap and from what it remembers: elastic, damped, with friction.

Elastic forces give back no more than was put in (the account below), and friction follows the normal force with a memory.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.contact.meeting.nearest import met_struct
from wsph.contact.meeting.structs import held_struct, law_struct

FORGOTTEN = 20.0
"""Times of friction's memory, after which a contact that was open begins anew."""

SEED = 2.0
"""The memory of a young contact of age a is a running mean, of the rate SEED/a."""

CELLS, SWINGS = 20.0, 8.0
"""Memory of friction, in the times that a wave takes over a spacing, and over the shortest side of the smaller body, of
which it is the longer. A body swings in 4 of its sides' times: with a memory of less what slides at mu = .5 hums, however
fine it is, and with 20 spacings alone a block of six cells does."""

LEAST = 1e-30
"""Stands for a stiffness of zero in a quotient."""


def forgetting(memory: float | None, spacing: float, side: float, speed: float) -> float:
    """Rate at which friction forgets the normal force, 0 for at once: by a `memory` in spacings, or where none is given by
    the `spacing` and the shortest `side` of a body, with waves of a `speed`; nondimensional."""
    way = memory * spacing if memory is not None else max(CELLS * spacing, SWINGS * side)
    return speed / way if way > 0.0 else 0.0


@cache
def elastic_force(space: Space) -> wp.Function:
    """Warp function (where, gap, stiffness, memory) -> the memory with the elastic force of this evaluation.

    The energy k g^2/2 of a contact jumps where the nearest face or the area changes although nothing moved. So each contact
    keeps an account of the work of its own force, and is no deeper than what the account holds. The work of a step is the
    mean of the forces at its ends times the way, which for a spring adds up to k g^2/2 exactly: with
    W' = W - F.d/2 and v the closing, the depth g admitted solves k g^2/2 = W' + k g v/2, and where nothing jumps that is
    the depth itself.
    """
    real, double = space.scalar, wp.float64
    Met, Held = met_struct(space), held_struct(space)

    @wp.func
    def elastic(met: Met, gap: real, stiffness: real, was: Held) -> Held:
        h = was
        k = double(stiffness)
        closing = -double(wp.dot(met.way, met.normal))
        have = h.account - double(0.5) * double(wp.dot(h.elastic, met.way))
        inside = closing * closing + double(8.0) * have / wp.max(k, double(LEAST))
        most = double(0.0)
        if inside > double(0.0):
            most = wp.max(double(0.5) * (closing + wp.sqrt(inside)), double(0.0))
        depth = wp.min(-double(gap), most)
        h.elastic = real(k * depth) * met.normal
        h.account = have + double(0.5) * k * depth * closing
        h.stored = double(0.5) * k * depth * depth
        return h

    return elastic


@cache
def friction_force(space: Space) -> wp.Function:
    """Warp function (law, where, normal force, stiffness of stick, dt, memory) -> the memory with friction's spring.

    Coulomb friction that follows the normal force at once is ill-posed between elastic bodies (Ranjith & Rice 2001); it
    follows with a lag (Prakash & Clifton 1993), of a running mean first, since a contact that has just begun has no past.
    """
    real, vec, double = space.scalar, space.vec, wp.float64
    Law, Met, Held = law_struct(space), met_struct(space), held_struct(space)

    @wp.func
    def friction(law: Law, met: Met, normal: real, stiffness: real, dt: real, was: Held) -> Held:
        h = was
        if law.relax == real(0.0) or h.parted * law.relax > real(FORGOTTEN):
            h.pressing = normal
            h.touching = real(0.0)
        h.touching = h.touching + dt
        if law.relax > real(0.0):
            rate = wp.max(law.relax, real(SEED) / h.touching)
            h.pressing = h.pressing + (normal - h.pressing) * (real(1.0) - wp.exp(-rate * dt))
        most = law.friction * h.pressing
        n = met.normal
        stick = vec(h.stick)
        stick = stick - wp.dot(stick, n) * n + met.way - wp.dot(met.way, n) * n
        pull = stiffness * wp.length(stick)
        if pull > most:
            h.lost = h.lost + double(most * (pull - most) / wp.max(stiffness, real(LEAST)))
            stick = stick * (most / pull)
        h.stick = stick
        h.sprung = double(real(0.5) * stiffness * wp.dot(stick, stick))
        return h

    return friction


@cache
def damper_force(space: Space) -> wp.Function:
    """Warp function (law, where, impedance, elastic force, stiffness of stick, dt, memory) -> the damper's force.

    Along the normal it never pulls more than the elastic force pushes; along the surface it and friction's spring are
    together no more than Coulomb's bound.
    """
    real, vec = space.scalar, space.vec
    Law, Met, Held = law_struct(space), met_struct(space), held_struct(space)

    @wp.func
    def normal_damper(met: Met, impedance: real, push: real) -> real:
        return wp.max(-impedance * wp.dot(met.speed, met.normal), -push)

    @wp.func
    def tangential_damper(law: Law, met: Met, impedance: real, stiffness: real, h: Held) -> vec:
        n = met.normal
        spring = stiffness * h.stick
        pull = spring + impedance * (met.speed - wp.dot(met.speed, n) * n)
        size, most = wp.length(pull), law.friction * h.pressing
        if size > most:
            pull = pull * (most / size)
        return spring - pull

    return normal_damper, tangential_damper


@cache
def contact_force(space: Space) -> wp.Function:
    """Warp function (law, where, gap, area, dt, memory) -> the memory of a vertex in contact, with its forces. The whole
    force is its elastic one and its damper's, less friction's spring."""
    real, double = space.scalar, wp.float64
    Law, Met, Held = law_struct(space), met_struct(space), held_struct(space)
    elastic, friction = elastic_force(space), friction_force(space)
    normal_damper, tangential_damper = damper_force(space)

    @wp.func
    def contact(law: Law, met: Met, gap: real, size: real, dt: real, was: Held) -> Held:
        h = elastic(met, gap, law.stiffness * size, was)
        impedance = law.impedance * size / (real(1.0) + law.softening * dt)
        push = wp.dot(h.elastic, met.normal)
        push_damped = normal_damper(met, impedance, push)
        damper = push_damped * met.normal
        if law.friction > real(0.0):
            stiffness = law.tangent * law.stiffness * size
            h = friction(law, met, push + push_damped, stiffness, dt, h)
            damper = damper + tangential_damper(law, met, impedance, stiffness, h)
        h.lost = h.lost - double(real(0.5) * wp.dot(was.damper + damper, met.way))
        h.damper = damper
        h.parted = real(0.0)
        return h

    return contact


@cache
def open_contact(space: Space) -> wp.Function:
    """Warp function (way against the other surface, dt, memory) -> the memory of a vertex that touches nothing.

    What its account still held is lost with the depth that it stood for; a debt stays for the next touch. The energy of
    friction's spring is dissipated.
    """
    real, vec, double = space.scalar, space.vec, wp.float64
    Held = held_struct(space)

    @wp.func
    def opened(way: vec, dt: real, was: Held) -> Held:
        h = was
        h.account = wp.min(h.account - double(0.5) * double(wp.dot(h.elastic, way)), double(0.0))
        h.lost = h.lost - double(real(0.5) * wp.dot(h.damper, way)) + h.sprung
        h.elastic = vec()
        h.damper = vec()
        h.stick = vec()
        h.stored = double(0.0)
        h.sprung = double(0.0)
        h.parted = h.parted + dt
        return h

    return opened
