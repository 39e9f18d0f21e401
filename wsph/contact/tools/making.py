"""The tools of a scene, and the laws by which they meet bodies and each other."""

# pyright: strict

from collections.abc import Callable

import numpy as np

from wsph.contact.surfaces.laws import Ground, Law
from wsph.contact.surfaces.surface import Surface
from wsph.contact.tools.forms import Form, form_of, zeros3
from wsph.contact.tools.law import RigidTool, ToolLaw
from wsph.contact.tools.pairs import PairLaw
from wsph.contact.tools.rigid import Inertia, Motion, RigidBody, Start
from wsph.errors import Refused
from wsph.expressions import constant_program
from wsph.output.fields import AXES
from wsph.quantities import Value
from wsph.scene.scene import Scene
from wsph.scene.touch.tool_checks import INERTIA, MASS
from wsph.scene.touch.tools import Tool
from wsph.units import quantity

DEEP = 1e-3
"""Depth [spacings] at the start that is an overlap, and no rounding."""


def tool_laws(scene: Scene, surface: Callable[[str], Surface], ground: Ground) -> list[Law]:
    """The laws of a scene's tools. Raises Refused for a tool that lies in what it is against."""
    if not scene.tools:
        return []
    bodies = [body.name for body in scene.bodies]
    against = [name for tool in scene.tools for name in tool.against if name in bodies]
    # Tools among themselves step with a body, whichever.
    sides = {name: surface(name) for name in dict.fromkeys(against or bodies[:1])}
    finest = min(side.spacing for side in sides.values())
    tools = {tool.name: _made(scene, tool, finest, ground) for tool in scene.tools}
    of_bodies: list[ToolLaw] = []
    between: list[PairLaw] = []
    for tool in tools.values():
        for name in tool.table.against:
            if name in sides:
                of_bodies.append(ToolLaw(tool, sides[name], ground))
            else:
                between.append(_pair(tool, tools[name], ground))
    for law in of_bodies:
        _refuse_overlap(law, ground)
    for law in between:
        _refuse_nearer(law, ground)
    return [*of_bodies, *between]


def _made(scene: Scene, table: Tool, finest: float, ground: Ground) -> RigidTool:
    """A tool where it begins. `finest`: the smallest spacing of the bodies, nondimensional."""
    scales, space = ground.scales, ground.space
    form = form_of(table, scene.dim)
    turn = table.turn
    about = np.array(turn.about) if turn is not None else form.middle
    start = Start(zeros3((about - ground.origin) / scales.length), *_speeds(table, scales.velocity, scales.time))
    moved_by = _inertia(scene, table, form, ground) if table.free else _motion(scene, table)
    reach = form.reach(about) / scales.length
    body = RigidBody(table.name, moved_by, start, space, scales, ground.clock, reach)
    shape = form.on_device(about, finest * scales.length, scales.length, space, ground.clock.device)
    return RigidTool(table, form, shape, body)


def _speeds(table: Tool, velocity: float, time: float) -> tuple[np.ndarray, np.ndarray]:
    """The initial velocity and angular velocity of a free tool, nondimensional, three numbers each."""
    v = np.array(table.velocity if isinstance(table.velocity, tuple) else ()) / velocity
    spin = table.spin if table.spin is not None else 0.0
    turning = np.array(spin) if isinstance(spin, tuple) else np.array([0.0, 0.0, spin])
    return zeros3(v), turning * time


def _motion(scene: Scene, table: Tool) -> Motion:
    given = table.velocity if isinstance(table.velocity, dict) else {}
    still = constant_program(0.0)
    velocity = [scene.value(given[axis], "m/s") if axis in given else still for axis in AXES]
    if table.turn is None:
        return Motion(velocity, still, np.zeros(3))
    axis = np.array(table.turn.axis or (0.0, 0.0, 1.0))
    return Motion(velocity, scene.value(table.turn.rate, "1/s"), axis / np.linalg.norm(axis))


def _inertia(scene: Scene, table: Tool, form: Form, ground: Ground) -> Inertia:
    scales, dim = ground.scales, scene.dim
    mass = quantity(table.mass, MASS[dim])
    if table.inertia is None:
        tensor = mass * form.gyration
    else:
        tensor = np.diag(_moments(table.inertia, dim))
    unit = scales.density * scales.length**dim
    gravity = np.array([scene.gravity.get(axis, 0.0) for axis in AXES]) * scales.time / scales.velocity
    return Inertia(mass / unit, tensor / (unit * scales.length**2), gravity)


def _moments(given: Value | tuple[Value, ...], dim: int) -> list[float]:
    """Moments of inertia about x, y and z; in 2D about z alone."""
    numbers = [quantity(number, INERTIA[dim]) for number in (given if isinstance(given, tuple) else (given,))]
    return [0.0, 0.0, numbers[0]] if dim == 2 else numbers * (3 // len(numbers))


def _pair(tool: RigidTool, other: RigidTool, ground: Ground) -> PairLaw:
    """Two tools: the one that is round, or has corners, by its points."""
    first = [each for each in (tool, other) if each.form.round] or [
        each for each in (tool, other) if each.form.kind == "box"
    ]
    one = first[0]
    return PairLaw(one, other if one is tool else tool, tool.table, ground)


def _refuse_overlap(law: ToolLaw, ground: Ground) -> None:
    """Raise Refused for a body that lies in a tool, with the place and the depth."""
    tool, length = law.tool, ground.scales.length
    tool.body.place(tool.body.state)
    places = law.side.places()
    gap = law.gaps(places)
    deepest = int(gap.argmin())
    if gap[deepest] < -DEEP * law.side.spacing:
        raise Refused(
            f"tool {tool.table.name!r}: body {law.side.name!r} lies in it from the start, at"
            f" {_told(ground.origin + places[deepest] * length)} m by {-gap[deepest] * length:.4g} m: move one of them"
        )


def _refuse_nearer(law: PairLaw, ground: Ground) -> None:
    """Raise Refused for two tools that overlap."""
    for tool in (law.one, law.other):
        tool.body.place(tool.body.state)
    places, gaps = law.gaps()
    deepest = int(gaps.argmin())
    if gaps[deepest] < -DEEP:
        length = ground.scales.length
        raise Refused(
            f"tools {law.one.table.name!r} and {law.other.table.name!r} overlap from the start, at"
            f" {_told(ground.origin + places[deepest] * length)} m by {-gaps[deepest] * length:.4g} m: move one of them"
        )


def _told(place: np.ndarray) -> str:
    return f"({', '.join(f'{x:.4g}' for x in place)})"
