"""A plugin's laws with the normals that a stress state leaves free of stress.

A rate is affine in the velocity gradient: probing it at unit normal rates gives those that keep the free stresses at zero.
A total law and a return to the yield surface are not: there the free strain comes by a secant, from a start that is right
where they are linear. In uniaxial stress both free normals of an isotropic solid strain alike.
"""

import inspect
from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import in_plane
from wsph.constitutive.kept import Kept
from wsph.constitutive.stress_state import StressState, packing, unit_normal
from wsph.errors import PluginError
from wsph.plugins.traits import gives, own_internals

TOTAL_SIGNATURE = "stress(self, space, Params) -> @wp.func (p: Params, H: space.tensor) -> Cauchy stress"
PROJECT_SIGNATURE = "project(self, space, Params) -> @wp.func (p: Params, stress: space.tensor[, q]) -> stress[, q]"
LEAST_SECANT = 1e-12

SECANTS = 6
"""Secant steps for the out-of-plane strain of a total law: the error squares, from the linear answer."""

LEFT = 1e-5
"""A stress along the free normals, in elastic moduli, with which a strain found by secants is not taken."""


def free_rate(space: Space, law: wp.Function, Params: type, internal: type, free: tuple[int, ...]) -> wp.Function:
    """The law with the static free normals at zero stress rate: (p, stress, L, q) -> (stress rate, q rate)."""
    tensor, real = space.tensor, space.scalar
    if not free:
        return law
    unit = unit_normal(space)
    a = free[0]
    if len(free) == 1:

        @wp.func
        def one(p: Params, stress: tensor, L: tensor, q: internal):
            rate, dq = law(p, stress, L, q)
            rate_a, dq_a = law(p, stress, L + unit(a), q)
            x = -rate[a, a] / (rate_a[a, a] - rate[a, a])
            return rate + x * (rate_a - rate), dq + x * (dq_a - dq)

        return one
    b = free[1]

    @wp.func
    def two(p: Params, stress: tensor, L: tensor, q: internal):
        rate, dq = law(p, stress, L, q)
        rate_a, dq_a = law(p, stress, L + unit(a), q)
        rate_b, dq_b = law(p, stress, L + unit(b), q)
        rate_a -= rate
        rate_b -= rate
        scale = real(1.0) / (rate_a[a, a] * rate_b[b, b] - rate_a[b, b] * rate_b[a, a])
        x = (rate_b[a, a] * rate[b, b] - rate_b[b, b] * rate[a, a]) * scale
        y = (rate_a[b, b] * rate[a, a] - rate_a[a, a] * rate[b, b]) * scale
        return rate + x * rate_a + y * rate_b, dq + x * (dq_a - dq) + y * (dq_b - dq)

    return two


@cache
def _secant(space: Space) -> wp.Function:
    """Warp function (gap before, gap after a step, step, slope before, stiffness) -> the slope by a secant, and the next
    step. A secant far from the elastic stiffness is not taken."""
    real = space.scalar

    @wp.func
    def secant(before: real, gap: real, step: real, slope: real, stiffness: real):
        between = (gap - before) / step
        taken = slope
        if between > real(0.05) * stiffness:
            taken = between
        return taken, -gap / taken

    return secant


def _whole_gradient(space: Space, law: wp.Function, state: StressState, Params: type) -> wp.Function:
    """Warp function (p, displacement gradient dim x dim) -> that of the space, the free normals without stress."""
    real, tensor, mat, dim = space.scalar, space.tensor, space.mat, space.dim
    unit, secant, free = unit_normal(space), _secant(space), len(state.free)
    first = state.free[0] if free else 0

    @wp.func
    def widened(h: mat, x: real) -> tensor:
        H = tensor()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                H[i, j] = h[i, j]
        # The free normals of an isotropic solid in one of these states strain alike.
        if wp.static(free > 0):
            H += x * unit(first)
        if wp.static(free > 1):
            H += x * unit(2)
        return H

    halvings = 60 if space.precision == "f64" else 30

    @wp.func
    def bisected(p: Params, h: mat) -> real:
        # The strain where secants do not find it, far from what is linear; not a number where every thickness has a stress.
        low = real(-0.9999)
        high = real(1.0)
        for _ in range(8):
            if law(p, widened(h, high))[first, first] < real(0.0):
                high = real(2.0) * high + real(1.0)
        if law(p, widened(h, low))[first, first] > real(0.0) or law(p, widened(h, high))[first, first] < real(0.0):
            return real(wp.NAN)
        for _ in range(halvings):
            middle = real(0.5) * (low + high)
            if law(p, widened(h, middle))[first, first] > real(0.0):
                high = middle
            else:
                low = middle
        return real(0.5) * (low + high)

    @wp.func
    def whole(p: Params, h: mat) -> tensor:
        if wp.static(free == 0):
            return widened(h, real(0.0))
        # Start from St Venant-Kirchhoff's own answer, which no rotation changes; the secant then is of a law near it.
        trace = real(0.5) * wp.ddot(h, h)
        for i in range(wp.static(dim)):
            trace += h[i, i]
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        stiffness = lame * real(free) + real(2.0) * p.elastic_shear
        twice = wp.max(real(-2.0) * lame * trace / stiffness, real(-0.9375))
        x = twice / (wp.sqrt(real(1.0) + twice) + real(1.0))
        gap = law(p, widened(h, x))[first, first]
        step = -gap / stiffness
        slope = stiffness
        for _ in range(SECANTS):
            # Where the last step was a rounding its secant is noise: the slope before it stays.
            if wp.abs(step) > real(LEAST_SECANT) * (real(1.0) + wp.abs(x)):
                x += step
                next_gap = law(p, widened(h, x))[first, first]
                slope, step = secant(gap, next_gap, step, slope, stiffness)
                gap = next_gap
        if not (wp.abs(gap) <= real(LEFT) * stiffness):
            x = bisected(p, h)
        return widened(h, x)

    return whole


def total_laws(space: Space, material: object, state: StressState, Params: type) -> dict[str, wp.Function]:
    """The total law for the displacement gradients of a stress state, and its energy, by their names in `Laws`; none where
    the material has none. About an initial stress S0, packed, its energy is W(F) + S0:E + W0, E the strain of Green and
    Lagrange and W0 what a linear solid stores at S0: so P = dW/dF + F S0."""
    if not gives(material, "stress"):
        return {}
    law = material.stress(space, Params)
    if not isinstance(law, wp.Function) or len(inspect.signature(law.func).parameters) != 2:
        raise PluginError(f"{type(material).__name__}.stress gave no law of two arguments; expected {TOTAL_SIGNATURE}")
    real, tensor, mat = space.scalar, space.tensor, space.mat
    (unpack, pack), whole, plane = packing(space, state), _whole_gradient(space, law, state, Params), in_plane(space)
    linear, packed = linear_energy(space, Params), space.packed(len(state.components))
    # A law may give its first Piola stress itself: that is what forces take, and cheaper than there and back.
    direct = gives(material, "piola")
    nominal = material.piola(space, Params) if direct else law

    @wp.func
    def answer(p: Params, H: tensor):
        F = wp.identity(n=3, dtype=real) + H
        cauchy = tensor()
        piola = tensor()
        if wp.static(direct):
            piola = nominal(p, H)
            cauchy = piola * wp.transpose(F) / wp.determinant(F)
        else:
            cauchy = law(p, H)
            piola = wp.determinant(F) * cauchy * wp.transpose(wp.inverse(F))
        return cauchy, piola

    @wp.func
    def total(p: Params, h: mat):
        cauchy, piola = answer(p, whole(p, h))
        return pack(cauchy), plane(piola)

    @wp.func
    def total_about(p: Params, h: mat, initial: packed):
        H = whole(p, h)
        cauchy, piola = answer(p, H)
        F = wp.identity(n=3, dtype=real) + H
        more = F * unpack(initial)
        return pack(cauchy + more * wp.transpose(F) / wp.determinant(F)), plane(piola + more)

    found = {"total": total, "total_about": total_about}
    if gives(material, "energy"):
        density = material.energy(space, Params)

        @wp.func
        def energy(p: Params, h: mat) -> real:
            return density(p, whole(p, h))

        @wp.func
        def energy_about(p: Params, h: mat, initial: packed) -> real:
            H = whole(p, h)
            S = unpack(initial)
            strain = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
            return density(p, H) + wp.ddot(S, strain) + linear(p, S)

        found |= {"total_energy": energy, "total_energy_about": energy_about}
    return found


def linear_energy(space: Space, Params: type) -> wp.Function:
    """Warp function (p, stress) -> the energy density that a linear solid stores at a stress."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def stored(p: Params, s: tensor) -> real:
        mean = (s[0, 0] + s[1, 1] + s[2, 2]) / real(3.0)
        deviator = s - mean * wp.identity(n=3, dtype=real)
        return real(0.5) * mean * mean / p.elastic_bulk + real(0.25) * wp.ddot(deviator, deviator) / p.elastic_shear

    return stored


def returning(space: Space, law: wp.Function, Params: type, count: int) -> wp.Function:
    """Warp function (p, stress, own internals) -> both, brought back by a plugin's `law` of `count` internals."""
    tensor, own = space.tensor, space.vector(max(count, 1))

    @wp.func
    def returned(p: Params, s: tensor, mine: own):
        if wp.static(count == 0):
            return law(p, s), mine
        else:
            t, changed = law(p, s, mine)
            return t, changed

    return returned


def straining(space: Space, Params: type) -> wp.Function:
    """Warp function (p, stress, strain) -> the stress after an elastic strain."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def strained(p: Params, s: tensor, strain: tensor) -> tensor:
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        return s + lame * wp.trace(strain) * wp.identity(n=3, dtype=real) + real(2.0) * p.elastic_shear * strain

    return strained


def flowed(space: Space, Params: type) -> wp.Function:
    """Warp function (p, stress, stress lost in a return to it) -> the work of the stress on the plastic strain."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def plastic(p: Params, t: tensor, lost: tensor) -> real:
        mean = wp.trace(t) / real(3.0)
        mean_lost = wp.trace(lost) / real(3.0)
        one = wp.identity(n=3, dtype=real)
        deviatoric = wp.ddot(t - mean * one, lost - mean_lost * one) / (real(2.0) * p.elastic_shear)
        return deviatoric + mean * mean_lost / p.elastic_bulk

    return plastic


def projection(
    space: Space, material: object, state: StressState, Params: type, internal: type, kept: Kept
) -> wp.Function | None:
    """The plugin's return mapping for packed stresses and all internals, the dissipation and the strain of the free normals
    among them; None without one."""
    if not gives(material, "project"):
        return None
    law, count = material.project(space, Params), len(own_internals(material))
    if not isinstance(law, wp.Function) or len(inspect.signature(law.func).parameters) != (3 if count else 2):
        wanted = f"{3 if count else 2} arguments"
        raise PluginError(f"{type(material).__name__}.project gave no law of {wanted}; expected {PROJECT_SIGNATURE}")
    real, stress = space.scalar, space.packed(len(state.components))
    own = space.vector(max(count, 1))
    (unpack, pack), unit, secant, free = packing(space, state), unit_normal(space), _secant(space), len(state.free)
    first = state.free[0] if free else 0
    last, thinning = kept.dissipation, kept.thinning
    returned, strained, plastic = returning(space, law, Params, count), straining(space, Params), flowed(space, Params)

    @wp.func
    def project(p: Params, packed: stress, q: internal):
        s = unpack(packed)
        mine = own()
        for k in range(wp.static(count)):
            mine[k] = q[k]
        trial = s
        after = q
        t, changed = returned(p, s, mine)
        if wp.static(free > 0):
            stiffness = (p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear) * real(free) + real(
                2.0
            ) * p.elastic_shear
            gap = t[first, first]
            step = -gap / stiffness
            slope = stiffness
            x = real(0.0)
            for _ in range(SECANTS):
                if wp.abs(step) > real(LEAST_SECANT):
                    x += step
                    strain = x * unit(first)
                    if wp.static(free > 1):
                        strain += x * unit(2)
                    trial = strained(p, s, strain)
                    t, changed = returned(p, trial, mine)
                    slope, step = secant(gap, t[first, first], step, slope, stiffness)
                    gap = t[first, first]
            if wp.static(thinning >= 0):
                after[thinning] = q[thinning] + real(free) * x
        for k in range(wp.static(count)):
            after[k] = changed[k]
        after[last] = q[last] + plastic(p, t, trial - t)
        return pack(t), after

    return project
