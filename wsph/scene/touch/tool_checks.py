"""Faults of the tables of rigid tools, in the words of the scene's author."""

# pyright: strict

from collections.abc import Iterator

from wsph.boundary.programs.prescribed import varies
from wsph.errors import Fault
from wsph.geometry.shapes.shape import rotation_matrix
from wsph.output.fields import AXES
from wsph.quantities import Value
from wsph.scene.checks import value_faults
from wsph.scene.messages import nearest
from wsph.scene.tables import SceneTables
from wsph.scene.touch.tools import Box, Cylinder, Plane, Sphere, Tool
from wsph.units import quantity

MASS = {1: "kg/m2", 2: "kg/m", 3: "kg"}
"""Units of a tool's mass by dimension: in 2D it is per depth, in 1D per area."""

INERTIA = {2: "kg m", 3: "kg m2"}
"""Of its moment of inertia."""


def of_tools(scene: SceneTables) -> Iterator[Fault]:
    """Faults of the tools of a scene."""
    names = [tool.name for tool in scene.tools]
    taken = {body.name.casefold(): "body" for body in scene.bodies}
    taken |= {contact.name.casefold(): "contact" for contact in scene.contact}
    for k, tool in enumerate(scene.tools):
        key = f"tools.{k}"
        if names.index(tool.name) != k or tool.name.casefold() in taken:
            what = taken.get(tool.name.casefold(), "tool")
            yield Fault(0, f"{key}.name", f"{tool.name!r} names another {what} already")
        yield from _shape_faults(scene, tool, f"{key}.shape")
        yield from _motion_faults(scene, tool, key)
        yield from _inertia_faults(scene, tool, key)
        yield from _against_faults(scene, k, f"{key}.against")
        if scene.dim == 1 and tool.friction > 0.0:
            yield Fault(0, f"{key}.friction", "in 1D nothing slides")


def _shape_faults(scene: SceneTables, tool: Tool, key: str) -> Iterator[Fault]:
    shape, dim = tool.shape, scene.dim
    allowed = {1: ("plane",), 2: ("plane", "disc", "sphere", "box"), 3: ("plane", "sphere", "cylinder", "box", "stl")}[
        dim
    ]
    if shape.type not in allowed:
        yield Fault(0, f"{key}.type", f"{shape.type!r} is none of the tools' shapes in {dim}D: {', '.join(allowed)}")
        return
    given: dict[str, tuple[float, ...]] = {}
    match shape:
        case Plane():
            given = {"point": shape.point, "normal": shape.normal}
        case Sphere():
            given = {"center": shape.center}
        case Cylinder() | Box():
            given = {"from": shape.start, "to": shape.end}
        case _:
            pass
    wrong = [name for name, numbers in given.items() if len(numbers) != dim]
    for name in wrong:
        yield Fault(
            0, f"{key}.{name}", f"{list(given[name])} has {len(given[name])} coordinates in a scene of dim = {dim}"
        )
    if wrong:
        return
    if isinstance(shape, Plane) and not any(shape.normal):
        yield Fault(0, f"{key}.normal", f"{list(shape.normal)} has no length: it is the way out of the tool, as [0, 1]")
    if isinstance(shape, Plane) and tool.inside:
        yield Fault(0, key.removesuffix("shape") + "inside", "a plane has no inside: turn its normal around")
    if isinstance(shape, Cylinder) and shape.start == shape.end:
        yield Fault(0, f"{key}.to", "from and to are the same point")
    if isinstance(shape, Box):
        if any(a >= b for a, b in zip(shape.start, shape.end, strict=True)):
            yield Fault(0, f"{key}.from", f"{list(shape.start)} must lie below to = {list(shape.end)} on every axis")
        try:
            rotation_matrix(shape.rotate, dim)
        except ValueError as error:
            yield Fault(0, f"{key}.rotate", str(error))


def _motion_faults(scene: SceneTables, tool: Tool, key: str) -> Iterator[Fault]:
    axes = AXES[: scene.dim]
    if isinstance(tool.velocity, tuple):
        if len(tool.velocity) != scene.dim:
            yield Fault(0, f"{key}.velocity", f"has {len(tool.velocity)} components in a scene of dim = {scene.dim}")
    else:
        for component, value in tool.velocity.items():
            place = f"{key}.velocity.{component}"
            if component not in axes:
                yield Fault(0, place, f"is none of {', '.join(axes)}")
            yield from _of_time(scene, value, place, "m/s")
    if tool.turn is not None:
        yield from _turn_faults(scene, tool, f"{key}.turn")
    if tool.spin is not None:
        numbers = len(tool.spin) if isinstance(tool.spin, tuple) else 1
        wanted = {1: "nothing turns in 1D", 2: "is a number in 2D", 3: "is a list of three in 3D"}[scene.dim]
        if scene.dim == 1 or (scene.dim == 2) != isinstance(tool.spin, float) or numbers not in (1, 3):
            yield Fault(0, f"{key}.spin", wanted)


def _turn_faults(scene: SceneTables, tool: Tool, key: str) -> Iterator[Fault]:
    turn = tool.turn
    if turn is None:
        return
    if scene.dim == 1:
        yield Fault(0, key, "nothing turns in 1D")
        return
    if len(turn.about) != scene.dim:
        yield Fault(0, f"{key}.about", f"has {len(turn.about)} coordinates in a scene of dim = {scene.dim}")
    if (turn.axis is None) == (scene.dim == 3):
        yield Fault(
            0, f"{key}.axis", "is missing" if scene.dim == 3 else "in 2D tools turn about z alone: leave it out"
        )
    elif turn.axis is not None and (len(turn.axis) != 3 or not any(turn.axis)):
        yield Fault(0, f"{key}.axis", f"{list(turn.axis)} is no axis: write three numbers that are not all zero")
    yield from _of_time(scene, turn.rate, f"{key}.rate", "1/s")


def _of_time(scene: SceneTables, value: Value, key: str, unit: str) -> Iterator[Fault]:
    """Faults of a prescribed value, which for a rigid body is a function of t alone."""
    found = list(value_faults(scene, lambda: scene.value(value, unit), value, key, unit))
    yield from found
    if not found and varies(scene.value(value, unit)):
        yield Fault(
            0, key, f"{value!r} differs from place to place; a rigid tool moves as a whole: write a function of t"
        )


def _inertia_faults(scene: SceneTables, tool: Tool, key: str) -> Iterator[Fault]:
    if tool.mass is None:
        return
    yield from _positive(tool.mass, f"{key}.mass", MASS[scene.dim])
    given = tool.inertia
    if given is None:
        endless = isinstance(tool.shape, Plane) and scene.dim > 1
        if endless or (tool.inside and scene.dim > 1):
            what = "a plane without end" if endless else "a hole"
            yield Fault(0, f"{key}.inertia", f"is missing: {what} has none of its own")
        return
    if scene.dim == 1:
        yield Fault(0, f"{key}.inertia", "nothing turns in 1D")
        return
    numbers = given if isinstance(given, tuple) else (given,)
    if len(numbers) not in ((1, 3) if scene.dim == 3 else (1,)):
        wanted = "a number, or three in 3D"
        yield Fault(0, f"{key}.inertia", f"has {len(numbers)} numbers: it is {wanted}")
    for number in numbers:
        yield from _positive(number, f"{key}.inertia", INERTIA[scene.dim])


def _positive(value: Value, key: str, unit: str) -> Iterator[Fault]:
    try:
        number = quantity(value, unit)
    except ValueError as error:
        yield Fault(0, key, str(error))
        return
    if number <= 0.0:
        yield Fault(0, key, f"{value!r} is not above zero")


def _against_faults(scene: SceneTables, number: int, key: str) -> Iterator[Fault]:
    tool, before = scene.tools[number], [each.name for each in scene.tools[:number]]
    bodies, tools = [body.name for body in scene.bodies], {each.name: each for each in scene.tools}
    for k, name in enumerate(tool.against):
        other = tools.get(name)
        if name in tool.against[:k]:
            yield Fault(0, key, f"{name!r} is named twice")
        elif name == tool.name:
            yield Fault(0, key, f"{name!r} is the tool itself")
        elif name not in bodies and other is None:
            hint = nearest(name, [*bodies, *tools], "there is " + ", ".join([*bodies, *tools]))
            yield Fault(0, key, f"no body and no tool is named {name!r}; {hint}")
        elif other is not None and name not in bodies:
            if name in before and tool.name in other.against:
                yield Fault(0, key, f"{name!r} names {tool.name!r} already; they would push twice")
            yield from _pair_faults(tool, other, key)


def _pair_faults(tool: Tool, other: Tool, key: str) -> Iterator[Fault]:
    """Faults of two tools that are to meet: which shapes can, and that something of it can move."""
    if not (tool.free or other.free):
        yield Fault(0, key, f"neither {tool.name!r} nor {other.name!r} is free: they cannot push each other")
    kinds = {tool.shape.type, other.shape.type}
    if not (any(_round(each) for each in (tool, other)) or kinds == {"box", "plane"}):
        which = f"{tool.name!r} ({tool.shape.type}) and {other.name!r} ({other.shape.type})"
        rule = "of rigid tools a ball meets any shape, and a box meets a plane; model one of them as a body"
        yield Fault(0, key, f"{which}: {rule}")


def _round(tool: Tool) -> bool:
    return isinstance(tool.shape, Sphere) and not tool.inside
