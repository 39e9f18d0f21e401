"""Faults of a scene, in the words of its author: keys, values and the way out.

`of_validation` turns pydantic's errors into faults, `between_tables` finds names that lead nowhere and components that the
dimension does not have, `of_plugins` asks the named material and integrator about their own keys. Where a key stands in
the file is `wsph.scene.lines`' business.
"""

# pyright: strict

import inspect
import math
from collections.abc import Callable, Iterator, Mapping

from wsph.errors import Fault, PluginError
from wsph.expressions import FUNCTIONS, VARIABLES, Expression, compile_expression
from wsph.geometry.counts import cells_along
from wsph.output.fields import ALWAYS, AXES, known
from wsph.plugins import registry
from wsph.plugins.options import build
from wsph.plugins.traits import internal_units
from wsph.quantities import Table, Value, is_sequence, is_table
from wsph.scene.messages import nearest
from wsph.scene.tables import Body, Boundary, Probe, SceneTables

MOST_CELLS = 2**31 // 64
"""Cells of a body: with 64 neighbours each their pairs fill a 32-bit index."""

TOLD = ["force", "torque", "work"]
"""Fields of a probe that is of a tool."""

COMPONENTS = {1: ("xx",), 2: ("xx", "yy", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "xz")}


def between_tables(scene: SceneTables) -> Iterator[Fault]:
    """Faults between tables: names that lead nowhere, components that the dimension does not have."""
    names = [b.name for b in scene.bodies]
    for k, body in enumerate(scene.bodies):
        if names.index(body.name) != k:
            yield Fault(0, f"bodies.{k}.name", f"{body.name!r} names another body already")
        yield from _body_faults(scene, body, f"bodies.{k}")
        for part in body.parts.values():
            for key, text in part.selections.items():
                yield from _where_faults(scene, text, f"bodies.{k}.{part.key}.{key}")
    for k, condition in enumerate(scene.boundary):
        yield from body_name_fault(condition.body, names, f"boundary.{k}.body")
        yield from _boundary_faults(scene, condition, f"boundary.{k}")
    yield from _contact_faults(scene, names)
    for axis in scene.gravity:
        if axis not in AXES[: scene.dim]:
            yield Fault(0, f"gravity.{axis}", f"is none of {', '.join(AXES[: scene.dim])}")
    for name, function in scene.functions.items():
        if name in (*VARIABLES, *FUNCTIONS, "pi"):
            yield Fault(0, f"functions.{name}", f"{name!r} is a name of the expressions; give the function another")
        if function.expression is not None:
            check: Callable[[], object] = lambda text=function.expression: compile_expression(text)  # noqa: E731
            yield from value_faults(scene, check, function.expression, f"functions.{name}.expression")
    yield from _field_faults(scene)
    folded = [p.name.casefold() for p in scene.probes]
    for k, probe in enumerate(scene.probes):
        if folded.index(probe.name.casefold()) != k:
            yield Fault(0, f"probes.{k}.name", f"{probe.name!r} names another probe already")
        if probe.body is not None:
            yield from body_name_fault(probe.body, names, f"probes.{k}.body")
        yield from _probe_faults(scene, probe, f"probes.{k}")


def body_name_fault(name: str, names: list[str], key: str) -> Iterator[Fault]:
    """The fault of a name that is none of the bodies'."""
    if name not in names:
        yield Fault(0, key, f"no body is named {name!r}; {nearest(name, names, 'there is ' + ', '.join(names))}")


def _contact_faults(scene: SceneTables, names: list[str]) -> Iterator[Fault]:
    # A tie and another law go together: what is glued touches once it has broken.
    pairs = [(frozenset(contact.names), contact.law == "tie") for contact in scene.contact]
    called = [contact.name.casefold() for contact in scene.contact]
    for k, contact in enumerate(scene.contact):
        key = f"contact.{k}." + ("self" if contact.between is None else "between")
        for name in contact.names:
            yield from body_name_fault(name, names, key)
        if pairs.index(pairs[k]) != k:
            which = " and ".join(map(repr, contact.names))
            yield Fault(0, key, f"{which} stand in contact.{pairs.index(pairs[k])} already; they would push twice")
        elif called.index(called[k]) != k:
            which = "give it another" if "name" in contact.model_fields_set else "give it a name"
            yield Fault(
                0, f"contact.{k}.name", f"{contact.name!r} names contact.{called.index(called[k])} already; {which}"
            )
        if contact.law == "tie" and contact.between is None:
            yield Fault(0, key, "a tie is between two bodies")
        for other, fault in contact.foreign.items():
            yield Fault(0, f"contact.{k}.{other}", fault)
        if "edges" in contact.model_fields_set and scene.dim < 3 and "edges" not in contact.foreign:
            yield Fault(0, f"contact.{k}.edges", f"is for 3D; in {scene.dim}D no edges cross")


def _body_faults(scene: SceneTables, body: Body, key: str) -> Iterator[Fault]:
    if body.mesh is not None and scene.dim == 1:
        yield Fault(0, f"{key}.mesh", "is for 2D and 3D; a bar has a shape and a spacing")
    if body.shape is not None and body.shape.dim != scene.dim:
        yield Fault(0, f"{key}.shape", f"has {body.shape.dim} coordinates in a scene of dim = {scene.dim}")
    elif body.shape is not None and body.spacing is not None:
        try:
            count = math.prod(cells_along(body.shape, body.spacing, body.lattice_rotate, body.surface))
        except ValueError as error:
            wrong = "spacing" if "rotation" not in str(error) else "shape.rotate"
            could = "not divide" in str(error) and body.surface is None and scene.dim > 1
            takes_any = '; surface = "fitted" takes any, with stress points' if could else ""
            yield Fault(0, f"{key}.{wrong}", f"{error}{takes_any}")
        else:
            if count > MOST_CELLS:
                most = f"gives {count:.3g} particles; a 32-bit index has room for {MOST_CELLS:.3g} and their pairs"
                yield Fault(0, f"{key}.spacing", most)
    for k, crack in enumerate(body.cracks):
        if {len(crack.start), len(crack.end)} != {scene.dim} or scene.dim == 1:
            text = "a crack needs 2D or 3D" if scene.dim == 1 else f"from and to need {scene.dim} coordinates each"
            yield Fault(0, f"{key}.cracks.{k}", text)
        elif crack.start == crack.end:
            yield Fault(0, f"{key}.cracks.{k}", "from and to are the same point")
    yield from _map_faults(scene, body, f"{key}.map")
    if (body.state is None) != (scene.dim == 3):
        wanted = "is for 1D and 2D" if scene.dim == 3 else '"stress" or "strain" is needed in 1D and 2D'
        yield Fault(0, f"{key}.state", wanted)
    if body.velocity is None:
        return
    if len(body.velocity) != scene.dim:
        yield Fault(0, f"{key}.velocity", f"has {len(body.velocity)} components in a scene of dim = {scene.dim}")
    for component in body.velocity:
        if component in scene.functions and scene.functions[str(component)].expression is None:
            yield Fault(
                0, f"{key}.velocity", f"{component!r} is a table; an initial velocity is a number or an expression"
            )
        else:
            yield from value_faults(scene, lambda c=component: _no_time(scene, c), component, f"{key}.velocity", "m/s")


def _map_faults(scene: SceneTables, body: Body, key: str) -> Iterator[Fault]:
    if body.map is None:
        return
    if len(body.map) != scene.dim:
        yield Fault(0, key, f"has {len(body.map)} expressions in a scene of dim = {scene.dim}")
    if body.cracks:
        yield Fault(0, key, "a mapped body cannot be cracked")
    for text in body.map:
        try:
            expression = compile_expression(text)
        except ValueError as error:
            yield Fault(0, key, str(error))
            continue
        if expression.uses("t"):
            yield Fault(0, key, f"{text!r} uses t; a map is of the reference position alone")
        yield from _axis_faults(scene, expression, key)


def _no_time(scene: SceneTables, component: Value) -> object:
    made = scene.value(component, "m/s")
    if isinstance(made, Expression) and made.uses("t"):
        raise ValueError("an initial velocity does not depend on t")
    return made


def _boundary_faults(scene: SceneTables, condition: Boundary, key: str) -> Iterator[Fault]:
    axes = AXES[: scene.dim]
    if condition.face and condition.face[1] not in axes:
        yield Fault(0, f"{key}.face", f"{condition.face!r} does not exist in {scene.dim}D")
    if condition.where is not None:
        yield from _where_faults(scene, condition.where, f"{key}.where")
    for table, allowed, unit in (
        ("velocity", axes, "m/s"),
        ("stress", COMPONENTS[scene.dim], "Pa"),
        ("traction", axes, "Pa"),
    ):
        for component, value in getattr(condition, table).items():
            if component not in allowed:
                yield Fault(0, f"{key}.{table}.{component}", f"is none of {', '.join(allowed)}")
            place = f"{key}.{table}.{component}"
            yield from value_faults(scene, lambda v=value, u=unit: scene.value(v, u), value, place, unit)
    if condition.normal is not None:
        slide = condition.normal
        yield from value_faults(scene, lambda: scene.value(slide, "m/s"), slide, f"{key}.normal", "m/s")
        if condition.fixed or condition.velocity or condition.symmetry:
            yield Fault(0, f"{key}.normal", "goes with no other velocity in one entry: write another for that")
    for load, table in condition.acting.items():
        for name, unit in table.values.items():
            value = getattr(table, name)
            yield from value_faults(scene, lambda v=value, u=unit: scene.value(v, u), value, f"{key}.{load}", unit)
    held = (*condition.fixed, *([condition.symmetry] if condition.symmetry else []))
    for component in held:
        if component not in axes:
            yield Fault(0, key, f"{component!r} is none of {', '.join(axes)}")
    for component in dict.fromkeys(c for c in held if c in condition.velocity or held.count(c) > 1):
        yield Fault(0, key, f"{component!r} is prescribed twice: by fixed or symmetry, and again")


def _probe_faults(scene: SceneTables, probe: Probe, key: str) -> Iterator[Fault]:
    if probe.where is not None:
        yield from _where_faults(scene, probe.where, f"{key}.where")
    told = [tool.name for tool in scene.tools]
    if probe.of is not None and probe.of not in told:
        there = f"there is {', '.join(told)}" if told else "the scene has no tools"
        yield Fault(0, f"{key}.of", f"no tool is named {probe.of!r}; {nearest(probe.of, told, there)}")
    for point in probe.at or ():
        if len(point) != scene.dim:
            text = f"{list(point)} has {len(point)} coordinates in a scene of dim = {scene.dim}"
            yield Fault(0, f"{key}.at", text)


def _where_faults(scene: SceneTables, text: str, key: str) -> Iterator[Fault]:
    """Faults of a `where`: it has to be a comparison of the reference position."""
    try:
        expression = compile_expression(text)
    except ValueError as error:
        yield Fault(0, key, str(error))
        return
    if not expression.logical:
        yield Fault(0, key, f'{text!r} is no comparison; write one, as in "x <= 0.1"')
    if expression.uses("t"):
        yield Fault(0, key, f"{text!r} uses t; particles are selected once, by reference position")
    yield from _axis_faults(scene, expression, key)


def _axis_faults(scene: SceneTables, expression: Expression, key: str) -> Iterator[Fault]:
    for axis in AXES[scene.dim :]:
        if expression.uses(axis):
            yield Fault(0, key, f"{expression.text!r} uses {axis}, which a scene of dim = {scene.dim} does not have")


def value_faults(
    scene: SceneTables, make: Callable[[], object], value: Value, key: str, unit: str = ""
) -> Iterator[Fault]:
    """The fault of a prescribed value that cannot be made, or is of a place that the scene does not have."""
    try:
        made = make()
    except ValueError as error:
        hint = f"; functions: {', '.join(scene.functions)}" if scene.functions else ""
        wanted = f"{value!r} is no number, quantity [{unit}], expression or function: " if unit else ""
        yield Fault(0, key, f"{wanted}{error}{hint if unit else ''}")
        return
    if isinstance(made, Expression):
        yield from _axis_faults(scene, made, key)


def _field_faults(scene: SceneTables) -> Iterator[Fault]:
    """Fields that no body of the scene has, in frames and probes."""
    internals: list[str] = []
    for body in scene.bodies:
        material, faults = build("materials", body.material.model, body.material.options(), "", "model")
        if faults:
            return  # the fields a faulty material would have are not known; its own faults are reported
        internals += internal_units(material)
    offered = [name for body in scene.bodies for part in body.parts.values() for name in part.offers]
    names = known(internals, scene.dim, dict.fromkeys(offered))
    wanted = [("output.fields", scene.output.fields, names)]
    probed = [name for name in names if name not in ALWAYS]
    wanted += [
        (f"probes.{k}.fields", probe.fields, TOLD if probe.of is not None else probed)
        for k, probe in enumerate(scene.probes)
    ]
    for key, listed, names in wanted:
        for k, name in enumerate(listed):
            if name not in names:
                yield Fault(
                    0, key, f"no field is named {name!r}; {nearest(name, names, 'there is ' + ', '.join(names))}"
                )
            elif name in listed[:k]:
                yield Fault(0, key, f"{name!r} is named twice")
    for k, probe in enumerate(scene.probes):
        nonlinear = ("von_mises", "pressure", "density")
        vectors = ("velocity", "displacement", "stress") if probe.reduce == "max" else ()
        for name in probe.fields:
            if probe.reduce and name in (*nonlinear, *vectors):
                text = f"{name!r} cannot be reduced to its {probe.reduce}; name components, such as stress_xx"
                yield Fault(0, f"probes.{k}.fields", text)


def of_plugins(data: Mapping[str, object]) -> list[Fault]:
    """Faults in what the scene says to its plugins, found even where the rest of the scene is at fault."""
    faults: list[Fault] = []
    bodies = data.get("bodies")
    for k, body in enumerate(bodies if is_sequence(bodies) else ()):
        material = body.get("material") if is_table(body) else None
        if is_table(material) and isinstance(model := material.get("model"), str):
            options = {key: value for key, value in material.items() if key != "model"}
            faults += build("materials", model, options, f"bodies.{k}.material", "model")[1]
    run = data.get("run")
    integrator = run.get("integrator") if is_table(run) else None
    if isinstance(integrator, str):
        integrator = {"name": integrator}
    if is_table(integrator) and isinstance(name := integrator.get("name"), str):
        faults += _integrator_faults(name, integrator)
    return faults


def _integrator_faults(name: str, given: Table) -> Iterator[Fault]:
    try:
        plugin = registry.load("integrators", name)
    except PluginError as error:
        yield Fault(0, "run.integrator", str(error))
        return
    _, *parameters = list(inspect.signature(plugin).parameters.values()) or [None]
    options = [p.name for p in parameters if p is not None]
    if any(p is not None and p.kind is p.VAR_KEYWORD for p in parameters):
        return
    for option in given:
        if option != "name" and option not in options:
            hint = nearest(option, options, f"{name} knows {', '.join(options) or 'no options'}")
            yield Fault(0, f"run.integrator.{option}", f"unknown key; {hint}")
