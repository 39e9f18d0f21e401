"""Faults of a scene, in the words of its author: keys, values and the way out.

`of_validation` turns pydantic's errors into faults, `between_tables` finds names that lead nowhere and components that the
dimension does not have, `of_plugins` asks the named material and integrator about their own keys. Where a key stands in
the file is `wsph.scene.lines`' business.
"""

# pyright: strict

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

from wsph.boundary.loads.regions import GRAVITY, UNIT
from wsph.boundary.loads.rows import FORCE
from wsph.boundary.programs.motion import UNITS, Motion
from wsph.constitutive.stress_state import STRESS_STATES
from wsph.errors import Fault, PluginError
from wsph.expressions import FUNCTIONS, VARIABLES, Expression, compile_expression
from wsph.geometry.counts import cells_along
from wsph.output.fields import ALWAYS, AXES, ON_SURFACES, known
from wsph.plugins import registry
from wsph.plugins.options import build
from wsph.plugins.traits import internal_units
from wsph.quantities import Table, Value, is_sequence, is_table
from wsph.scene.messages import nearest, size_in_words
from wsph.scene.numbers import NUMBERS
from wsph.scene.probes import Probe
from wsph.scene.tables import Body, Boundary, SceneTables

MOST_CELLS = 2**31 // 64
"""Cells of a body: with 64 neighbours each their pairs fill a 32-bit index."""


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
    yield from _step_faults(scene)
    yield from _contact_faults(scene, names)
    yield from _named_faults(scene, names)
    for axis, value in scene.gravity.items():
        yield from _component_faults(scene, axis, value, f"gravity.{axis}", GRAVITY)
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


def _step_faults(scene: SceneTables) -> Iterator[Fault]:
    """Faults of the steps of a run: when it ends, their names, and those that boundaries name."""
    if scene.run.end is None and not scene.steps:
        yield Fault(0, "run.end", "is missing")
    if scene.run.end is not None and scene.steps:
        yield Fault(0, "run.end", f"is the sum of the durations of [[steps]], {scene.begins[-1]:g} s: leave it out")
    if scene.relax is not None and any(stage.relax is not None for stage in scene.steps[:1]):
        yield Fault(0, "relax", "and steps.0.relax are of the same time: leave one out")
    names = [stage.name for stage in scene.steps]
    for k, name in enumerate(names):
        if names.index(name) != k:
            yield Fault(0, f"steps.{k}.name", f"{name!r} names another step already")
    for k, condition in enumerate(scene.boundary):
        for name in condition.steps:
            if name not in names:
                known = f"there is {', '.join(names)}" if names else "there are no [[steps]]"
                yield Fault(0, f"boundary.{k}.steps", f"no step is named {name!r}; {nearest(name, names, known)}")


def body_name_fault(name: str, names: list[str], key: str) -> Iterator[Fault]:
    """The fault of a name that is none of the bodies'."""
    if name not in names:
        yield Fault(0, key, f"no body is named {name!r}; {nearest(name, names, 'there is ' + ', '.join(names))}")


def _named_faults(scene: SceneTables, bodies: list[str]) -> Iterator[Fault]:
    """Faults of what has numbers by its name."""
    called = [*((f"boundary.{k}", name) for k, name in enumerate(scene.boundary_names))]
    for kind in ("contact", "tools", "sections"):
        called += [(f"{kind}.{k}", each.name) for k, each in enumerate(getattr(scene, kind))]
    first: dict[str, str] = {}
    for key, name in called:
        other = first.setdefault(name.casefold(), key)
        # Of contacts alone `_contact_faults` says what is wrong.
        if other != key and not (key.startswith("contact.") and other.startswith("contact.")):
            yield Fault(0, f"{key}.name", f"{name!r} names {other} already; give it another")
    for k, section in enumerate(scene.sections):
        yield from body_name_fault(section.body, bodies, f"sections.{k}.body")
        for key in ("point", "normal"):
            given = getattr(section, key)
            if len(given) != scene.dim:
                text = f"{list(given)} has {len(given)} coordinates in a scene of dim = {scene.dim}"
                yield Fault(0, f"sections.{k}.{key}", text)
        if not any(section.normal):
            yield Fault(0, f"sections.{k}.normal", "is zero: it has no direction")
    names = [name for _, name in called]
    for k, probe in enumerate(scene.probes):
        if probe.of is not None and probe.of not in names:
            there = f"there is {', '.join(names)}" if names else "there is nothing that has"
            text = f"nothing that has numbers is named {probe.of!r}; {nearest(probe.of, names, there)}"
            yield Fault(0, f"probes.{k}.of", text)


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
                low, high = body.shape.bounds()
                size = size_in_words(body.name, (high - low).tolist(), unscaled=bool(body.unscaled))
                yield Fault(0, f"{key}.spacing", f"{most}; {size}")
    for k, crack in enumerate(body.cracks):
        if {len(crack.start), len(crack.end)} != {scene.dim} or scene.dim == 1:
            text = "a crack needs 2D or 3D" if scene.dim == 1 else f"from and to need {scene.dim} coordinates each"
            yield Fault(0, f"{key}.cracks.{k}", text)
        elif crack.start == crack.end:
            yield Fault(0, f"{key}.cracks.{k}", "from and to are the same point")
    yield from _map_faults(scene, body, f"{key}.map")
    yield from _force_faults(scene, body, f"{key}.body_force")
    if (body.state is None) != (scene.dim == 3):
        wanted = "is for 1D and 2D" if scene.dim == 3 else '"stress" or "strain" is needed in 1D and 2D'
        yield Fault(0, f"{key}.state", wanted)
    yield from _initial_faults(scene, body, f"{key}.initial")
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


def _component_faults(scene: SceneTables, axis: str, value: Value, key: str, unit: str) -> Iterator[Fault]:
    """Faults of a value along an axis."""
    if axis not in AXES[: scene.dim]:
        yield Fault(0, key, f"is none of {', '.join(AXES[: scene.dim])}")
    yield from value_faults(scene, lambda: scene.value(value, unit), value, key, unit)


def _force_faults(scene: SceneTables, body: Body, key: str) -> Iterator[Fault]:
    for k, force in enumerate(body.body_force):
        if force.where is not None:
            yield from _where_faults(scene, force.where, f"{key}.{k}.where")
        if not force.components:
            yield Fault(0, f"{key}.{k}", "has no force: give x, y or z")
        for axis, value in force.components.items():
            yield from _component_faults(scene, axis, value, f"{key}.{k}.{axis}", UNIT)


def _initial_faults(scene: SceneTables, body: Body, key: str) -> Iterator[Fault]:
    """Faults of what a body begins with beside its velocity."""
    if body.initial is None:
        return
    if body.initial.temperature is not None:
        yield Fault(0, f"{key}.temperature", "no law takes a temperature yet: leave it out")
    state = STRESS_STATES.get((scene.dim, body.state))
    for component, value in body.initial.stress.items():
        place = f"{key}.stress.{component}"
        if state is not None and component not in state.labels:
            yield Fault(0, place, f"is none of {', '.join(state.labels)}, the components in {state.name}")
        if value in scene.functions and scene.functions[str(value)].expression is None:
            yield Fault(0, place, f"{value!r} is a table; an initial stress is a number or an expression")
        else:
            make: Callable[[], object] = lambda v=value: _no_time(scene, v, "Pa", "stress")  # noqa: E731
            yield from value_faults(scene, make, value, place, "Pa")


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


def _no_time(scene: SceneTables, component: Value, unit: str = "m/s", what: str = "velocity") -> object:
    made = scene.value(component, unit)
    if isinstance(made, Expression) and made.uses("t"):
        raise ValueError(f"an initial {what} does not depend on t")
    return made


def _boundary_faults(scene: SceneTables, condition: Boundary, key: str) -> Iterator[Fault]:
    axes = AXES[: scene.dim]
    if condition.face and condition.face[1] not in axes:
        yield Fault(0, f"{key}.face", f"{condition.face!r} does not exist in {scene.dim}D")
    if condition.where is not None:
        yield from _where_faults(scene, condition.where, f"{key}.where")
    for table, allowed, unit in (
        *((table, axes, unit) for table, unit in UNITS.items()),
        ("stress", COMPONENTS[scene.dim], "Pa"),
        ("traction", axes, "Pa"),
        ("force", axes, FORCE[scene.dim]),
    ):
        for component, value in getattr(condition, table).items():
            if component not in allowed:
                yield Fault(0, f"{key}.{table}.{component}", f"is none of {', '.join(allowed)}")
            place = f"{key}.{table}.{component}"
            yield from value_faults(scene, lambda v=value, u=unit: scene.value(v, u), value, place, unit)
    yield from _place_faults(scene, condition, key)
    for component, value in condition.displacement.items():
        yield from _rate_fault(scene, value, f"{key}.displacement.{component}")
    if condition.normal is not None:
        slide = condition.normal
        yield from value_faults(scene, lambda: scene.value(slide, "m/s"), slide, f"{key}.normal", "m/s")
        if condition.fixed or condition.symmetry or any(getattr(condition, table) for table in UNITS):
            yield Fault(0, f"{key}.normal", "goes with no other velocity in one entry: write another for that")
    for load, table in condition.acting.items():
        for name, unit in table.values.items():
            value = getattr(table, name)
            yield from value_faults(scene, lambda v=value, u=unit: scene.value(v, u), value, f"{key}.{load}", unit)
        yield from (Fault(0, f"{key}.{load}.{name}", text) for name, text in table.faults(scene.dim))
    held = (*condition.fixed, *([condition.symmetry] if condition.symmetry else []))
    for component in held:
        if component not in axes:
            yield Fault(0, key, f"{component!r} is none of {', '.join(axes)}")
    moved = [component for table in UNITS for component in getattr(condition, table)]
    for component in dict.fromkeys(c for c in held if c in moved or held.count(c) > 1):
        yield Fault(0, key, f"{component!r} is prescribed twice: by fixed or symmetry, and again")
    for component in dict.fromkeys(c for c in moved if moved.count(c) > 1):
        yield Fault(0, key, f"{component!r} is prescribed twice: give one of {', '.join(UNITS)}")


def _place_faults(scene: SceneTables, condition: Boundary, key: str) -> Iterator[Fault]:
    """Faults of a total force, which is spread evenly."""
    for axis, value in condition.force.items():
        with suppress(ValueError):  # told of the value itself
            made = scene.value(value, FORCE[scene.dim])
            if isinstance(made, Expression) and any(made.uses(name) for name in AXES):
                text = f"{value!r} depends on the place; a total force is spread evenly: write traction, one per area"
                yield Fault(0, f"{key}.force.{axis}", text)


def _rate_fault(scene: SceneTables, value: Value, key: str) -> Iterator[Fault]:
    """The fault of a displacement that has no velocity."""
    try:
        of = scene.value(value, UNITS["displacement"])
    except ValueError:
        return  # told of the value itself
    try:
        _ = Motion("displacement", of).rate
    except ValueError as error:
        yield Fault(0, key, str(error))


def _probe_faults(scene: SceneTables, probe: Probe, key: str) -> Iterator[Fault]:
    if probe.where is not None:
        yield from _where_faults(scene, probe.where, f"{key}.where")
    if probe.line is not None and len(probe.line.start) != len(probe.line.end):
        yield Fault(0, f"{key}.line", f"from has {len(probe.line.start)} coordinates and to {len(probe.line.end)}")
    for point in probe.points or ():
        if len(point) != scene.dim:
            text = f"{list(point)} has {len(point)} coordinates in a scene of dim = {scene.dim}"
            yield Fault(0, f"{key}.{'at' if probe.line is None else 'line'}", text)
            break


def _where_faults(scene: SceneTables, text: str, key: str) -> Iterator[Fault]:
    """Faults of a `where`: it has to be a comparison of the reference position."""
    try:
        expression = compile_expression(text)
    except ValueError as error:
        yield Fault(0, key, str(error))
        return
    if not expression.logical:
        yield Fault(
            0, key, f'{text!r} is no comparison; write one, as in "x <= 0.1", or several, as in "x <= 0.1 and y > 0"'
        )
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
    yield from _formula_faults(scene, names)
    names += list(scene.fields)
    wanted = [("output.fields", scene.output.fields, names)]
    touched = bool(scene.tools) or any(contact.law != "pinball" for contact in scene.contact)
    probed = [name for name in names if name not in (*ALWAYS, *ON_SURFACES)]
    wanted += [
        (f"probes.{k}.fields", probe.fields, probed if probe.of is None else list(NUMBERS))
        for k, probe in enumerate(scene.probes)
    ]
    for key, listed, names in wanted:
        for k, name in enumerate(listed):
            if name in ON_SURFACES and not touched:
                yield Fault(
                    0, key, f"{name!r} is of bodies with contact between surfaces, ties or tools: there is none"
                )
            elif name not in names:
                yield Fault(
                    0, key, f"no field is named {name!r}; {nearest(name, names, 'there is ' + ', '.join(names))}"
                )
            elif name in listed[:k]:
                yield Fault(0, key, f"{name!r} is named twice")


def _formula_faults(scene: SceneTables, names: list[str]) -> Iterator[Fault]:
    """Faults of the fields that a scene makes of others."""
    scalars = [n for n in names if n not in (*ALWAYS, *ON_SURFACES, "velocity", "displacement", "stress", "strain")]
    for name, formula in scene.formulas.items():
        if name in (*names, *VARIABLES, *FUNCTIONS, "pi") or not name.isidentifier():
            yield Fault(
                0, f"fields.{name}", f"{name!r} is the name of a field or of an expression already: give another"
            )
        if not formula.needs:
            yield Fault(
                0, f"fields.{name}", f"{formula.expression.text!r} names no field; there is {', '.join(scalars)}"
            )
        for need in formula.needs:
            if need not in scalars:
                hint = nearest(need, scalars, f"there is {', '.join(scalars)}")
                yield Fault(0, f"fields.{name}", f"no scalar field is named {need!r}; {hint}")
        yield from _axis_faults(scene, formula.expression, f"fields.{name}")


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
