"""What a point of a body that breaks by a phase field answers: its energy split into what opens and what closes, the damage
after one sweep, and the stress that is left. `wsph.parts.phase_field.field` has the equations and the field.

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

KEPT = 1e-6
"""The part of the opening stiffness that a broken point keeps."""


@cache
def phase_struct(space: Space) -> type:
    """Struct of a phase field as kernels take it: q per psi+ and b of the sweep, the damage that the step starts from and
    what pairs see of it, which points have damage in their sight, psi+ of the last evaluation (of whole points a bound of
    it), shares times g, and sums of the weights."""
    real = space.scalar
    array = wp.array(dtype=real)
    annotations = {
        "per_energy": real,
        "spread": real,
        "damage": array,
        "seen": array,
        "near": wp.array(dtype=wp.int32),
        "opening": array,
        "share": array,
        "weights": array,
    }
    return wp.struct(type("Phase", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def degradation(space: Space) -> wp.Function:
    """Warp function g(d)."""
    real = space.scalar

    @wp.func
    def degraded(d: real) -> real:
        return (real(1.0) - d) * (real(1.0) - d) * real(wp.static(1.0 - KEPT)) + real(KEPT)

    return degraded


@cache
def swept(space: Space, model: str) -> wp.Function:
    """Warp function (phase, old damage, psi+, S, D) -> damage after one Jacobi sweep."""
    real, Phase = space.scalar, phase_struct(space)

    @wp.func
    def sweep(phase: Phase, old: real, opening: real, S: real, D: real) -> real:
        q = phase.per_energy * opening
        if wp.static(model == "AT1"):
            at = (q - real(1.0) + phase.spread * S) / (q + phase.spread * D)
        else:
            at = (q + phase.spread * S) / (real(1.0) + q + phase.spread * D)
        return wp.max(old, wp.min(real(1.0), at))

    return sweep


@cache
def damaged(space: Space, laws: Laws, model: str) -> tuple[wp.Function, wp.Function]:
    """What a damaged point answers, and its energy.

    (p, phase, H, undamaged stress, old damage, S, D) -> (damage, psi+, g, Cauchy stress, first Piola stress), and (p, H,
    undamaged stress, damage) -> energy density: of a linear law per reference volume, of a rate law per current volume.
    """
    real, vec, mat, tensor, dim = space.scalar, space.vec, space.mat, space.tensor, space.dim
    Params, stress, Phase = laws.Params, laws.stress, phase_struct(space)
    parted, (axes_of, sum_of), shrunk = split(space, Params), spectral(space), shrinkage(space)
    sweep, degraded = swept(space, model), degradation(space)
    determinant, inverse = determinant_and_inverse(space)
    (unpack, pack), plane, strain_of = packing(space, laws.state), in_plane(space), elastic_strain(space, Params)
    quick, free, beyond = dim > 1 and model == "AT1", bool(laws.state.free), 3 - dim

    @wp.func
    def thick(out: real) -> real:
        # How much thicker a free plane has become.
        if wp.static(free):
            return wp.pow(wp.max(real(1.0) + out, real(1e-3)), real(beyond))
        return real(1.0)

    @wp.func
    def outward(p: Params, e: vec, g: real) -> real:
        # The strain out of the plane at which g s+ + s- vanishes there. It has the sign against that of the plane's trace,
        # and the trace of all keeps the plane's.
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

    @wp.func
    def spread_out(block: mat, out: real) -> tensor:
        full = tensor()
        for a in range(3):
            full[a, a] = out
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                full[a, b] = block[a, b]
        return full

    @wp.func
    def biot(H: mat):
        # From H, not from F: small strains keep their digits.
        axes, squares = axes_of(H + wp.transpose(H) + wp.transpose(H) * H)
        e = vec()
        for a in range(wp.static(dim)):
            e[a] = squares[a] / (wp.sqrt(wp.max(real(1.0) + squares[a], real(0.0))) + real(1.0))
        return axes, e

    @wp.func
    def intact(p: Params, phase: Phase, H: mat, damage: real):
        # What is whole, far from damage and too little strained to break needs no axes: the energy of all of e bounds psi+.
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

    @wp.func
    def answered(p: Params, phase: Phase, e: vec, given: real, old: real, S: real, D: real):
        # Damage, psi+, g, the stress along each axis, that out of the plane and the strain there.
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

    @wp.func
    def linear_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e = biot(H)
        out = real(0.0)
        if wp.static(free):
            out = outward(p, e, degraded(d))
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    @wp.func
    def strained(p: Params, undamaged: stress, d: real):
        strain = strain_of(p, unpack(undamaged))
        axes, e = axes_of(plane(strain))
        out = strain[2, 2]
        if wp.static(free):
            out = outward(p, e, degraded(d))
        return axes, e, out

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

    @wp.func
    def evolved_energy(p: Params, H: mat, undamaged: stress, d: real) -> real:
        _axes, e, out = strained(p, undamaged, d)
        opening, closing, _t, _p, _o, _i = parted(p, e, out)
        return degraded(d) * opening + closing

    return (linear, linear_energy) if laws.total is not None else (evolved, evolved_energy)
