"""Stress and internals of a rate law in a body whose deformation is followed."""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.backend.tensors import determinant_and_inverse, in_plane
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.constitutive.turning import spinning, turn_change, turned_gradient


@cache
def thickness(space: Space, laws: Laws) -> wp.Function:
    """Warp function (internals) -> section or thickness over that at the start, where free normals change it; else 1."""
    real, internal, thinning = space.scalar, laws.internal, laws.kept.thinning

    @wp.func
    def thick(q: internal) -> real:
        if wp.static(thinning >= 0):
            return wp.exp(q[thinning])
        return real(1.0)

    return thick


@cache
def volume_ratio(space: Space, laws: Laws, layout: Layout) -> wp.Function:
    """Warp function (fields, i) -> the volume of point i over that at the start; 1 where no deformation is followed."""
    real, dim, Fields, thins = space.scalar, space.dim, fields_struct(space, layout), laws.kept.thinning >= 0
    determinant, thick = determinant_and_inverse(space)[0], thickness(space, laws)

    @wp.func
    def ratio(fields: Fields, i: int) -> real:
        J = real(1.0)
        if wp.static("deformation" in layout):
            J = determinant(wp.identity(n=dim, dtype=real) + fields.deformation[i])
        if wp.static(thins):
            J *= thick(fields.internals[i])
        return J

    return ratio


@cache
def stored_over(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, stress, its rate, q, q rate, F, dt) -> q rate with that of the stored energy, where that is kept:
    what a step dt changes the energy of the particle's own stress by, for forms that see another stress than that."""
    real, mat, Params, stress, internal = space.scalar, space.mat, laws.Params, laws.stress, laws.internal
    stored, energy, determinant, thick = (
        laws.kept.stored,
        laws.energy,
        determinant_and_inverse(space)[0],
        thickness(space, laws),
    )

    @wp.func
    def with_stored(p: Params, s: stress, ds: stress, q: internal, dq: internal, F: mat, dt: real) -> internal:
        rates = dq
        if wp.static(stored >= 0):
            more = energy(p, s + dt * ds) - energy(p, s)
            rates[stored] = determinant(F) * thick(q) * more / dt
        return rates

    return with_stored


@cache
def evolution(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, stress, q, F, L, dt) -> their rates over a step of 2 dt, or at present where dt = 0; F and the
    velocity gradient L are those dt ahead.

    A step that goes on from the start of its stress would be of first order where the law depends on it: the rate is taken
    again in the middle. Energies, stored and dissipated, are per volume at the start.
    """
    real, mat, Params, stress, internal = space.scalar, space.mat, laws.Params, laws.stress, laws.internal
    respond, turned, midpoint = laws.respond, laws.turned, laws.depends_on_stress
    turning, counted = _turning(space, laws) if turned else laws.respond, _counted(space, laws)
    followed = turned_gradient(space, turned)

    @wp.func
    def evolve(p: Params, s: stress, q: internal, F: mat, L: mat, dt: real):
        if wp.static(turned):
            if dt > real(0.0):
                ds, dq, middle, q_middle, D = turning(p, s, q, F, L, dt)
                return ds, counted(middle, q_middle, F, D, dq)
        G = followed(F, L)
        ds, dq = respond(p, s, G, q)
        middle = s
        q_middle = q
        if dt > real(0.0):
            middle = s + dt * ds
            q_middle = q + dt * dq
            if wp.static(midpoint):
                ds, dq = respond(p, middle, G, q_middle)
        return ds, counted(middle, q_middle, F, L, dq)

    return evolve


def _turning(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, stress, q, F, L, dt) -> rates over a step of 2 dt that turns the stress, and stress, internals and
    rate of the strain in its middle: the step in the axes that the material has at its start, then the turn."""
    real, mat, Params, stress, internal = space.scalar, space.mat, laws.Params, laws.stress, laws.internal
    respond, (unpack, pack) = laws.respond, packing(space, laws.state)
    spin, change = spinning(space), turn_change(space)

    @wp.func
    def turning(p: Params, s: stress, q: internal, F: mat, L: mat, dt: real):
        half = dt * spin(F, L)
        D = real(0.5) * (L + wp.transpose(L))
        # Half the turn back, to second order: it is zero where only the turn is.
        back = half * D
        D = D - back - wp.transpose(back)
        ds, dq = respond(p, s, D, q)
        middle = s + dt * ds
        q_middle = q + dt * dq
        ds, dq = respond(p, middle, D, q_middle)
        turn = change(half, unpack(s + (real(2.0) * dt) * ds))
        return ds + pack(turn) / (real(2.0) * dt), dq, middle, q_middle, D

    return turning


def _counted(space: Space, laws: Laws) -> wp.Function:
    """Warp function (stress, q, F, L, q rate) -> q rate with energies per volume at the start: what the stress does work
    on is stored, but for what is dissipated."""
    mat, stress, internal = space.mat, laws.stress, laws.internal
    stored, last, thins = laws.kept.stored, laws.kept.dissipation, laws.kept.thinning >= 0
    unpack, plane = packing(space, laws.state)[0], in_plane(space)
    determinant, thick = determinant_and_inverse(space)[0], thickness(space, laws)

    @wp.func
    def counted(s: stress, q: internal, F: mat, L: mat, dq: internal) -> internal:
        rates = dq
        if wp.static(stored >= 0 or last >= 0):
            J = determinant(F)
            if wp.static(thins):
                J *= thick(q)
            if wp.static(last >= 0):
                rates[last] = J * dq[last]
            if wp.static(stored >= 0):
                rates[stored] = J * wp.ddot(plane(unpack(s)), L)
            if wp.static(stored >= 0 and last >= 0):
                rates[stored] = rates[stored] - rates[last]
        return rates

    return counted
