"""From a scene to a composition: bodies with their systems and integrators, one time step, one set of scales.

A composition holds what the scene asks for and nothing else. It is refused, with the reason and the way out, where its
time step lies beyond what its integrator or its material can take.
"""

import warnings
from typing import Any

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.device import pick_device
from wsph.backend.expressions import Expression, compile_expression
from wsph.backend.graph import Program
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.stress_state import STRESS_STATES, StressState
from wsph.contact.contacts import Contacts
from wsph.errors import Fault, PluginError, Refused, SceneError
from wsph.formulations.setup import Formulation, Setup
from wsph.formulations.table import FORMULATIONS, of_sets, takers
from wsph.geometry.lattice import Lattice, lattice
from wsph.output import fields
from wsph.plugins import registry
from wsph.plugins.blame import blame
from wsph.plugins.options import build
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composition import INTEGRATOR_SIGNATURE, BodyRun, Composition, publish
from wsph.simulation.diagnostics import Diagnostics
from wsph.simulation.probes import Recorder
from wsph.simulation.timeline import Timeline
from wsph.stability.guard import guard
from wsph.units import Scales

MOST_STIFFER = 1000.0
"""Bulk over shear modulus above which single precision is warned of."""


def _materials(scene: Scene) -> list[Any]:
    built = []
    for k, body in enumerate(scene.bodies):
        material, faults = build(
            "materials", body.material.model, body.material.options(), f"bodies.{k}.material", "model"
        )
        if faults:
            raise SceneError("scene", faults)
        built.append(material)
    return built


def wants_displacement(scene: Scene) -> bool:
    """Whether a probe or a frame asks for the displacement."""
    wanted = [*scene.output.fields, *(f for probe in scene.probes for f in probe.fields)]
    return any(fields.primitive(name) == "displacement" for name in wanted)


def compose(scene: Scene) -> Composition:
    """Set up a scene. Raises SceneError, Refused or PluginError; compiles the set-up's kernels, runs nothing."""
    try:
        return _compose(scene)
    except SceneError as error:
        raise scene.located(error) from None


def _compose(scene: Scene) -> Composition:
    materials = _materials(scene)
    plugin = registry.load("integrators", scene.run.integrator.name)
    who = f"integrator {scene.run.integrator.name!r} ({registry.origin('integrators', scene.run.integrator.name)})"
    systems = of_sets(getattr(plugin, "sets", 1))
    offered = getattr(plugin, "formulations", tuple(systems)[:1])
    if not callable(getattr(plugin, "step", None)) or not all(name in systems for name in offered) or not offered:
        raise PluginError(f"{who} is no integrator; expected {INTEGRATOR_SIGNATURE}")
    formulation = scene.run.formulation or offered[0]
    if formulation not in offered:
        raise Refused(
            f"run.formulation: {scene.run.integrator.name} works in {', '.join(map(repr, offered))}, not in {formulation!r}"
        )
    chosen = systems[formulation]
    device, space = pick_device(scene.run.device), Space(scene.dim, scene.run.precision)
    states = [STRESS_STATES[scene.dim, body.state] for body in scene.bodies]
    lattices = [_lattice(k, body, scene.run.seed, chosen.traits.splits_cracks) for k, body in enumerate(scene.bodies)]
    speeds = [_wave_speed(b, s, m) for b, s, m in zip(scene.bodies, states, materials, strict=True)]
    fastest = int(np.argmin([cells.spacing / c for cells, c in zip(lattices, speeds, strict=True)]))
    shortest = lattices[fastest].spacing / speeds[fastest]
    scales = Scales(lattices[fastest].spacing, shortest, materials[fastest].density)
    _refuse_extremes(scales, fastest, scene)
    dt = scene.run.dt if scene.run.dt is not None else (scene.run.cfl or 0.0) * shortest
    ticks = dt / scales.time if scene.run.dt is not None else (scene.run.cfl or 0.0)
    clock = Clock(ticks, device)

    def body_run(k: int, space: Space, clock: Clock) -> BodyRun:
        body, cells, material, state = scene.bodies[k], lattices[k], materials[k], states[k]
        return _body_run(scene, body, cells, material, state, plugin, who, chosen, space, scales, clock, device)

    bodies = [body_run(k, space, clock) for k in range(len(scene.bodies))]
    steps = Timeline(scene.run.end, dt).last
    contacts = Contacts(scene.contact, bodies, space, scales, clock, device) if scene.contact else None
    for k, run in enumerate(bodies):
        if contacts is not None and run.body.name in contacts.sides:
            run.pushed = contacts.frequency(run.body.name)
            run.measure()

        def double(k: int = k, run: BodyRun = run) -> BodyRun:
            return run if space.precision == "f64" else body_run(k, Space(space.dim), Clock(ticks, device))

        guard(scene, run, dt, steps, double)
        run.share = run.courant / run.limit if run.limit else 1.0
    probes = [
        Recorder(probe, f"probes.{k}", bodies, space, clock, every_step=_cadence_steps(probe.every, dt) < 2.0)
        for k, probe in enumerate(scene.probes)
    ]
    every_step = [p for p in probes if p.every_step]

    following: list[Any] = [run.system for run in bodies if run.system.traits.pairs_follow]
    if contacts is not None:
        following.append(contacts)

    def follow() -> bool:
        changed = [system.follow() for system in following]  # all of them, not the first that did
        return any(changed)

    def step() -> None:
        for run in bodies:
            run.integrator.step()
        if contacts is not None:
            contacts.act()
        clock.advance()
        if every_step:
            publish(bodies)
        for probe in every_step:
            probe.record()

    pairs = sum(b.system.pairs for b in bodies)
    return Composition(
        scene,
        space,
        device,
        scales,
        clock,
        dt,
        steps,
        bodies,
        probes,
        Program(step, clock, pairs, scene.run.threads, follow if following else None),
        who,
        contacts,
    )


def _lattice(number: int, body: Body, seed: int, split: bool) -> Lattice:
    cracks = tuple((crack.start, crack.end) for crack in body.cracks)
    expressions = [compile_expression(text) for text in body.map or ()]

    def mapped(points: np.ndarray) -> np.ndarray:
        return np.stack([expression(points) for expression in expressions], 1)

    try:
        return lattice(body.shape, body.spacing, body.jitter, seed, lattice_rotate=body.lattice_rotate, cracks=cracks,
                       split=split, map=mapped if expressions else None)  # fmt: skip
    except ValueError as error:
        key = "spacing" if "no cell" in str(error) else "map" if "the map" in str(error) else "cracks"
        raise SceneError("scene", [Fault(0, f"bodies.{number}.{key}", str(error))]) from None


def _refuse_extremes(scales: Scales, fastest: int, scene: Scene) -> None:
    """Numbers so far out that their powers leave double precision have no scales to compute in."""
    with np.errstate(all="ignore"):
        parts = np.array([scales.length, scales.time, scales.density])
        powers = np.array(
            [scales.density * scales.length**2 / np.float64(scales.time) ** 2, scales.density * scales.length**5]
        )
    if not ((parts > 1e-150) & (parts < 1e150)).all() or not (np.isfinite(powers) & (powers > 0.0)).all():
        sizes = (
            f"spacing {scales.length:g} m, spacing over wave speed {scales.time:g} s, density {scales.density:g} kg/m3"
        )
        raise Refused(
            f"body {scene.bodies[fastest].name!r}: {sizes} are too far out to compute with in double precision"
        )


def _material_name(body: Body) -> str:
    return f"material {body.material.model!r} ({registry.origin('materials', body.material.model)})"


def _wave_speed(body: Body, state: StressState, material: Any) -> float:
    with blame(
        _material_name(body), "moduli(self) -> (bulk modulus, shear modulus) [Pa], both above zero, and density"
    ):
        bulk, shear = material.moduli()
        if not (np.isfinite([bulk, shear]).all() and bulk > 0.0 and shear > 0.0):
            raise Refused(f"{_material_name(body)}: its moduli {bulk:g} and {shear:g} Pa are not finite and above zero")
        speed = state.wave_speed(bulk, shear, material.density)
    if not (np.isfinite(speed) and speed > 0.0):
        raise Refused(f"{_material_name(body)}: its wave speed {speed:g} m/s is not finite and above zero")
    return speed


def _cadence_steps(every: float, dt: float) -> float:
    return every if isinstance(every, int) else every / dt


def _body_run(scene: Scene, body: Body, cells: Lattice, material: Any, state: Any, plugin: Any, who: str, formulation: Formulation,
              space: Space, scales: Scales, clock: Clock, device: str) -> BodyRun:  # fmt: skip
    constitutive = Constitutive(space, material, state, scales, _material_name(body))
    _warn_of_lost_digits(body, material, space, constitutive.who)
    _refuse_parts(body, material, formulation, scene.run.integrator.name, constitutive.who)
    system = formulation.build(
        Setup(scene, body, formulation, cells, space, constitutive, scales, clock, wants_displacement(scene))
    )
    if body.velocity is not None:
        values = [scene.value(v, "m/s") for v in body.velocity]
        columns = [value(system.position) for value in values if isinstance(value, Expression)]
        system.state.write("velocity", np.stack(columns, 1) / scales.velocity)
    system.hold(system.state, 0.0)
    if not np.isfinite(system.state.buffer.numpy()).all():
        raise Refused(f"body {body.name!r}: its initial velocity, or a value prescribed at t = 0, is not finite")
    system.start_works()
    with blame(who, INTEGRATOR_SIGNATURE):
        try:
            integrator = plugin(system, **scene.run.integrator.options())
        except ValueError as error:  # an option or a composition that the integrator does not take
            raise SceneError("scene", [Fault(0, "run.integrator", f"{scene.run.integrator.name}: {error}")]) from None
        if hasattr(integrator, "begin"):
            integrator.begin()
        limit, reason = integrator.limit() if hasattr(integrator, "limit") else (None, "the integrator declares none")
    diagnostics = Diagnostics(
        space,
        constitutive,
        system.volume,
        system.point_volume,
        system.density,
        device,
        system.response,
        system.breaks,
        system.traits.courant_follows,
    )
    courant = clock.dt * scales.time * constitutive.wave_speed / cells.spacing
    return BodyRun(body, constitutive, system, integrator, diagnostics, courant, limit, reason)


def _warn_of_lost_digits(body: Body, material: Any, space: Space, who: str) -> None:
    """Single precision has seven digits for a stress; where the bulk modulus is far above the shear modulus few of them are
    left for the deviator."""
    bulk, shear = material.moduli()
    if space.precision == "f32" and bulk > MOST_STIFFER * shear:
        digits = 7.2 - np.log10(bulk / shear)
        warnings.warn(
            f"body {body.name!r}: the bulk modulus of {who} is {bulk / shear:.3g} times its shear modulus: in single precision"
            f' about {max(digits, 0.0):.1f} digits are left for shear stresses; use run.precision = "f64", or a smaller poisson_ratio',
            RuntimeWarning,
            stacklevel=5,
        )


def _refuse_parts(body: Body, material: Any, formulation: Formulation, integrator: str, who: str) -> None:
    """What a formulation cannot do is refused by name."""
    traits = formulation.traits
    if not hasattr(material, "rate") and traits.needs_rate:
        raise Refused(
            f"{who} has a total law alone; the {formulation.name} form needs a rate: use run.formulation of one set"
        )
    if body.map is not None and not traits.maps:
        able = " and ".join(each.name for each in FORMULATIONS if each.traits.maps)
        raise Refused(f"body {body.name!r}: the {formulation.name} form needs a regular lattice: `map` is for {able}")
    for key, part in body.parts.items():
        if part.acts and not part.fits(traits):
            here = f"{formulation.name!r}" if formulation.sets == 1 else f"the two sets of {integrator}"
            raise Refused(
                f"body {body.name!r}: {key} is a part of the one-set form {' and '.join(takers(type(part)))}, not of {here}:"
                f" choose run.formulation, or leave bodies.{key} out"
            )
