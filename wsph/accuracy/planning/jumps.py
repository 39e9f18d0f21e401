"""What of a scene jumps: values that step in time or begin at once, and motions that no neighbour shares at the start.

Beside a jump no scheme of this program has an order above one, and mostly about a half."""

# pyright: strict

from collections.abc import Iterator

import numpy as np

from wsph.boundary.loads.rows import FORCE
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import UNITS
from wsph.boundary.tables import Boundary
from wsph.expressions import Expression
from wsph.quantities import Value
from wsph.scene.scene import Scene
from wsph.scene.tables import Body

TIMES, PLACES = 4001, 801
"""Times of the run, and places along a line through a body, at which values are looked at."""

STEEP = 0.2
"""Change between two looks, as a part of the range of a value, from which it jumps."""

NONE = 1e-9
"""Part of a value's range below which it is zero."""


def of_loads(scene: Scene) -> Iterator[str]:
    """Loads and prescribed motions that step, or begin at once, in words."""
    for number, condition in enumerate(scene.boundary):
        body = next(each for each in scene.bodies if each.name == condition.body)
        for key, value, unit in _values(condition, scene.dim):
            series = _over_time(scene, body, value, unit)
            size = float(np.abs(series).max(initial=0.0))
            if size > 0.0 and float(np.abs(np.diff(series)).max()) > STEEP * size:
                yield f"boundary.{number}.{key} steps"
            elif abs(series[0]) > NONE * size and _at_once(scene, condition, body, key):
                yield f"boundary.{number}.{key} begins at once"
    # Gravity and forces on a volume that begin at once leave velocities and stresses continuous: order 2 was measured.
    for number, body in enumerate(scene.bodies):
        if body.initial is not None and body.initial.stress:
            yield f"bodies.{number}.initial.stress is there at once"
    if len(scene.steps) > 1:
        yield "conditions change from one of [[steps]] to the next"


def of_motions(scene: Scene) -> Iterator[str]:
    """Initial velocities that jump inside a body, or at a face that does not share them, in words."""
    for number, body in enumerate(scene.bodies):
        if body.velocity is None or body.shape is None:
            continue
        low, high = body.shape.bounds()
        fast = [_initial(scene, body, points) for points in _lines(low, high)]
        size = max(float(np.abs(each).max()) for each in fast)
        if size > 0.0 and max(float(np.abs(np.diff(each, axis=0)).max()) for each in fast) > STEEP * size:
            yield f"bodies.{number}.velocity jumps inside the body"
        for k, condition in enumerate(scene.boundary):
            if condition.body == body.name and size > 0.0 and _parted(scene, condition, body) > STEEP * size:
                yield f"boundary.{k} holds what moves at the start"


def _values(condition: Boundary, dim: int) -> Iterator[tuple[str, Value, str]]:
    """What a condition prescribes: key, value, unit. What is fixed, and springs, begin with nothing."""
    for table, unit in (*UNITS.items(), ("stress", "Pa"), ("traction", "Pa"), ("force", FORCE[dim])):
        for component, value in getattr(condition, table).items():
            yield f"{table}.{component}", value, unit
    if condition.normal is not None:
        yield "normal", condition.normal, "m/s"
    for key, load in condition.acting.items():
        for name, unit in load.values.items():
            value = getattr(load, name)
            # Impedances and stiffnesses act on what moves.
            if value is not None and unit == "Pa":
                yield key, value, unit


def _over_time(scene: Scene, body: Body, value: Value, unit: str) -> np.ndarray:
    """A value over the run, just after its start first, in the middle of a body, (TIMES,)."""
    made, times = scene.value(value, unit), np.linspace(1e-9 * scene.end, scene.end, TIMES)
    if isinstance(made, Function):
        return np.array([made.at(float(t)) for t in times])
    place = (body.shape.middle if body.shape is not None else np.zeros(scene.dim))[None, :]
    return np.array([float(made(place, float(t))[0]) for t in times]) if made.uses("t") else made(place).repeat(TIMES)


def _at_once(scene: Scene, condition: Boundary, body: Body, key: str) -> bool:
    """Whether a value that is there from the start is not what the body begins with."""
    if key.startswith(("displacement", "acceleration")):
        return key.startswith("displacement")
    if key.startswith("velocity") and condition.face is not None and body.velocity is not None:
        return False  # `of_motions` compares it with the body's own
    return not (key.startswith(("stress", "traction", "force", "pressure")) and body.initial is not None)


def _initial(scene: Scene, body: Body, points: np.ndarray) -> np.ndarray:
    """The velocity that a body begins with, (n, dim) [m/s]."""
    parts = [scene.value(each, "m/s") for each in body.velocity or ()]
    return np.stack([part(points) for part in parts if isinstance(part, Expression)], 1)


def _lines(low: np.ndarray, high: np.ndarray) -> Iterator[np.ndarray]:
    """Points (n, dim) on lines along every axis, through the middle and aside of it, ends left out."""
    part = np.linspace(1e-6, 1.0 - 1e-6, PLACES)
    for axis in range(len(low)):
        for aside in (0.5, 0.21):
            points = np.tile(low + aside * (high - low), (PLACES, 1))
            points[:, axis] = low[axis] + part * (high - low)[axis]
            yield points


def _parted(scene: Scene, condition: Boundary, body: Body) -> float:
    """The largest difference of what a face begins with and what holds it [m/s]."""
    if condition.face is None or body.shape is None:
        return 0.0
    low, high = body.shape.bounds()
    axis = "xyz".index(condition.face[1])
    found = 0.0
    for aside in (0.5, 0.21, 0.83):
        place = low + aside * (high - low)
        place[axis] = (high if condition.face[0] == "+" else low)[axis]
        own = _initial(scene, body, place[None, :])[0]
        for name in ("xyz"[k] for k in range(scene.dim)):
            if name in condition.fixed or name in condition.velocity or condition.symmetry == name:
                made = scene.value(condition.velocity.get(name, 0.0), "m/s")
                wanted = made.at(0.0) if isinstance(made, Function) else float(made(place[None, :])[0])
                found = max(found, abs(float(own["xyz".index(name)]) - wanted))
    return found
