"""Any material in any stress state.

A material gives a law for 3x3 tensors; this module wraps it for the stress components that a stress state keeps. The law
is affine in the velocity gradient L, so evaluating it at unit normal rates gives the normal rates that meet prescribed
normal stress rates: plane stress, uniaxial stress and the free faces of a body are one rule. Plane and uniaxial strain
set those rates to zero.

Where a law relaxes (its rate at L = 0 is not zero), one internal more is kept: the dissipated energy density, whose rate is
-sigma : C^-1 : (stress rate at L = 0), with C the elastic moduli. Every integrator then integrates the dissipation as it
integrates the rest. A law that is brought back to a yield surface (`project`) keeps it too: each return dissipates the
work of the stress it ends at on the plastic strain C^-1 : (trial - returned). In plane and uniaxial stress the free normals
strain by what keeps their stress zero after the return, found by a secant.
"""

import dataclasses
import inspect
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import warp as wp

from wsph.errors import PluginError, Refused, WsphError
from wsph.plugins import dissipates, internal_units, internal_values, relaxes
from wsph.space import Space
from wsph.units import Scales

RATE_SIGNATURE = "rate(self, space, Params) -> @wp.func (p: Params, stress: space.tensor, L: space.tensor[, q]) -> stress rate[, q rate]"


@dataclass(frozen=True)
class StressState:
    """Stress components that are kept, normals first, and the normals whose stress is zero by the state."""

    name: str
    components: tuple[tuple[int, int], ...]
    free: tuple[int, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """ "xx", "xy", ..."""
        return tuple("xyz"[i] + "xyz"[j] for i, j in self.components)

    def wave_speed(self, bulk: float, shear: float, density: float) -> float:
        """Fastest longitudinal wave: sqrt(E/rho) in uniaxial stress, sqrt(E/(rho (1 - nu^2))) in plane stress,
        sqrt((K + 4G/3)/rho) otherwise."""
        modulus = bulk + 4.0 * shear / 3.0
        if len(self.free) == 2:
            modulus = 9.0 * bulk * shear / (3.0 * bulk + shear)
        elif len(self.free) == 1:
            modulus = 4.0 * shear * (bulk + shear / 3.0) / modulus
        return math.sqrt(modulus / density)


STRESS_STATES = {
    (1, "stress"): StressState("uniaxial stress", ((0, 0),), (1, 2)),
    (1, "strain"): StressState("uniaxial strain", ((0, 0), (1, 1), (2, 2))),
    (2, "stress"): StressState("plane stress", ((0, 0), (1, 1), (0, 1)), (2,)),
    (2, "strain"): StressState("plane strain", ((0, 0), (1, 1), (2, 2), (0, 1))),
    (3, None): StressState("three-dimensional", ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))),
}


@contextmanager
def blame(who: str, signature: str = RATE_SIGNATURE) -> Iterator[None]:
    """Turn what Warp says of a plugin's code into an error that names the plugin and what was expected of it."""
    try:
        yield
    except WsphError:
        raise
    except Exception as error:
        if type(error).__module__.split(".")[0] != "warp" and not isinstance(
            error, (RuntimeError, TypeError, AttributeError, ValueError, ArithmeticError)
        ):
            raise
        lines = [line for line in str(error).strip().splitlines() if line.strip()]
        raise PluginError(
            f"{who}: its code fails ({lines[-1] if lines else type(error).__name__}); expected {signature}"
        ) from error


def parameters(material: Any) -> dict[str, str]:
    """Names and units of a material's numbers: its fields, its `derived` properties and the two elastic moduli."""
    names = {
        f.name: f.metadata.get("unit", "")
        for f in dataclasses.fields(material)
        if not isinstance(getattr(material, f.name), (str, bool))
    }
    return {**names, **getattr(material, "derived", {}), "elastic_bulk": "Pa", "elastic_shear": "Pa"}


def _refuse_what_is_not_applied(material: Any, who: str) -> None:
    """A law's part that no formulation here applies would be dropped silently."""
    if hasattr(material, "objective"):
        raise Refused(f"{who} declares 'objective', which is not applied yet; give its whole law as `rate`")
    if hasattr(material, "project") and not hasattr(material, "rate"):
        raise Refused(f"{who} has `project` without `rate`: what is brought back is the stress that a rate gave")
    if not (hasattr(material, "rate") or hasattr(material, "stress")):
        raise Refused(f"{who} has neither `rate` nor `stress`; every formulation needs one of them: {RATE_SIGNATURE}")
    reserved = {"velocity", "stress", "displacement", "density", "von_mises", "pressure", "dissipation", "id", "body"}
    taken = reserved.intersection(getattr(material, "internals", {}))
    if taken:
        raise Refused(f"{who} names an internal {sorted(taken)[0]!r}, which is a field of every body")


class Constitutive:
    """A material in a stress state, ready for kernels.

    `params` (struct of inner, nondimensional numbers), `density`, `internals` (name -> initial value, the dissipation
    included where the law relaxes), and the Warp functions of `laws`.
    """

    def __init__(self, space: Space, material: Any, state: StressState, scales: Scales, who: str):
        self.space, self.material, self.state, self.who = space, material, state, who
        bulk, shear = material.moduli()
        self.wave_speed = state.wave_speed(bulk, shear, material.density)
        self.internal_scales = {name: scales.of(unit) for name, unit in internal_units(material).items()}
        self.internals = {name: value / self.internal_scales[name] for name, value in internal_values(material).items()}
        _refuse_what_is_not_applied(material, who)
        with blame(who):
            self.laws = _laws(space, material, state)
        self.params = self.laws.Params()
        for name, unit in parameters(material).items():
            value = {"elastic_bulk": bulk, "elastic_shear": shear}.get(name)
            value = getattr(material, name) if value is None else value
            setattr(self.params, name, space.scalar(value / scales.of(unit)))
        self.density = material.density / scales.density

    @property
    def width(self) -> int:
        """Number of stress components kept."""
        return len(self.state.components)


@dataclass(frozen=True, eq=False)
class Laws:
    """The Warp functions of a material in a stress state. Stress is packed (`stress` type), L is dim x dim.

    source(p, stress, q) -> (stress rate, q rate)              at L = 0, the dissipation included; None if it is zero
    respond(p, stress, L, q) -> (stress rate, q rate)          the whole rate, static free normals at zero stress rate
    linear(p, stress, L, q, S, Q) -> (rates)                   the part that L causes, added to the given source (S, Q)
    linear_faces(p, stress, L, q, S, Q, mask, target) -> rates the same where bit k of `mask` says that the normal stress
                                                               rate kk is target[k] and the normal strain rate is free
    energy(p, stress) -> elastic energy density
    project(p, stress, q) -> (stress, q)                       brought back to where the law allows it; None: anywhere
    total(p, H) -> (stress, first Piola stress dim x dim)      of a total law, static free normals at zero stress; None: a
    rate total_energy(p, H) -> energy per reference volume          where a total law gives it
    """

    state: StressState
    Params: type
    stress: type
    internal: type
    source: wp.Function | None
    respond: wp.Function
    linear: wp.Function
    linear_faces: wp.Function
    energy: wp.Function
    depends_on_stress: bool
    dissipates: bool
    project: wp.Function | None = None
    total: wp.Function | None = None
    total_energy: wp.Function | None = None


@cache
def packing(space: Space, state: StressState) -> tuple[wp.Function, wp.Function]:
    """Warp functions unpack(packed) -> 3x3 tensor and pack(tensor) -> packed."""
    stress, tensor = space.vector(len(state.components)), space.tensor
    count = len(state.components)
    # Constant vectors, not wp.static of a loop variable: Warp 1.19 resolves those only when it compiles, so a kernel's hash
    # then depends on what else was compiled before, and the first warm start compiles again.
    integers = wp.types.vector(length=count, dtype=wp.int32)
    rows, columns = integers(*[i for i, _ in state.components]), integers(*[j for _, j in state.components])

    @wp.func
    def unpack(packed: stress) -> tensor:
        full = tensor()
        for c in range(wp.static(count)):
            full[rows[c], columns[c]] = packed[c]
            full[columns[c], rows[c]] = packed[c]
        return full

    @wp.func
    def pack(full: tensor) -> stress:
        packed = stress()
        for c in range(wp.static(count)):
            packed[c] = full[rows[c], columns[c]]
        return packed

    return unpack, pack


def user_law(space: Space, material: Any, Params: type, internal: type) -> wp.Function:
    """The plugin's law as (p, stress, L, q) -> (stress rate, q rate), whatever internals it has."""
    tensor = space.tensor
    if not hasattr(material, "rate"):

        @wp.func
        def none(p: Params, stress: tensor, L: tensor, q: internal):
            return tensor(), internal()

        return none
    names = list(getattr(material, "internals", {}))
    law = material.rate(space, Params)
    if not isinstance(law, wp.Function):
        raise PluginError(
            f"{type(material).__name__}.rate returned {type(law).__name__}, no @wp.func; expected {RATE_SIGNATURE}"
        )
    arity, wanted = len(inspect.signature(law.func).parameters), 4 if names else 3
    if arity != wanted:
        raise PluginError(
            f"the law of {type(material).__name__} takes {arity} arguments, not {wanted}"
            f" ({'with' if names else 'no'} internals {names or 'are'} declared); expected {RATE_SIGNATURE}"
        )
    count = len(names)
    if count == 0:

        @wp.func
        def without(p: Params, stress: tensor, L: tensor, q: internal):
            return law(p, stress, L), internal()

        return without
    own = space.vector(count)

    @wp.func
    def with_internals(p: Params, stress: tensor, L: tensor, q: internal):
        mine = own()
        for k in range(wp.static(count)):
            mine[k] = q[k]
        rate, change = law(p, stress, L, mine)
        dq = internal()
        for k in range(wp.static(count)):
            dq[k] = change[k]
        return rate, dq

    return with_internals


PROJECT_SIGNATURE = "project(self, space, Params) -> @wp.func (p: Params, stress: space.tensor[, q]) -> stress[, q]"


def _projection(space: Space, material: Any, state: StressState, Params: type, internal: type) -> wp.Function | None:
    """The plugin's return mapping for packed stresses and all internals, the dissipation among them; None without one."""
    if not hasattr(material, "project"):
        return None
    law, count = material.project(space, Params), len(getattr(material, "internals", {}))
    if not isinstance(law, wp.Function) or len(inspect.signature(law.func).parameters) != (3 if count else 2):
        wanted = f"{3 if count else 2} arguments"
        raise PluginError(f"{type(material).__name__}.project gave no law of {wanted}; expected {PROJECT_SIGNATURE}")
    real, tensor, stress, own = (
        space.scalar,
        space.tensor,
        space.vector(len(state.components)),
        space.vector(max(count, 1)),
    )
    (unpack, pack), unit, free = packing(space, state), _unit(space), len(state.free)
    first = state.free[0] if free else 0

    @wp.func
    def returned(p: Params, s: tensor, mine: own):
        if wp.static(count == 0):
            return law(p, s), mine
        else:
            t, changed = law(p, s, mine)
            return t, changed

    @wp.func
    def strained(p: Params, s: tensor, x: real) -> tensor:
        # The elastic stress of a strain x along each free normal.
        strain = x * unit(first)
        if wp.static(free > 1):
            strain += x * unit(2)
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        return s + lame * wp.trace(strain) * wp.identity(n=3, dtype=real) + real(2.0) * p.elastic_shear * strain

    @wp.func
    def project(p: Params, packed: stress, q: internal):
        s = unpack(packed)
        mine = own()
        for k in range(wp.static(count)):
            mine[k] = q[k]
        trial = s
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
                    trial = strained(p, s, x)
                    t, changed = returned(p, trial, mine)
                    secant = (t[first, first] - gap) / step
                    if secant > real(0.05) * stiffness:
                        slope = secant
                    gap = t[first, first]
                    step = -gap / slope
        mean = wp.trace(t) / real(3.0)
        lost = trial - t
        mean_lost = wp.trace(lost) / real(3.0)
        one = wp.identity(n=3, dtype=real)
        plastic = wp.ddot(t - mean * one, lost - mean_lost * one) / (real(2.0) * p.elastic_shear)
        kept = q
        for k in range(wp.static(count)):
            kept[k] = changed[k]
        kept[count] = q[count] + plastic + mean * mean_lost / p.elastic_bulk
        return pack(t), kept

    return project


@cache
def project_kernel(space: Space, laws: Laws, fields: type) -> wp.Kernel:
    """Bring the stresses of a state back, over its points."""
    Params, project = laws.Params, laws.project or laws.respond

    @wp.kernel(module="unique", enable_backward=False)
    def bring_back(first: int, p: Params, fields_out: fields):
        i = first + wp.tid()
        stress, q = project(p, fields_out.stress[i], fields_out.internals[i])
        fields_out.stress[i] = stress
        fields_out.internals[i] = q

    return bring_back


TOTAL_SIGNATURE = "stress(self, space, Params) -> @wp.func (p: Params, H: space.tensor) -> Cauchy stress"
LEAST_SECANT = 1e-12
SECANTS = 6
"""Secant steps for the out-of-plane strain of a total law: the error squares, from the linear answer."""


def _total(
    space: Space, material: Any, state: StressState, Params: type
) -> tuple[wp.Function | None, wp.Function | None]:
    """The total law for the displacement gradients of a stress state, and its energy; None where the material has none."""
    if not hasattr(material, "stress"):
        return None, None
    law, stored = material.stress(space, Params), None
    if not isinstance(law, wp.Function) or len(inspect.signature(law.func).parameters) != 2:
        raise PluginError(f"{type(material).__name__}.stress gave no law of two arguments; expected {TOTAL_SIGNATURE}")
    real, tensor, mat, dim = space.scalar, space.tensor, space.mat, space.dim
    _, pack = packing(space, state)
    unit = _unit(space)
    free = len(state.free)
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
                secant = (next_gap - gap) / step
                if secant > real(0.05) * stiffness:
                    slope = secant
                gap = next_gap
                step = -gap / slope
        return widened(h, x)

    # A law may give its first Piola stress itself: that is what forces take, and cheaper than there and back.
    direct = hasattr(material, "piola")
    nominal = material.piola(space, Params) if direct else law

    @wp.func
    def total(p: Params, h: mat):
        H = whole(p, h)
        F = wp.identity(n=3, dtype=real) + H
        cauchy = tensor()
        piola = tensor()
        if wp.static(direct):
            piola = nominal(p, H)
            cauchy = piola * wp.transpose(F) / wp.determinant(F)
        else:
            cauchy = law(p, H)
            piola = wp.determinant(F) * cauchy * wp.transpose(wp.inverse(F))
        P = mat()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                P[i, j] = piola[i, j]
        return pack(cauchy), P

    if hasattr(material, "energy"):
        density = material.energy(space, Params)

        @wp.func
        def energy(p: Params, h: mat) -> real:
            return density(p, whole(p, h))

        stored = energy
    return total, stored


@cache
def _unit(space: Space) -> wp.Function:
    """Warp function: the unit normal rate along axis k."""
    tensor, real = space.tensor, space.scalar

    @wp.func
    def unit(k: int) -> tensor:
        rate = tensor()
        rate[k, k] = real(1.0)
        return rate

    return unit


def _free_normals(space: Space, law: wp.Function, Params: type, internal: type, free: tuple[int, ...]) -> wp.Function:
    """The law with the static free normals at zero stress rate: (p, stress, L, q) -> (stress rate, q rate)."""
    tensor, real = space.tensor, space.scalar
    if not free:
        return law
    unit = _unit(space)
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


@lru_cache(maxsize=64)
def _laws(space: Space, material: Any, state: StressState) -> Laws:
    """The laws of a material, by its values: `rate` is a third party's code and may branch on any of them.

    Another value gives another Laws but the same kernel source, so it is loaded from the kernel cache, not compiled.
    """
    relaxing, depends = relaxes(material), bool(getattr(material, "depends_on_stress", True))
    dissipating = dissipates(material)
    real, tensor, mat, point = space.scalar, space.tensor, space.mat, space.point
    dim = space.dim
    width = len(state.components)
    stress = space.vector(width)
    count = len(getattr(material, "internals", {}))
    internal = space.vector(max(count + dissipating, 1))
    # Not id-based: the same fields give the same struct, and so the same compiled kernel, in every process.
    Params = wp.struct(
        type(
            f"{type(material).__name__}Params",
            (),
            {"__annotations__": {name: real for name in parameters(material)}, "__module__": __name__},
        )
    )
    unpack, pack = packing(space, state)
    law = user_law(space, material, Params, internal)
    free_law = _free_normals(space, law, Params, internal, state.free)
    unit = _unit(space)
    static_mask = sum(1 << k for k in state.free)

    @wp.func
    def embed(L: mat) -> tensor:
        full = tensor()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                full[i, j] = L[i, j]
        return full

    @wp.func
    def dissipation(p: Params, s: tensor, at_rest: tensor) -> real:
        mean = (s[0, 0] + s[1, 1] + s[2, 2]) / real(3.0)
        mean_rate = (at_rest[0, 0] + at_rest[1, 1] + at_rest[2, 2]) / real(3.0)
        one = wp.identity(n=3, dtype=real)
        deviatoric = wp.ddot(s - mean * one, at_rest - mean_rate * one)
        return -(deviatoric / (real(2.0) * p.elastic_shear) + mean * mean_rate / p.elastic_bulk)

    @wp.func
    def at_rest(p: Params, packed: stress, q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, tensor(), q)
        if wp.static(relaxing):
            bare, _ = law(p, s, tensor(), q)
            dq[count] = dissipation(p, s, bare)
        return pack(rate), dq

    @wp.func
    def respond(p: Params, packed: stress, L: mat, q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, embed(L), q)
        if wp.static(relaxing):
            bare, _ = law(p, s, tensor(), q)
            dq[count] = dissipation(p, s, bare)
        return pack(rate), dq

    @wp.func
    def linear(p: Params, packed: stress, L: mat, q: internal, S: stress, Q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, embed(L), q)
        if wp.static(relaxing):
            rest, dq_rest = free_law(p, s, tensor(), q)
            rate -= rest
            dq -= dq_rest
        return pack(rate) + S, dq + Q

    @wp.func
    def linear_faces(p: Params, packed: stress, L: mat, q: internal, S: stress, Q: internal, mask: int, target: point):
        s = unpack(packed)
        L3 = embed(L)
        moving, dq_moving = law(p, s, L3, q)
        rate, dq = moving, dq_moving
        if wp.static(relaxing):
            rest, dq_rest = law(p, s, tensor(), q)
            rate -= rest
            dq -= dq_rest
        rate += unpack(S)
        free = mask | static_mask
        system = tensor()
        gap = point()
        for k in range(3):
            if (free >> k) & 1 == 1:
                changed, _ = law(p, s, L3 + unit(k), q)
                gap[k] = target[k] - rate[k, k]
                for row in range(3):
                    if (free >> row) & 1 == 1:
                        system[row, k] = changed[row, row] - moving[row, row]
            else:
                system[k, k] = real(1.0)
        x = wp.inverse(system) * gap
        for k in range(3):
            if (free >> k) & 1 == 1:
                changed, dq_changed = law(p, s, L3 + unit(k), q)
                rate += x[k] * (changed - moving)
                dq += x[k] * (dq_changed - dq_moving)
        return pack(rate), dq + Q

    @wp.func
    def energy(p: Params, packed: stress) -> real:
        s = unpack(packed)
        mean = (s[0, 0] + s[1, 1] + s[2, 2]) / real(3.0)
        deviator = s - mean * wp.identity(n=3, dtype=real)
        return real(0.5) * mean * mean / p.elastic_bulk + real(0.25) * wp.ddot(deviator, deviator) / p.elastic_shear

    return Laws(
        state,
        Params,
        stress,
        internal,
        at_rest if relaxing else None,
        respond,
        linear,
        linear_faces,
        energy,
        depends,
        dissipating,
        _projection(space, material, state, Params, internal),
        *_total(space, material, state, Params),
    )
