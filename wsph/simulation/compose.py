"""From a scene to a composition: bodies with their systems and integrators, one time step, one set of scales.

A line of stages, each of which takes what the one before gave: materials, method, lattices, scales, time step, systems with
their integrators, limits, what acts between bodies, the guard, probes, the program. A composition holds what the scene asks
for and nothing else. It is refused, with the reason and the way out, where its time step lies beyond what its integrator or
its material can take.
"""

# pyright: strict
# pyright: reportUnknownArgumentType=false

import json
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import cast

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.device import pick_device
from wsph.backend.graph import Program
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.moduli import warn_of_lost_digits, wave_speed
from wsph.constitutive.sampling import fault_of_law, law_named
from wsph.constitutive.stress_state import STRESS_STATES, StressState
from wsph.contact.overlap import overlapping, solid_of
from wsph.contact.table import interactions
from wsph.errors import Fault, PluginError, Refused, SceneError
from wsph.expressions import Expression
from wsph.formulations import memory
from wsph.formulations.reading import DENSITY, Reading
from wsph.formulations.setup import Setup
from wsph.formulations.system import System
from wsph.geometry.geometry import Geometry
from wsph.geometry.meshes.inspection import doubts
from wsph.output import fields
from wsph.plugins import integrators, registry
from wsph.plugins.blame import blame
from wsph.plugins.formulations import FORMULATIONS, Formulation, of_sets
from wsph.plugins.formulations import offered as worked_in
from wsph.plugins.options import build
from wsph.plugins.traits import gives, turns
from wsph.protocols import Integrator, Interaction, Material
from wsph.scene.geometries import geometry_of, is_fitted, refuse_misfits, stairs_in_words
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composition import BodyRun, Composition, Step
from wsph.simulation.diagnostics import Diagnostics
from wsph.simulation.probes import Recorder
from wsph.simulation.step_control import given_step, settle
from wsph.simulation.timeline import TimeStep
from wsph.stability.guard import guard
from wsph.stability.limit import StepLimit
from wsph.units import Scales


def compose(scene: Scene) -> Composition:
    """Set up a scene. Raises SceneError, Refused or PluginError; compiles the set-up's kernels, runs nothing."""
    try:
        return _compose(scene)
    except SceneError as error:
        raise scene.located(error) from None


def _compose(scene: Scene) -> Composition:
    materials = _materials(scene)
    method = _method(scene)
    device, space = pick_device(scene.run.device), Space(scene.dim, scene.run.precision)
    refuse_misfits(scene, method.formulation)
    memory.refuse_too_large(scene, device, _first_system, lambda body: is_fitted(scene, body, method.formulation))
    bare = _bare_bodies(scene, materials, method)
    scales = _scales(bare)
    time_step = given_step(scene.run, scales.time, device, method.who)
    setting = Setting(scene, method, scales)
    bodies = [_body_run(setting, each, space, time_step) for each in bare]
    _part(scene, bodies)
    between = interactions(scene, bodies, space, scales, time_step.clock)
    _push(bodies, between)
    with blame(method.who, integrators.SIGNATURE):
        settle(time_step, bodies, scales.time, method.who)
    _guard(setting, bare, bodies, space, time_step)
    probes = _probes(scene, bodies, space, time_step)
    step = Step(bodies, between, time_step.clock, [probe for probe in probes if probe.every_step])
    pairs = sum(run.system.pairs for run in bodies)
    program = Program(step, time_step.clock, pairs, scene.run.threads, step.before)
    return Composition(scene, space, scales, time_step, bodies, between, probes, program, method.who)


def memory_need(scene: Scene) -> memory.Need:
    """The memory that the bodies of a scene will take, by small ones of the same form. Raises as `compose` does."""
    form = _method(scene).formulation
    device = pick_device(scene.run.device)
    return memory.estimate(scene, device, _first_system, lambda body: is_fitted(scene, body, form))


def stairs(scene: Scene) -> dict[str, str]:
    """Where the surface of a body is in steps of a cell, and why, by the bodies' names: of those of which it is."""
    form = _method(scene).formulation
    told = {body.name: stairs_in_words(scene, body, form) for body in scene.bodies}
    return {name: said for name, said in told.items() if said}


def _first_system(scene: Scene, bounded: bool) -> System:
    """The system of a scene's first body by itself. `bounded`: with the limit of its time step."""
    method, space = _method(scene), Space(scene.dim, scene.run.precision)
    bare = _bare_bodies(scene, _materials(scene), method)
    scales = _scales(bare)
    time_step = given_step(scene.run, scales.time, pick_device(scene.run.device), method.who)
    return _body_run(Setting(scene, method, scales), bare[0], space, time_step, bounded=bounded).system


def _materials(scene: Scene) -> list[Material]:
    built: list[Material] = []
    for k, body in enumerate(scene.bodies):
        material, faults = build(
            "materials", body.material.model, body.material.options(), f"bodies.{k}.material", "model"
        )
        if faults:
            raise SceneError("scene", faults)
        built.append(cast(Material, material))
    return built


def wants_displacement(scene: Scene) -> bool:
    """Whether a probe or a frame asks for the displacement, or for the density, which may follow from it; or there are
    bodies that may meet."""
    wanted = [*scene.output.fields, *(f for probe in scene.probes for f in probe.fields)]
    return len(scene.bodies) > 1 or any(fields.primitive(name) in ("displacement", DENSITY) for name in wanted)


@dataclass(frozen=True)
class Method:
    """The method of a scene: the integrator's class, with the name and the distribution that messages say of it (`who`),
    its options, and the formulation that it works in."""

    plugin: type
    name: str
    who: str
    options: dict[str, object]
    formulation: Formulation

    def on(self, system: System) -> Integrator:
        """The integrator of a body. Raises SceneError where it does not take its options or the composition."""
        try:
            return cast(Integrator, self.plugin(system, **self.options))
        except ValueError as error:
            raise SceneError("scene", [Fault(0, "run.integrator", f"{self.name}: {error}")]) from None


def _method(scene: Scene) -> Method:
    name = scene.run.integrator.name
    plugin = registry.load("integrators", name)
    who = f"integrator {name!r} ({registry.origin('integrators', name)})"
    with blame(who, integrators.SIGNATURE):
        integrators.check(plugin)
    systems = of_sets(integrators.sets(plugin))
    offered = worked_in(integrators.offered(plugin, tuple(systems)), integrators.sets(plugin))
    if not all(each in systems for each in offered) or not offered:
        raise PluginError(f"{who} is no integrator; expected {integrators.SIGNATURE}")
    chosen = scene.run.formulation or offered[0]
    if chosen not in offered:
        raise Refused(f"run.formulation: {name} works in {', '.join(map(repr, offered))}, not in {chosen!r}")
    _refuse_support(scene, systems[chosen])
    return Method(plugin, name, who, scene.run.integrator.options(), systems[chosen])


def _refuse_support(scene: Scene, formulation: Formulation) -> None:
    """Refuse a support with which a form is not what it says."""
    support, traits = scene.run.support, formulation.traits
    low, high = traits.supports
    if support is not None and not low <= support <= high:
        raise Refused(
            f"run.support = {support:g}: the {formulation.name} form takes {low:g} to {high:g} spacings: beyond them"
            f" the stress of a linear motion is wrong beside the faces, or untried; without the key it is {traits.support:g}"
        )


@dataclass(frozen=True)
class BareBody:
    """A body of a scene before it has a system: its material and what messages call that (`who`), its stress state, its
    geometry and its wave speed [m/s]."""

    body: Body
    material: Material
    who: str
    state: StressState
    geometry: Geometry
    speed: float

    @property
    def crossing(self) -> float:
        """The time that a wave takes over a spacing [s]."""
        return self.geometry.spacing / self.speed


def _bare_bodies(scene: Scene, materials: Sequence[Material], method: Method) -> list[BareBody]:
    states = [STRESS_STATES[scene.dim, body.state] for body in scene.bodies]
    geometries = [geometry_of(scene, k, method.formulation) for k in range(len(scene.bodies))]
    who = [
        f"material {body.material.model!r} ({registry.origin('materials', body.material.model)})"
        for body in scene.bodies
    ]
    speeds = [wave_speed(*each) for each in zip(materials, states, who, strict=True)]
    return [BareBody(*each) for each in zip(scene.bodies, materials, who, states, geometries, speeds, strict=True)]


def _scales(bodies: Sequence[BareBody]) -> Scales:
    """Scales of the body that a wave crosses a spacing of in the shortest time."""
    fastest = bodies[int(np.argmin([each.crossing for each in bodies]))]
    scales = Scales(fastest.geometry.spacing, fastest.crossing, fastest.material.density)
    _refuse_extremes(scales, fastest.body)
    return scales


def _refuse_extremes(scales: Scales, body: Body) -> None:
    """Refuse scales whose powers leave double precision."""
    with np.errstate(all="ignore"):
        parts = np.array([scales.length, scales.time, scales.density])
        length, time, density = parts
        powers = np.array([density * length**2 / time**2, density * length**5])
    if not ((parts > 1e-150) & (parts < 1e150)).all() or not (np.isfinite(powers) & (powers > 0.0)).all():
        sizes = (
            f"spacing {scales.length:g} m, spacing over wave speed {scales.time:g} s, density {scales.density:g} kg/m3"
        )
        raise Refused(f"body {body.name!r}: {sizes} are too far out to compute with in double precision")


@dataclass(frozen=True)
class Setting:
    """The part of a composition that all bodies share: scene, method and scales."""

    scene: Scene
    method: Method
    scales: Scales


def _body_run(setting: Setting, bare: BareBody, space: Space, time_step: TimeStep, *, bounded: bool = True) -> BodyRun:
    """A body with its system, its integrator and, where it is to be `bounded`, its limit."""
    scene, method, scales, clock = setting.scene, setting.method, setting.scales, time_step.clock
    body = bare.body
    traits = method.formulation.traits
    evolves = not traits.small_strain and (traits.needs_rate or turns(bare.material))
    constitutive = Constitutive(space, bare.material, bare.state, scales, bare.who, evolves=evolves)
    _refuse(body, bare.material, method, bare.who)
    warn_of_lost_digits(body.name, bare.material, space, bare.who)
    setup = Setup(
        scene, body, method.formulation, bare.geometry, space, constitutive, scales, clock, wants_displacement(scene)
    )
    for part in setup.host.parts.values():
        if warning := part.warning(setup.host):
            warnings.warn(warning, RuntimeWarning, stacklevel=6)
    with law_named(bare.material, bare.who):
        system = cast(System, method.formulation.build(setup))
    told = (f"body {body.name!r}: {doubt}" for doubt in doubts(bare.geometry))
    for warning in (*told, *system.warnings):
        warnings.warn(warning, RuntimeWarning, stacklevel=6)
    _start(scene, body, system, scales)
    traits = system.traits
    with law_named(bare.material, bare.who), blame(method.who, integrators.SIGNATURE):
        integrator = method.on(system)
        integrators.begin(integrator)

        def ask() -> tuple[float | None, str]:
            with blame(method.who, integrators.SIGNATURE):
                return integrators.limit(integrator) if bounded else (None, "it is not asked for")

        limit = StepLimit(ask, system, traits.measures, traits.courant_follows)
    # A law that gives no numbers leaves no frequency, and so no time step that its integrator could take.
    lost = limit.value == 0.0 and traits.measures and not np.isfinite(system.frequency)
    if lost and (fault := fault_of_law(bare.material, bare.who)):
        raise PluginError(fault)
    diagnostics = Diagnostics(
        space,
        constitutive,
        system.volume,
        system.point_volume,
        system.density,
        clock.device,
        system.response,
        system.breaks,
        traits.courant_follows,
        total=system.total,
    )
    return BodyRun(body, constitutive, system, integrator, diagnostics, limit, time_step, Reading(system))


def _start(scene: Scene, body: Body, system: System, scales: Scales) -> None:
    """Give a system its initial velocity and what is prescribed at t = 0."""
    if body.velocity is not None:
        values = [scene.value(v, "m/s") for v in body.velocity]
        columns = [value(system.position) for value in values if isinstance(value, Expression)]
        system.state.write("velocity", np.stack(columns, 1) / scales.velocity)
    system.begin()
    system.hold(system.state, 0.0)
    held: list[np.ndarray] = [array.numpy() for array in (system.state.buffer, *system.arrays.kept.values())]
    if not all(np.isfinite(values).all() for values in held):
        raise Refused(f"body {body.name!r}: its initial velocity, or a value prescribed at t = 0, is not finite")
    system.start_works()


def _part(scene: Scene, bodies: Sequence[BodyRun]) -> None:
    """Warn of bodies that overlap at the start. Raises Refused where contact is to keep them apart."""
    touching = {frozenset(contact.names) for contact in scene.contact}
    solids = [solid_of(run.system.geometry, at_nodes=True) for run in bodies] if len(bodies) > 1 else []
    for (one, solid), (other, beside) in combinations(zip(bodies, solids, strict=False), 2):
        place = overlapping(solid, beside)
        if place is None:
            continue
        names = one.body.name, other.body.name
        where = (
            f"bodies {names[0]!r} and {names[1]!r} overlap at ({', '.join(f'{x:.4g}' for x in place)}) m from the start"
        )
        if frozenset(names) in touching:
            raise Refused(f"{where}: contact keeps apart what is apart; move or shorten one of them")
        warnings.warn(
            f"{where}: nothing acts between them; move one, or write [[contact]] between = {json.dumps(names)} where they are to touch",
            RuntimeWarning,
            stacklevel=4,
        )


def _push(bodies: Sequence[BodyRun], between: Sequence[Interaction]) -> None:
    """Lower the limits of the bodies that something pushes."""
    for run in bodies:
        frequency = math.hypot(*(each.frequency(run.body.name) for each in between))
        if frequency > 0.0:
            run.stability.push(frequency)


def _guard(
    setting: Setting, bare: Sequence[BareBody], bodies: Sequence[BodyRun], space: Space, time_step: TimeStep
) -> None:
    """Refuse, or warn of, a time step that a body cannot take; note the share of its limit that it begins with."""
    steps, ticks = time_step.timeline.last, time_step.clock.dt
    for each, run in zip(bare, bodies, strict=True):

        def double(each: BareBody = each, run: BodyRun = run) -> BodyRun:
            if space.precision == "f64":
                return run
            again = TimeStep(Clock(ticks, time_step.clock.device), time_step.timeline)
            return _body_run(setting, each, Space(space.dim), again)

        with blame(setting.method.who, integrators.SIGNATURE):
            guard(setting.scene, run, time_step.dt, steps, double)
        run.stability.share = run.courant / run.limit if run.limit else 1.0


def _probes(scene: Scene, bodies: Sequence[BodyRun], space: Space, time_step: TimeStep) -> list[Recorder]:
    """The recorders of a scene's probes; those of nearly every step are part of the steps."""

    def cadence(every: float) -> float:
        return every if isinstance(every, int) else every / time_step.dt

    return [
        Recorder(probe, f"probes.{k}", bodies, space, time_step.clock, every_step=cadence(probe.every) < 2.0)
        for k, probe in enumerate(scene.probes)
    ]


def _refuse(body: Body, material: Material, method: Method, who: str) -> None:
    """Refuse by name what a formulation cannot do."""
    formulation, traits = method.formulation, method.formulation.traits
    if traits.needs_rate and not gives(material, "rate"):
        raise Refused(
            f"{who} has a total law alone; the {formulation.name} form needs a rate: use run.formulation of one set"
        )
    if body.map is not None and not traits.maps:
        able = " and ".join(each.name for each in FORMULATIONS if each.traits.maps)
        raise Refused(f"body {body.name!r}: the {formulation.name} form needs a regular lattice: `map` is for {able}")
    for key, part in body.parts.items():
        if part.acts and not part.fits(traits):
            here = f"{formulation.name!r}" if formulation.sets == 1 else f"the two sets of {method.name}"
            raise Refused(
                f"body {body.name!r}: {key} is a part of the one-set form {' and '.join(each.name for each in FORMULATIONS if part.fits(each.traits))}, not of {here}:"
                f" choose run.formulation, or leave bodies.{key} out"
            )
