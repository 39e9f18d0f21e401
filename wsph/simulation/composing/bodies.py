"""Bodies of a composition: their systems, and those that step by themselves with their integrators and limits."""

# pyright: strict
# pyright: reportUnknownArgumentType=false

from dataclasses import dataclass
from typing import cast

import numpy as np

from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.moduli import warn_of_lost_digits
from wsph.constitutive.sampling import fault_of_law, law_named
from wsph.doubts import doubt
from wsph.errors import PluginError, Refused
from wsph.expressions import Expression
from wsph.formulations.reading import DENSITY, Reading
from wsph.formulations.sections import cut
from wsph.formulations.setup import Setup
from wsph.formulations.system import System
from wsph.geometry.meshes.inspection import doubts
from wsph.output import fields
from wsph.plugins import integrators
from wsph.plugins.blame import blame
from wsph.plugins.formulations import FORMULATIONS
from wsph.plugins.traits import gives, turns
from wsph.protocols import Integrator, Material
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composing.composition import BodyRun
from wsph.simulation.composing.setting import BareBody, Method, Setting
from wsph.simulation.diagnostics import Diagnostics
from wsph.simulation.starting.initial import put_stress, refuse_initial
from wsph.simulation.timeline import TimeStep
from wsph.stability.limit import Ask, StepLimit
from wsph.stability.stiffening import Stiffening


def wants_displacement(scene: Scene) -> bool:
    """Whether a probe or a frame asks for the displacement, or for the density, which may follow from it; or there are
    bodies or tools that may meet."""
    wanted = [*scene.output.fields, *(f for probe in scene.probes for f in probe.fields)]
    return (
        len(scene.bodies) > 1
        or bool(scene.tools)
        or any(base in ("displacement", DENSITY) for name in wanted for base in fields.primitives(name, scene.formulas))
    )


@dataclass(frozen=True)
class Standing:
    """A body with its system, before it has an integrator."""

    bare: BareBody
    constitutive: Constitutive
    system: System

    @property
    def body(self) -> Body:
        """Its table in the scene."""
        return self.bare.body

    @property
    def crossing(self) -> float:
        """The time that a wave takes over a spacing [s]."""
        return self.system.spacing / self.constitutive.wave_speed

    def by(self, integrator: Integrator, ask: Ask, time_step: TimeStep) -> BodyRun:
        """The body in a run, stepped by an integrator; `ask` gives the limit of its Courant number."""
        system, traits, bare = self.system, self.system.traits, self.bare
        stiffened = None
        if traits.measures:
            kind = system.total, system.breaks, system.domain
            stiffened = Stiffening(self.constitutive, system.state, system.point_share, *kind).found
        limit = StepLimit(ask, system, traits.courant_follows, stiffened, traits.clumps)
        # A law that gives no numbers leaves no frequency, and so no time step that its integrator could take.
        lost = limit.value == 0.0 and traits.measures and not np.isfinite(system.frequency)
        if lost and (fault := fault_of_law(bare.material, bare.who)):
            raise PluginError(fault)
        diagnostics = Diagnostics(
            system.space,
            self.constitutive,
            system.volume,
            system.point_volume,
            system.density,
            system.device,
            system.response,
            system.breaks,
            traits.courant_follows,
            system.domain,
            system.total,
            (system.share, system.point_share),
        )
        return BodyRun(bare.body, self.constitutive, system, integrator, diagnostics, limit, time_step, Reading(system))


def standing(setting: Setting, bare: BareBody, space: Space, time_step: TimeStep) -> Standing:
    """A body with its system, as it is at the start."""
    scene, method, scales, clock = setting.scene, setting.method, setting.scales, time_step.clock
    body = bare.body
    traits = method.formulation.traits
    evolves = not traits.small_strain and (traits.needs_rate or turns(bare.material))
    constitutive = Constitutive(space, bare.material, bare.state, scales, bare.who, evolves=evolves)
    _refuse(body, bare.material, method, bare.who)
    refuse_initial(body)
    warn_of_lost_digits(body.name, bare.material, space, bare.who)
    setup = Setup(
        scene, body, method.formulation, bare.geometry, space, constitutive, scales, clock, wants_displacement(scene)
    )
    for part in setup.host.parts.values():
        if warning := part.warning(setup.host):
            doubt(warning, stacklevel=6)
    with law_named(bare.material, bare.who):
        system = cast(System, method.formulation.build(setup))
    told = (f"body {body.name!r}: {each}" for each in doubts(bare.geometry))
    for warning in (*told, *system.warnings):
        doubt(warning, stacklevel=6)
    _start(scene, body, system)
    system.sections = cut(system, [each for each in enumerate(scene.sections) if each[1].body == body.name])
    return Standing(bare, constitutive, system)


def alone(setting: Setting, made: Standing, time_step: TimeStep, *, bounded: bool = True) -> BodyRun:
    """A body that steps by itself, with its integrator and, where it is to be `bounded`, its limit."""
    method, bare = setting.method, made.bare
    with law_named(bare.material, bare.who), blame(method.who, integrators.SIGNATURE):
        integrator = method.on(made.system)

        def ask() -> tuple[float | None, str]:
            with blame(method.who, integrators.SIGNATURE):
                return integrators.limit(integrator) if bounded else (None, "it is not asked for")

        # The limit first, which is found in states that hold nothing yet.
        run = made.by(integrator, ask, time_step)
        integrators.begin(integrator)
        return run


def give_velocity(scene: Scene, body: Body, system: System) -> None:
    """Give a system its initial velocity."""
    if body.velocity is not None:
        velocity = np.zeros((system.count, scene.dim), system.space.numpy)
        for k, given in enumerate(body.velocity):
            value = scene.value(given, "m/s")
            if isinstance(value, Expression):
                velocity[:, k] = value(system.position) / system.scales.velocity
        system.state.write("velocity", velocity)
    system.begin()


def _start(scene: Scene, body: Body, system: System) -> None:
    """Give a system its initial velocity and what is prescribed at t = 0."""
    put_stress(scene, body, system)
    give_velocity(scene, body, system)
    system.hold(system.state, 0.0)
    held: list[np.ndarray] = [array.numpy() for array in (system.state.buffer, *system.arrays.kept.values())]
    if not all(np.isfinite(values).all() for values in held):
        raise Refused(f"body {body.name!r}: its initial velocity, or a value prescribed at t = 0, is not finite")
    if scene.relaxes_first:
        system.state.write("velocity", np.zeros((system.count, scene.dim)))
    system.start_works()


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
