"""Likely slips of units: scenes that are valid, and whose numbers no solid has. Said before a run, with the way out.

A number that is right can look unlikely: nothing is refused. Scenes without units, of density and modulus one, pass.
"""

# pyright: strict

import math
from collections.abc import Iterator, Sequence

import numpy as np

from wsph.boundary.loads.rows import FORCE, whole_area
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import UNITS
from wsph.boundary.selections import chosen
from wsph.expressions import Expression
from wsph.geometry.shapes.stl import Stl
from wsph.plugins.declared import strengths
from wsph.quantities import Value
from wsph.scene.messages import LARGE, size_in_words
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import BodyRun

FASTEST = 20e3
"""Waves [m/s] that are faster than in diamond."""

LIGHT = 30.0
"""A density [kg/m3] that no solid has, and many have in g/cm3."""

HEAVY, SOFT = 100.0, 2000.0
"""A density of solids from here on [kg/m3], and a modulus [Pa] below that of gels, which many solids have in GPa."""

WEAK = 1e-6
"""A strength, in moduli, below that of any solid."""

PULLED = 2.0
"""A stress that is prescribed, in moduli, that few bodies bear."""

PULL = 1000.0
"""A gravity [m/s2] that few bodies meet, and that of the earth in mm/s2 has."""

FEW, MANY = 3, 3_000_000
"""Steps of a run that is hardly one, and of a run that does not end."""

TIMES, PLACES = 101, 16
"""At how many times and places an expression is looked at."""


def slips(scene: Scene, bodies: Sequence[BodyRun], dt: float, steps: int) -> Iterator[str]:
    """What is unlikely in a scene whose steps are of `dt` [s]."""
    for k, run in enumerate(bodies):
        yield from _of_size(run, f"bodies.{k}")
        yield from _of_matter(run, f"bodies.{k}.material")
        yield from _of_start(run, f"bodies.{k}.velocity")
    for axis, value in scene.gravity.items():
        if (most := _largest(scene, bodies[0], value, "m/s2")) > PULL:
            yield f'gravity.{axis}: {most:g} m/s2 is {most / 9.81:.3g} times that of the earth: is it in mm/s2 (write "{most:g} mm/s2")?'
    by_name = {run.body.name: run for run in bodies}
    for k, condition in enumerate(scene.boundary):
        run = by_name[condition.body]
        for axis, value in condition.velocity.items():
            most = _largest(scene, run, value, UNITS["velocity"])
            yield from _too_fast(run, most, f"boundary.{k}.velocity.{axis}", "m/s")
        pressure = {"": condition.acting["pressure"].model_dump()["value"]} if "pressure" in condition.acting else {}
        for key, table in (("stress", condition.stress), ("traction", condition.traction), ("pressure", pressure)):
            for component, value in table.items():
                most = _largest(scene, run, value, "Pa")
                yield from _too_much(run, most, f"boundary.{k}.{key}.{component}".removesuffix("."))
    for run in bodies:
        yield from _of_forces(scene, run)
    for k, tool in enumerate(scene.tools):
        if isinstance(tool.shape, Stl) and tool.shape.unscaled:
            yield from _unscaled(f"tools.{k}.shape", tool.name, np.ptp(tool.shape.bounds(), axis=0))
        given = tool.velocity
        prescribed: list[Value] = list(given.values() if isinstance(given, dict) else given)
        touched = [by_name[name] for name in tool.against if name in by_name]
        for run in touched[:1]:
            sizes = [_largest(scene, run, each, "m/s") for each in prescribed]
            most = max(sizes, default=0.0)
            yield from _too_fast(run, most, f"tools.{k}.velocity", "m/s")
    yield from _of_time(scene, bodies, dt, steps)


def _of_forces(scene: Scene, run: BodyRun) -> Iterator[str]:
    """Total forces on a body, over the areas that they act on."""
    if not any(each.force for each in scene.boundary if each.body == run.body.name):
        return
    geometry = run.system.geometry
    for k, condition, _, rows in chosen(scene, run.body.name, geometry, run.system.position):
        for axis, value in condition.force.items():
            most = _largest(scene, run, value, FORCE[scene.dim]) / max(whole_area(geometry, rows), np.finfo(float).tiny)
            yield from _too_much(run, most, f"boundary.{k}.force.{axis}, over its faces")


def _of_size(run: BodyRun, key: str) -> Iterator[str]:
    if table := run.body.unscaled:
        low, high = run.bounds
        yield from _unscaled(f"{key}.{table}", run.body.name, high - low)


def _unscaled(key: str, name: str, sides: np.ndarray) -> Iterator[str]:
    """What is unlikely about the `sides` [m] of what comes from a file without a scale."""
    if sides.max() > LARGE:
        yield f"{key}: {size_in_words(name, sides.tolist(), unscaled=True)}"


def _of_matter(run: BodyRun, key: str) -> Iterator[str]:
    material, modulus, speed = run.constitutive.material, run.constitutive.youngs_modulus, run.constitutive.wave_speed
    density = material.density
    if speed > FASTEST:
        waves = f"makes waves of {speed / 1e3:.3g} km/s, faster than in any solid (diamond: 18 km/s)"
        if density < LIGHT:
            grams = f'"{density:g} g/cm3" is {1e3 * density:g} kg/m3'
            yield f"{key}: a density of {density:g} kg/m3 with a modulus of {modulus:.3g} Pa {waves}: {grams}"
        else:
            yield f"{key}: a modulus of {modulus:.3g} Pa with {density:g} kg/m3 {waves}: is it in MPa, or kPa?"
    elif density >= HEAVY and modulus < SOFT:
        yield (
            f"{key}: a modulus of {modulus:.4g} Pa with {density:g} kg/m3 makes waves of {speed:.3g} m/s, slower than in a gel:"
            f' is it "{modulus:.4g} GPa", or MPa?'
        )
    for name, value in strengths(material).items():
        if value > modulus:
            yield f"{key}.{name}: {value:.4g} Pa is above Young's modulus, {modulus:.4g} Pa: is it in MPa?"
        elif 0.0 < value < WEAK * modulus:
            yield f"{key}.{name}: {value:.4g} Pa is {value / modulus:.1g} of Young's modulus, {modulus:.4g} Pa: is it in MPa?"


def _of_start(run: BodyRun, key: str) -> Iterator[str]:
    if run.body.velocity is None:
        return
    speeds = np.linalg.norm(run.system.state.read("velocity"), axis=1) * run.system.scales.velocity
    most = run.system.domain.max(speeds.max(initial=0.0, keepdims=True))
    yield from _too_fast(run, float(most[0]), key, "m/s")


def _too_fast(run: BodyRun, most: float, key: str, unit: str) -> Iterator[str]:
    speed = run.constitutive.wave_speed
    if most > speed:
        yield (
            f"{key}: {most:.4g} {unit} is {most / speed:.3g} times the speed of waves in body {run.body.name!r}, {speed:.4g} m/s:"
            ' is it in mm/s (write "1 mm/s")? A law without an equation of state is not made for shocks of that strength'
        )


def _too_much(run: BodyRun, most: float, key: str) -> Iterator[str]:
    modulus = run.constitutive.youngs_modulus
    if most > PULLED * modulus:
        yield (
            f"{key}: {most:.4g} Pa is {most / modulus:.3g} times Young's modulus of body {run.body.name!r}, {modulus:.4g} Pa:"
            " it would be torn or crushed; which of both has the wrong unit?"
        )


def _of_time(scene: Scene, bodies: Sequence[BodyRun], dt: float, steps: int) -> Iterator[str]:
    crossing = min(_extent(run) / run.constitutive.wave_speed for run in bodies)
    said = f"a wave crosses the body in {crossing:.3g} s, a step is {dt:.3g} s"
    if scene.steps:
        return
    if steps <= FEW:
        yield f"run.end: the run is {steps} step{'s' * (steps > 1)} of {dt:.3g} s: {said}; is the end of {scene.end:g} s in ms or us, or a length in mm?"
    elif steps > MANY:
        yield (
            f"run.end: {steps:.2g} steps of {dt:.3g} s to the end of {scene.end:g} s, {scene.end / crossing:.2g} times that in which a"
            f" wave crosses the body: is it in ms or us? At rest in the end, [relax] finds the rest"
        )


def _extent(run: BodyRun) -> float:
    """The longest side of a body's bounds [m]."""
    low, high = run.bounds
    return float((high - low).max()) + run.system.spacing


def _largest(scene: Scene, run: BodyRun, value: Value, unit: str) -> float:
    """The largest size of a prescribed value in the run, at some places of what each process has of a body."""
    made = scene.value(value, unit)
    if isinstance(made, Function):
        return max(map(abs, made.column))
    place = run.system.position
    some = place[:: max(len(place) // PLACES, 1)]
    times: list[float] = np.linspace(0.0, scene.end, TIMES).tolist() if made.uses("t") else [0.0]
    sizes = np.array([_size(made, some, time) for time in times])
    return float(run.system.domain.max(sizes).max())


def _size(made: Expression, place: np.ndarray, time: float) -> float:
    size = float(np.abs(made(place, time)).max())
    return size if math.isfinite(size) else 0.0
