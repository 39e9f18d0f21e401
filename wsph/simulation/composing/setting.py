"""What all bodies of a composition share, before they have systems: materials, method, geometries, scales."""

# pyright: strict
# pyright: reportUnknownArgumentType=false

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from wsph.backend.domain import WHOLE, Domain
from wsph.constitutive.moduli import wave_speed
from wsph.constitutive.stress_state import STRESS_STATES, StressState
from wsph.errors import Fault, PluginError, Refused, SceneError
from wsph.geometry.cells import listed_weight
from wsph.geometry.geometry import Geometry
from wsph.plugins import integrators, registry
from wsph.plugins.blame import blame
from wsph.plugins.formulations import Formulation, of_sets
from wsph.plugins.formulations import offered as worked_in
from wsph.plugins.options import build
from wsph.protocols import Integrator, Material
from wsph.scene.geometries import geometry_of
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.units import Scales


def materials_of(scene: Scene) -> list[Material]:
    built: list[Material] = []
    for k, body in enumerate(scene.bodies):
        material, faults = build(
            "materials", body.material.model, body.material.options(), f"bodies.{k}.material", "model"
        )
        if faults:
            raise SceneError("scene", faults)
        built.append(cast(Material, material))
    return built


@dataclass(frozen=True)
class Method:
    """The method of a scene: the integrator's class, with the name and the distribution that messages say of it (`who`),
    its options, and the formulation that it works in."""

    plugin: type
    name: str
    who: str
    options: dict[str, object]
    formulation: Formulation

    def on(self, system: object) -> Integrator:
        """The integrator of a body. Raises SceneError where it does not take its options or the composition."""
        try:
            return cast(Integrator, self.plugin(system, **self.options))
        except ValueError as error:
            raise SceneError("scene", [Fault(0, "run.integrator", f"{self.name}: {error}")]) from None


def method_of(scene: Scene) -> Method:
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


def bare_bodies(scene: Scene, materials: Sequence[Material], method: Method, domain: Domain = WHOLE) -> list[BareBody]:
    """The bodies of a scene, or the part of each that a process has."""
    states = [STRESS_STATES[scene.dim, body.state] for body in scene.bodies]
    geometries: list[Geometry] = []
    loads = np.zeros(domain.size)
    for k, material in enumerate(materials):
        listed = listed_weight(material, scene.run.precision)
        geometries.append(geometry_of(scene, k, method.formulation, listed, domain, loads))
        loads = loads + (geometries[-1].split.work or 0.0)
    who = [
        f"material {body.material.model!r} ({registry.origin('materials', body.material.model)})"
        for body in scene.bodies
    ]
    speeds = [wave_speed(*each) for each in zip(materials, states, who, strict=True)]
    return [BareBody(*each) for each in zip(scene.bodies, materials, who, states, geometries, speeds, strict=True)]


def scales_of(bodies: Sequence[BareBody]) -> Scales:
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
