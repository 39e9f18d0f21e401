"""Any material in any stress state.

A material gives a law for 3x3 tensors; this module wraps it for the stress components that a stress state keeps. The law
is affine in the velocity gradient L, so evaluating it at unit normal rates gives the normal rates that meet prescribed
normal stress rates: plane stress, uniaxial stress and the free faces of a body are one rule. Plane and uniaxial strain
set those rates to zero.

Where a law relaxes (its rate at L = 0 is not zero), one internal more is kept: the dissipated energy density, whose rate is
-sigma : C^-1 : (stress rate at L = 0), with C the elastic moduli. Every integrator then integrates the dissipation as it
integrates the rest. A law that is brought back to a yield surface (`project`) keeps it too: each return dissipates the
work of the stress it ends at on the plastic strain C^-1 : (trial - returned). In plane and uniaxial stress the free normals
strain by what keeps their stress zero after the return (`wsph.constitutive.free_normals`).

Of a body that moves two internals more are kept where it follows a rate law: the logarithm of its section or thickness over
that at the start, where free normals change that, and the energy that its stress has stored. Energies are per volume at the
start: forms multiply by the volume ratio of the moment (`wsph.constitutive.evolution`). And the stress turns: with the axes
of the material (`wsph.constitutive.turning`), or as the law itself says.
"""

import dataclasses
import inspect
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import embedded
from wsph.constitutive.face_return import face_return
from wsph.constitutive.free_normals import free_rate, linear_energy, projection, total_laws
from wsph.constitutive.kept import Kept
from wsph.constitutive.stress_state import StressState, packing, unit_normal
from wsph.errors import PluginError
from wsph.plugins.blame import RATE_SIGNATURE
from wsph.plugins.traits import (
    depends_on_stress,
    derived_units,
    dissipates,
    gives,
    own_internals,
    relaxes,
    turns_itself,
)


def parameters(material: object) -> dict[str, str]:
    """Names and units of a material's numbers: its fields, its `derived` properties and the two elastic moduli."""
    names = {
        f.name: f.metadata.get("unit", "")
        for f in dataclasses.fields(material)
        if not isinstance(getattr(material, f.name), (str, bool))
    }
    return {**names, **derived_units(material), "elastic_bulk": "Pa", "elastic_shear": "Pa"}


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
    project_face(p, stress, q, mask) -> (stress, q)            the same where bit k of `mask` says that the normal stress
                                                               kk is to stay what it is, its normal strain free
    total(p, H) -> (stress, first Piola stress dim x dim)      of a total law, static free normals at zero stress;
                                                               None: the law is a rate
    total_energy(p, H) -> energy per reference volume          where a total law gives it
    total_about(p, H, S), total_energy_about(p, H, S)          the same about an initial stress S, packed

    `kept` says which internals are kept beside the material's own, and where. `turned`: the driver turns the stress; the
    skew part of L is the spin that it turns with, and the law itself sees the symmetric part.
    """

    space: Space
    material: object
    evolves: bool
    state: StressState
    kept: Kept
    turned: bool
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
    project_face: wp.Function | None = None
    total: wp.Function | None = None
    total_energy: wp.Function | None = None
    total_about: wp.Function | None = None
    total_energy_about: wp.Function | None = None

    @property
    def beside(self) -> "Laws":
        """The same for rows side by side on a CPU: in single precision with room to spare (`Space.packed`), and of matrices
        of three rows in a plane too, where the plane's turns are not wanted: four numbers are a vector of these."""
        if self.space.precision == "f64":
            return self
        dim = 3 if self.space.dim == 2 and not self.turned else self.space.dim
        return laws_of(replace(self.space, dim=dim, spaced=True), self.material, self.state, self.evolves)


def user_law(space: Space, material: object, Params: type, internal: type) -> wp.Function:
    """The plugin's law as (p, stress, L, q) -> (stress rate, q rate), whatever internals it has."""
    tensor = space.tensor
    if not gives(material, "rate"):

        @wp.func
        def none(p: Params, stress: tensor, L: tensor, q: internal):
            return tensor(), internal()

        return none
    names = list(own_internals(material))
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


def _dissipation(space: Space, Params: type) -> wp.Function:
    """Warp function (p, stress, stress rate at L = 0) -> the rate of the dissipated energy density."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def dissipation(p: Params, s: tensor, at_rest: tensor) -> real:
        mean = (s[0, 0] + s[1, 1] + s[2, 2]) / real(3.0)
        mean_rate = (at_rest[0, 0] + at_rest[1, 1] + at_rest[2, 2]) / real(3.0)
        one = wp.identity(n=3, dtype=real)
        deviatoric = wp.ddot(s - mean * one, at_rest - mean_rate * one)
        return -(deviatoric / (real(2.0) * p.elastic_shear) + mean * mean_rate / p.elastic_bulk)

    return dissipation


def _stored(space: Space, Params: type, state: StressState) -> wp.Function:
    """Warp function (p, packed stress) -> elastic energy density."""
    real, stress, (unpack, _) = space.scalar, space.packed(len(state.components)), packing(space, state)
    linear = linear_energy(space, Params)

    @wp.func
    def energy(p: Params, packed: stress) -> real:
        return linear(p, unpack(packed))

    return energy


def _face_law(
    space: Space, law: wp.Function, Params: type, internal: type, state: StressState, relaxing: bool, turned: bool
) -> wp.Function:
    """`Laws.linear_faces` of a plugin's law."""
    real, tensor, mat, point = space.scalar, space.tensor, space.mat, space.point
    stress, (unpack, pack) = space.packed(len(state.components)), packing(space, state)
    unit, (seen, turn), static_mask = unit_normal(space), _parted(space, turned), sum(1 << k for k in state.free)

    @wp.func
    def linear_faces(p: Params, packed: stress, L: mat, q: internal, S: stress, Q: internal, mask: int, target: point):
        s = unpack(packed)
        L3 = seen(L)
        moving, dq_moving = law(p, s, L3, q)
        rate, dq = moving, dq_moving
        if wp.static(relaxing):
            rest, dq_rest = law(p, s, tensor(), q)
            rate -= rest
            dq -= dq_rest
        if wp.static(turned):
            rate += turn(s, L)
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

    return linear_faces


def _thinning_law(
    space: Space, law: wp.Function, Params: type, internal: type, state: StressState, thinning: int
) -> wp.Function:
    """A law with the strain rate of the free normals among the rates of the internals."""
    tensor, free = space.tensor, len(state.free)
    first = state.free[0] if state.free else 0
    if thinning < 0:
        return law

    @wp.func
    def thinned(p: Params, stress: tensor, L: tensor, q: internal):
        rate, dq = law(p, stress, L, q)
        dq[thinning] = L[first, first]
        if wp.static(free > 1):
            dq[thinning] = dq[thinning] + L[2, 2]
        return rate, dq

    return thinned


@cache
def _parted(space: Space, turned: bool) -> tuple[wp.Function, wp.Function]:
    """Warp functions: velocity gradient dim x dim -> 3x3, as the law sees it: the symmetric part where the stress is turned
    for it; and (stress, velocity gradient) -> the stress rate of the turn."""
    mat, tensor, real, embed = space.mat, space.tensor, space.scalar, embedded(space)

    @wp.func
    def seen(L: mat) -> tensor:
        if wp.static(turned):
            return embed(real(0.5) * (L + wp.transpose(L)))
        return embed(L)

    @wp.func
    def turn(s: tensor, L: mat) -> tensor:
        if wp.static(turned):
            first = embed(real(0.5) * (L - wp.transpose(L))) * s
            return first + wp.transpose(first)
        return tensor()

    return seen, turn


@cache
def _params(material: str, names: tuple[str, ...], real: type) -> type:
    """Struct of a material's parameters. Not id-based: the same fields give the same struct, and so the same compiled
    kernel, in every process."""
    annotations = dict.fromkeys(names, real)
    return wp.struct(type(f"{material}Params", (), {"__annotations__": annotations, "__module__": __name__}))


@lru_cache(maxsize=64)
def laws_of(space: Space, material: object, state: StressState, evolves: bool = False) -> Laws:
    """The laws of a material, by its values: `rate` is a third party's code and may branch on any of them.

    Another value gives another Laws but the same kernel source, so it is loaded from the kernel cache, not compiled.
    `evolves` as `wsph.constitutive.constitutive.Constitutive` has it.
    """
    relaxing, dissipating = relaxes(material), dissipates(material)
    kept = Kept.of(material, state, evolves)
    turned = evolves and space.dim > 1 and not turns_itself(material)
    real, tensor, mat = space.scalar, space.tensor, space.mat
    stress, internal = space.packed(len(state.components)), space.packed(max(kept.count, 1))
    Params = _params(type(material).__name__, tuple(parameters(material)), real)
    own_law = user_law(space, material, Params, internal)
    law = _thinning_law(space, own_law, Params, internal, state, kept.thinning)
    last = kept.dissipation
    free_law = free_rate(space, law, Params, internal, state.free)
    (unpack, pack), dissipation, (seen, turn) = (
        packing(space, state),
        _dissipation(space, Params),
        _parted(space, turned),
    )

    @wp.func
    def at_rest(p: Params, packed: stress, q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, tensor(), q)
        if wp.static(relaxing):
            bare, _ = law(p, s, tensor(), q)
            dq[last] = dissipation(p, s, bare)
        return pack(rate), dq

    @wp.func
    def respond(p: Params, packed: stress, L: mat, q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, seen(L), q)
        if wp.static(turned):
            rate += turn(s, L)
        if wp.static(relaxing):
            bare, _ = law(p, s, tensor(), q)
            dq[last] = dissipation(p, s, bare)
        return pack(rate), dq

    @wp.func
    def linear(p: Params, packed: stress, L: mat, q: internal, S: stress, Q: internal):
        s = unpack(packed)
        rate, dq = free_law(p, s, seen(L), q)
        if wp.static(turned):
            rate += turn(s, L)
        if wp.static(relaxing):
            rest, dq_rest = free_law(p, s, tensor(), q)
            rate -= rest
            dq -= dq_rest
        return pack(rate) + S, dq + Q

    project = projection(space, material, state, Params, internal, kept)
    return Laws(
        space=space,
        material=material,
        evolves=evolves,
        state=state,
        kept=kept,
        turned=turned,
        Params=Params,
        stress=stress,
        internal=internal,
        source=at_rest if relaxing else None,
        respond=respond,
        linear=linear,
        linear_faces=_face_law(space, law, Params, internal, state, relaxing, turned),
        energy=_stored(space, Params, state),
        depends_on_stress=depends_on_stress(material) or turned,
        dissipates=dissipating,
        project=project,
        project_face=face_return(space, material, state, Params, internal, kept, project),
        **total_laws(space, material, state, Params),
    )
