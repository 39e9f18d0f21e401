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
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.device import give_back, pick_device
from wsph.backend.domain import WHOLE, Domain, any_of
from wsph.backend.graph import Program
from wsph.backend.space import Space
from wsph.contact.between import Interaction
from wsph.contact.overlap import EASED, overlapping, solid_of
from wsph.contact.refusals import refuse as refuse_contact
from wsph.contact.table import couplings, interactions
from wsph.doubts import doubt, keeping
from wsph.errors import Refused, SceneError
from wsph.formulations import memory
from wsph.formulations.system import System
from wsph.formulations.updated.sharing.anew import Anew, Remade
from wsph.geometry.geometry import Geometry
from wsph.plugins import integrators
from wsph.plugins.blame import blame
from wsph.protocols import Material
from wsph.reporting import Reported
from wsph.scene.geometries import is_fitted, refuse_misfits, stairs_in_words
from wsph.scene.probes import Probe
from wsph.scene.scene import Scene
from wsph.simulation.composing.bodies import Standing, alone, standing
from wsph.simulation.composing.composition import BodyRun, Composition, Step, reported, shared_numbers
from wsph.simulation.composing.idle import idle
from wsph.simulation.composing.setting import BareBody, Method, Setting, bare_bodies, materials_of, method_of, scales_of
from wsph.simulation.composing.shared import refuse_shared, refuse_whole
from wsph.simulation.composing.slips import slips
from wsph.simulation.composing.stairs import stepped
from wsph.simulation.composing.together import joined_bodies, stiffen
from wsph.simulation.probing.numbers import NumberRecorder
from wsph.simulation.probing.placed import PlacedRecorder
from wsph.simulation.probing.points import PointRecorder
from wsph.simulation.probing.reach import keeper, reach_probes
from wsph.simulation.probing.read_in import read_by
from wsph.simulation.probing.recorder import Recorder
from wsph.simulation.probing.reduced import ReducedRecorder, needs_places
from wsph.simulation.probing.shared_numbers import SharedNumbers
from wsph.simulation.starting.from_file import put_states
from wsph.simulation.step_control import given_step, settle
from wsph.simulation.timeline import TimeStep
from wsph.stability.guard import guard


def compose(scene: Scene, domain: Domain = WHOLE, remade: Mapping[str, Remade] | None = None) -> Composition:
    """Set up a scene, or the part of it that this process has of a `domain`; `remade` says of bodies by their names what
    they are made anew by. Raises SceneError, Refused or PluginError; compiles the set-up's kernels, runs nothing."""
    remade = dict(remade or {})
    try:
        while True:
            try:
                with keeping([]) as said:
                    composition = _compose(scene, domain, remade)
                composition.said = said
                return composition
            except Anew as anew:
                remade = anew.after(remade)
    except SceneError as error:
        raise scene.located(error) from None


def _compose(scene: Scene, domain: Domain, remade: Mapping[str, Remade]) -> Composition:
    materials = materials_of(scene)
    method = method_of(scene)
    _refuse_relaxing(scene, method)
    device, space = pick_device(scene.run.device, domain.place()), Space(scene.dim, scene.run.precision)
    if any_of(domain, device != "cpu") and any_of(domain, device == "cpu"):
        raise Refused(
            f"run.device: {scene.run.device!r} is a GPU for some of the processes and none for others: name it"
        )
    refuse_contact(scene, method.formulation)
    refuse_misfits(scene, method.formulation)
    if domain.size > 1:
        refuse_shared(scene, method)
    else:
        memory.refuse_too_large(scene, device, _first_system, lambda body: is_fitted(scene, body, method.formulation))
    bare = _bodies(scene, materials, method, domain, remade)
    scales = scales_of(bare)
    time_step = given_step(scene.run, scene.end, scales.time, device, method.who)
    setting = Setting(scene, method, scales)
    made = [standing(setting, each, space, time_step) for each in bare]
    give_back(sum(each.system.count for each in made))
    put_states(scene, made)
    _part(scene, made)
    once = integrators.once(method.plugin)
    forces = couplings(scene, made, space, scales, time_step.clock, once=once)
    joint, together = joined_bodies(setting, made, forces, time_step)
    driven = [tool.name for tool in scene.tools if not tool.free]
    if scene.relaxes and (own := [name for force in forces for name in force.members() if name not in driven]):
        raise Refused(f"relax: {own[0]!r} moves by itself, and relaxation stops bodies alone: prescribe its motion")
    bodies = [together.get(each.body.name) or alone(setting, each, time_step) for each in made]
    between = interactions(scene, bodies, space, scales, time_step.clock)
    _push(bodies, between)
    with blame(method.who, integrators.SIGNATURE):
        settle(time_step, bodies, scales.time, method.who)
        if joint is not None:
            stiffen(setting, joint, list(together.values()))
    # Before a step is refused: what has the wrong unit may be why.
    steps = time_step.timeline.last
    hints = (
        *slips(scene, bodies, time_step.dt, steps),
        *idle(scene, bodies, time_step.dt),
        *stepped(scene, bodies),
    )
    for said in domain.common(hints):
        doubt(f"unlikely: {said}", stacklevel=4)
    _guard(setting, bare, bodies, space, time_step, set(together))
    probes = _probes(setting, bodies, reported(bodies, (*between, *forces)), space, time_step, domain)
    step = Step(bodies, joint, between, time_step.clock, [probe for probe in probes if probe.every_step])
    pairs = sum(int(run.system.domain.sum(np.array([run.system.pairs]))[0]) for run in bodies)
    hosted, threads, on = domain.size > 1, scene.run.threads, domain.cores()
    if hosted:  # as many as it has cores of its own: threads that share one wait for each other
        threads = min(threads or len(on), len(on)) or 1
    program = Program(step, time_step.clock, pairs, threads, step.before, hosted=hosted, on=on)
    return Composition(
        scene,
        space,
        scales,
        time_step,
        bodies,
        joint,
        between,
        probes,
        program,
        method.who,
        domain,
        pairs,
        dict(remade),
    )


def _bodies(
    scene: Scene, materials: Sequence[Material], method: Method, domain: Domain, remade: Mapping[str, Remade]
) -> list[BareBody]:
    """The bodies of a scene, or the part of each that this process has."""
    if domain.size == 1:
        return bare_bodies(scene, materials, method)
    bare = [
        replace(each, geometry=_again(each.geometry, remade.get(each.body.name, Remade())))
        for each in bare_bodies(scene, materials, method, domain)
    ]
    refuse_whole(scene, [each.geometry.split.domain.size > 1 for each in bare], domain.size)
    return reach_probes(scene, bare, domain)


def _again(geometry: Geometry, by: Remade) -> Geometry:
    """The geometry of a body that is made anew."""
    cut = geometry if by.visits is None else geometry.cut_by(by.visits)
    return cut if by.layers is None else cut.seeing(by.layers)


def _refuse_relaxing(scene: Scene, method: Method) -> None:
    """Refuse to relax bodies whose rest would depend on the way there."""
    if scene.relaxes and not method.formulation.traits.one_set:
        raise Refused(
            f"relax: the stress of two sets is integrated with the dissipation of every step, so that the rest which {method.name}"
            " comes to is not that of its displacements: use an integrator of one set, such as leapfrog"
        )


def memory_need(scene: Scene) -> memory.Need:
    """The memory that the bodies of a scene will take, by small ones of the same form. Raises as `compose` does."""
    form = method_of(scene).formulation
    device = pick_device(scene.run.device)
    return memory.estimate(scene, device, _first_system, lambda body: is_fitted(scene, body, form))


def stairs(scene: Scene) -> dict[str, str]:
    """Where the surface of a body is in steps of a cell, and why, by the bodies' names: of those of which it is."""
    form = method_of(scene).formulation
    told = {body.name: stairs_in_words(scene, body, form) for body in scene.bodies}
    return {name: said for name, said in told.items() if said}


def _first_system(scene: Scene, bounded: bool) -> System:
    """The system of a scene's first body by itself. `bounded`: with the limit of its time step."""
    method, space = method_of(scene), Space(scene.dim, scene.run.precision)
    bare = bare_bodies(scene, materials_of(scene), method)
    scales = scales_of(bare)
    time_step = given_step(scene.run, scene.end, scales.time, pick_device(scene.run.device), method.who)
    setting = Setting(scene, method, scales)
    return alone(setting, standing(setting, bare[0], space, time_step), time_step, bounded=bounded).system


def _part(scene: Scene, bodies: Sequence[Standing]) -> None:
    """Warn of bodies that overlap at the start. Raises Refused where contact is to keep them apart."""
    for contact in (each for each in (*scene.contact, *scene.tools) if each.warning):
        doubt(contact.warning, stacklevel=4)
    touching = {frozenset(contact.names): contact.law for contact in scene.contact}
    pairs = list(combinations(range(len(bodies)), 2))
    laws = [touching.get(frozenset(bodies[k].body.name for k in pair)) for pair in pairs]

    solids = [solid_of(run.system.geometry, at_nodes=True) for run in bodies] if pairs else []
    for pair, law in zip(pairs, laws, strict=True):
        one, other = (solids[k] for k in pair)
        wide = max(one.geometry.spacing, other.geometry.spacing)
        place = overlapping(one, other, EASED.get(law or "", 0.0) * wide)
        names = [bodies[k].body.name for k in pair]
        if place is None:
            continue
        where = (
            f"bodies {names[0]!r} and {names[1]!r} overlap at ({', '.join(f'{x:.4g}' for x in place)}) m from the start"
        )
        if law is not None:
            raise Refused(f"{where}: contact keeps apart what is apart; move or shorten one of them")
        doubt(
            f"{where}: nothing acts between them; move one, or write [[contact]] between = {json.dumps(names)} where they are to touch",
            stacklevel=4,
        )


def _push(bodies: Sequence[BodyRun], between: Sequence[Interaction]) -> None:
    """Lower the limits of the bodies that something pushes."""
    for run in bodies:
        frequency = math.hypot(*(each.frequency(run.body.name) for each in between))
        if frequency > 0.0:
            run.stability.push(frequency)


def _guard(
    setting: Setting,
    bare: Sequence[BareBody],
    bodies: Sequence[BodyRun],
    space: Space,
    time_step: TimeStep,
    together: set[str],
) -> None:
    """Refuse, or warn of, a time step that a body cannot take; note the share of its limit that it begins with. Bodies that
    step `together` with others are tried by themselves."""
    steps, ticks = time_step.timeline.last, time_step.clock.dt
    for each, run in zip(bare, bodies, strict=True):

        def double(each: BareBody = each, run: BodyRun = run) -> BodyRun:
            if space.precision == "f64" and run.body.name not in together:
                return run
            again = TimeStep(Clock(ticks, time_step.clock.device), time_step.timeline)
            return alone(setting, standing(setting, each, Space(space.dim), again), again)

        with blame(setting.method.who, integrators.SIGNATURE):
            # Of one set processes that share a body have none to themselves.
            able = run.system.domain.size == 1 or not run.system.traits.one_set
            guard(setting.scene, run, time_step.dt, steps, double if able else None)
        run.stability.share = run.courant / run.limit if run.limit else 1.0


def _probes(
    setting: Setting,
    bodies: Sequence[BodyRun],
    numbers: Sequence[Reported],
    space: Space,
    time_step: TimeStep,
    domain: Domain,
) -> list[Recorder]:
    """The recorders of a scene's probes; those of nearly every step are part of the steps."""

    def cadence(every: float) -> float:
        return every if isinstance(every, int) else every / time_step.dt

    def made(probe: Probe, key: str) -> Recorder:
        often, clock = cadence(probe.every) < 2.0, time_step.clock
        if probe.of is None:
            formulas = setting.scene.formulas
            kind = ReducedRecorder if needs_places(probe, formulas) else PointRecorder

            def here(able: Sequence[BodyRun] = bodies) -> Recorder:
                return kind(probe, key, able, space, clock, often, formulas)

            if domain.size > 1:
                able = read_by(probe, key, bodies, [run.system.geometry for run in bodies])
                by = keeper(probe, [run.system.geometry for run in able])
                return PlacedRecorder(probe, clock, often, domain, by, partial(here, able))
            return here()
        if probe.of in shared_numbers(bodies):
            return SharedNumbers(probe, key, numbers, setting.scales, clock, space.dim, often, domain)
        return NumberRecorder(probe, key, numbers, setting.scales, clock, space.dim, often)

    return [made(probe, f"probes.{k}") for k, probe in enumerate(setting.scene.probes)]
