"""The answer of a point under a phase field: its energy split into an opening and a closing part, the damage after one
sweep, and the stress that is left. `wsph.parts.phase_field.field` has the equations and the field.

A linear elastic material takes e = U - I with F = R U (Biot), P = F sum (s_a/u_a) n_a n_a^T: forces are the gradient of the
energy at fixed damage. Any other takes its rate law: the stress that evolves is the undamaged one, e = C^-1 sigma of it,
and g sigma+ + sigma- acts. In plane (and uniaxial) stress the strain out of the plane is the one at which g sigma+ + sigma-
vanishes there: the minimum of the energy over it.
"""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import determinant_and_inverse, in_plane, spectral
from wsph.constitutive.elastic import elastic_strain
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.parts.phase_field.split import shrinkage, split
from wsph.parts.phase_field.sweep import degradation, phase_struct, swept


@cache
def left_of_law(space: Space, laws: Laws, model: str) -> wp.Function:
    """Warp function (p, phase, H, undamaged stress, old damage, S, D) -> (damage, psi+, g, Cauchy stress, first Piola
    stress)."""
    return _linear(space, laws, model) if laws.total is not None else _evolved(space, laws, model)


@cache
def energy_left(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, H, undamaged stress, damage) -> energy density: of a linear law per reference volume, of a rate law
    per current volume."""
    real, mat, stress, Params = space.scalar, space.mat, laws.stress, laws.Params
    parted, degraded, free = split(space, Params), degradation(space), bool(laws.state.free)
    outward, biot, strained = _outward(space, Params), _biot(space), _strained(space, laws)

    @wp.func
    def linear_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e = biot(H)
        out = real(0.0)
        if wp.static(free):
            out = outward(p, e, degraded(d))
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    @wp.func
    def evolved_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e, out = strained(p, undamaged, d)
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    return linear_energy if laws.total is not None else evolved_energy


@cache
def _outward(space: Space, Params: type) -> wp.Function:
    """Warp function (p, principal strains in the plane, g) -> the strain out of the plane at which g s+ + s- vanishes there.
    It has the sign against that of the plane's trace, and the trace of all keeps the plane's."""
    real, vec, dim, beyond = space.scalar, space.vec, space.dim, 3 - space.dim

    @wp.func
    def outward(p: Params, e: vec, g: real) -> real:
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        trace = real(0.0)
        for a in range(wp.static(dim)):
            trace += e[a]
        of_trace = lame
        of_out = real(2.0) * p.elastic_shear
        if trace > real(0.0):
            of_trace *= g
        else:
            of_out *= g
        return -of_trace * trace / (real(beyond) * of_trace + of_out)

    return outward


@cache
def _spread_out(space: Space) -> wp.Function:
    """Warp function (block of the plane, normal out of it) -> 3 x 3."""
    real, mat, tensor, dim = space.scalar, space.mat, space.tensor, space.dim

    @wp.func
    def spread_out(block: mat, out: real) -> tensor:
        full = tensor()
        for a in range(3):
            full[a, a] = out
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                full[a, b] = block[a, b]
        return full

    return spread_out


@cache
def _thick(space: Space, free: bool) -> wp.Function:
    """Warp function (strain out of the plane) -> how much thicker a free plane has become."""
    real, beyond = space.scalar, 3 - space.dim

    @wp.func
    def thick(out: real) -> real:
        if wp.static(free):
            return wp.pow(wp.max(real(1.0) + out, real(1e-3)), real(beyond))
        return real(1.0)

    return thick


@cache
def _biot(space: Space) -> wp.Function:
    """Warp function H -> (axes, principal values of U - I). From H, not from F: small strains keep their digits."""
    real, vec, mat, dim, axes_of = space.scalar, space.vec, space.mat, space.dim, spectral(space)[0]

    @wp.func
    def biot(H: mat):
        axes, squares = axes_of(H + wp.transpose(H) + wp.transpose(H) * H)
        e = vec()
        for a in range(wp.static(dim)):
            e[a] = squares[a] / (wp.sqrt(wp.max(real(1.0) + squares[a], real(0.0))) + real(1.0))
        return axes, e

    return biot


@cache
def _strained(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, undamaged stress, damage) -> (axes, principal strains, strain out of the plane)."""
    real, stress, Params, free = space.scalar, laws.stress, laws.Params, bool(laws.state.free)
    unpack, plane, strain_of = packing(space, laws.state)[0], in_plane(space), elastic_strain(space, Params)
    axes_of, outward, degraded = spectral(space)[0], _outward(space, Params), degradation(space)

    @wp.func
    def strained(p: Params, undamaged: stress, d: real):
        strain = strain_of(p, unpack(undamaged))
        axes, e = axes_of(plane(strain))
        out = strain[2, 2]
        if wp.static(free):
            out = outward(p, e, degraded(d))
        return axes, e, out

    return strained


@cache
def _answered(space: Space, laws: Laws, model: str) -> wp.Function:
    """Warp function (p, phase, principal strains, strain out of the plane, old damage, S, D) -> (damage, psi+, g, the stress
    along each axis, that out of the plane, and the strain there)."""
    real, vec, Params, Phase = space.scalar, space.vec, laws.Params, phase_struct(space)
    parted, sweep, degraded = split(space, Params), swept(space, model), degradation(space)
    outward, free = _outward(space, Params), bool(laws.state.free)

    @wp.func
    def answered(p: Params, phase: Phase, e: vec, given: real, old: real, S: real, D: real):
        out = given
        if wp.static(free):
            out = outward(p, e, degraded(old))
        opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        d = sweep(phase, old, opening, S, D)
        g = degraded(d)
        if wp.static(free):
            out = outward(p, e, g)
            opening, _closing, tension, pressure, out_plus, out_minus = parted(p, e, out)
        return d, opening, g, g * tension + pressure, g * out_plus + out_minus, out

    return answered


@cache
def _intact(space: Space, laws: Laws) -> wp.Function:
    """Warp function (p, phase, H, damage around) -> (whether a point needs no axes, a bound of psi+, Cauchy stress, first
    Piola stress): what is whole, far from damage and too little strained to break is elastic, and the energy of all of e
    bounds psi+."""
    real, mat, stress, dim, beyond = space.scalar, space.mat, laws.stress, space.dim, 3 - space.dim
    Params, Phase, free = laws.Params, phase_struct(space), bool(laws.state.free)
    shrunk, thick, spread_out = shrinkage(space), _thick(space, free), _spread_out(space)
    pack, determinant = packing(space, laws.state)[1], determinant_and_inverse(space)[0]

    @wp.func
    def intact(p: Params, phase: Phase, H: mat, damage: real):
        m, trace, squares, known = shrunk(H)
        if damage > real(0.0) or not known:
            return False, real(0.0), stress(), mat()
        one = wp.identity(n=dim, dtype=real)
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        out = real(0.0)
        if wp.static(free):
            out = -lame * trace / (real(beyond) * lame + real(2.0) * p.elastic_shear)
            trace += real(beyond) * out
            squares += real(beyond) * out * out
        bound = real(0.5) * wp.max(lame, real(0.0)) * trace * trace + p.elastic_shear * squares
        # (lambda tr e + 2 mu e) U^-1
        P = (one + H) * (lame * trace * one + (real(2.0) * p.elastic_shear - lame * trace) * m)
        J = thick(out) * determinant(one + H)
        across = lame * trace + real(2.0) * p.elastic_shear * out
        cauchy = pack(spread_out(P * wp.transpose(one + H) / J, across / J))
        return phase.per_energy * bound < real(1.0), bound, cauchy, P

    return intact


def _linear(space: Space, laws: Laws, model: str) -> wp.Function:
    """`left_of_law` of a linear elastic material, by its energy."""
    real, mat, stress, dim = space.scalar, space.mat, laws.stress, space.dim
    Params, Phase, free = laws.Params, phase_struct(space), bool(laws.state.free)
    sum_of, biot, answered = spectral(space)[1], _biot(space), _answered(space, laws, model)
    # In one dimension there are no axes to spare.
    intact = _intact(space, laws) if dim > 1 else biot
    thick, spread_out = _thick(space, free), _spread_out(space)
    pack, determinant = packing(space, laws.state)[1], determinant_and_inverse(space)[0]
    quick = dim > 1 and model == "AT1"

    @wp.func
    def linear(p: Params, phase: Phase, H: mat, undamaged: stress, old: real, S: real, D: real):
        if wp.static(quick):
            whole, bound, elastic, first = intact(p, phase, H, old + S)
            if whole:
                return real(0.0), bound, real(1.0), elastic, first
        one = wp.identity(n=dim, dtype=real)
        axes, e = biot(H)
        d, opening, g, each, across, out = answered(p, phase, e, real(0.0), old, S, D)
        for a in range(wp.static(dim)):
            # What is turned inside out has u_a = 0 on its way: it is broken then, and kept finite.
            each[a] = each[a] / wp.max(real(1.0) + e[a], real(1e-3))
        P = (one + H) * sum_of(axes, each)
        J = thick(out) * wp.max(determinant(one + H), real(1e-3))
        return d, opening, g, pack(spread_out(P * wp.transpose(one + H) / J, across / J)), P

    return linear


def _evolved(space: Space, laws: Laws, model: str) -> wp.Function:
    """`left_of_law` of a rate law, from the stress that evolves undamaged."""
    real, mat, dim = space.scalar, space.mat, space.dim
    stress, Params, Phase = laws.stress, laws.Params, phase_struct(space)
    (unpack, pack), plane, strain_of = packing(space, laws.state), in_plane(space), elastic_strain(space, Params)
    sum_of, strained, answered = spectral(space)[1], _strained(space, laws), _answered(space, laws, model)
    (determinant, inverse), spread_out = determinant_and_inverse(space), _spread_out(space)

    @wp.func
    def evolved(p: Params, phase: Phase, H: mat, undamaged: stress, old: real, S: real, D: real):
        F = wp.identity(n=dim, dtype=real) + H
        back = mat()
        if determinant(F) > real(0.0):
            back = determinant(F) * wp.transpose(inverse(F))
        if wp.static(model == "AT1") and old + S == real(0.0):
            # The stress that evolves is the one that acts.
            strain = strain_of(p, unpack(undamaged))
            lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
            bound = real(0.5) * wp.max(lame, real(0.0)) * wp.trace(strain) * wp.trace(
                strain
            ) + p.elastic_shear * wp.ddot(strain, strain)
            if phase.per_energy * bound < real(1.0):
                return real(0.0), bound, real(1.0), undamaged, plane(unpack(undamaged)) * back
        axes, e, out = strained(p, undamaged, old)
        d, opening, g, each, across, out = answered(p, phase, e, out, old, S, D)
        acting = sum_of(axes, each)
        return d, opening, g, pack(spread_out(acting, across)), acting * back

    return evolved
