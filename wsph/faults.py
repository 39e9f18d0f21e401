"""What is wrong with a scene, in the words of its author: lines, keys, values and the way out.

`of_validation` turns pydantic's errors into faults, `between_tables` finds names that lead nowhere and components that the
dimension does not have, `of_plugins` asks the named material and integrator about their own keys. `lines` finds where a
key stands in the file.
"""

import difflib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from wsph import registry
from wsph.errors import Fault, PluginError
from wsph.expressions import compile_expression
from wsph.fields import AXES, known
from wsph.plugins import build

if TYPE_CHECKING:
    from wsph.scene import Scene, Value

COMPONENTS = {1: ("xx",), 2: ("xx", "yy", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "xz")}


def of_validation(error: Any, root: type[BaseModel]) -> Fault:
    """A pydantic error in the words of a scene's author."""
    skipped = {"float", "int", "str", "Function", "Box"}
    keys = [str(k) for k in error["loc"] if str(k) not in skipped and "function-" not in str(k)]
    key, kind, given = ".".join(keys), error["type"], error.get("input")
    if kind == "extra_forbidden":
        known = _known_keys(keys[:-1], root)
        close = difflib.get_close_matches(keys[-1], known, 1)
        return Fault(
            0, key, "unknown key; " + (f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}")
        )
    if kind == "missing":
        return Fault(0, key, "is missing")
    if kind == "value_error":
        return Fault(0, key, str(error["ctx"]["error"]))
    if kind == "literal_error":
        close = difflib.get_close_matches(
            str(given), [str(v).strip("'") for v in error["ctx"]["expected"].replace(" or ", ", ").split(", ")], 1
        )
        return Fault(
            0,
            key,
            f"{given!r} is none of {error['ctx']['expected']}" + (f"; did you mean {close[0]!r}?" if close else ""),
        )
    message = error["msg"].replace("Input should be", "must be")
    return Fault(0, key, f"{given!r}: {message}" if not isinstance(given, dict) else message)


def _known_keys(path: list[str], root: type[BaseModel]) -> list[str]:
    """The keys that the table at `path` can have."""
    model: Any = root
    for key in path:
        if key.isdigit():
            continue
        annotation = model.model_fields[key].annotation if key in getattr(model, "model_fields", {}) else None
        models = [m for m in _walk(annotation) if isinstance(m, type) and issubclass(m, BaseModel)]
        if models:
            model = models[0]
    return ["schema" if name == "schema_" else name for name in model.model_fields]


def _walk(annotation: Any) -> Iterator[Any]:
    yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _walk(argument)


def between_tables(scene: "Scene") -> Iterator[Fault]:
    """Faults between tables: names that lead nowhere, components that the dimension does not have."""
    names = [b.name for b in scene.bodies]
    for k, body in enumerate(scene.bodies):
        key = f"bodies.{k}"
        if names.index(body.name) != k:
            yield Fault(0, f"{key}.name", f"{body.name!r} names another body already")
        if body.shape.dim != scene.dim:
            yield Fault(0, f"{key}.shape", f"has {body.shape.dim} coordinates in a scene of dim = {scene.dim}")
        else:
            try:
                body.shape.cells(body.spacing)
            except ValueError as error:
                yield Fault(0, f"{key}.spacing", str(error))
        if (body.state is None) != (scene.dim == 3):
            yield Fault(
                0,
                f"{key}.state",
                "is for 1D and 2D" if scene.dim == 3 else '"stress" or "strain" is needed in 1D and 2D',
            )
        if body.velocity is not None:
            if len(body.velocity) != scene.dim:
                yield Fault(
                    0, f"{key}.velocity", f"has {len(body.velocity)} components in a scene of dim = {scene.dim}"
                )
            for component in body.velocity:
                yield from _value_faults(scene, component, "m/s", f"{key}.velocity")
    for k, condition in enumerate(scene.boundary):
        key = f"boundary.{k}"
        if condition.body not in names:
            yield Fault(0, f"{key}.body", f"no body is named {condition.body!r}; there is {', '.join(names)}")
        axes = AXES[: scene.dim]
        if condition.face and condition.face[1] not in axes:
            yield Fault(0, f"{key}.face", f"{condition.face!r} does not exist in {scene.dim}D")
        if condition.where is not None:
            yield from _expression_faults(condition.where, f"{key}.where")
        for table, allowed, unit in (("velocity", axes, "m/s"), ("stress", COMPONENTS[scene.dim], "Pa")):
            for component, value in getattr(condition, table).items():
                if component not in allowed:
                    yield Fault(0, f"{key}.{table}.{component}", f"is none of {', '.join(allowed)}")
                yield from _value_faults(scene, value, unit, f"{key}.{table}.{component}")
        for component in (*condition.fixed, *([condition.symmetry] if condition.symmetry else [])):
            if component not in axes:
                yield Fault(0, key, f"{component!r} is none of {', '.join(axes)}")
    for name, function in scene.functions.items():
        if function.expression is not None:
            yield from _expression_faults(function.expression, f"functions.{name}.expression")
    yield from _field_faults(scene)
    probe_names = [p.name for p in scene.probes]
    for k, probe in enumerate(scene.probes):
        if probe_names.index(probe.name) != k:
            yield Fault(0, f"probes.{k}.name", f"{probe.name!r} names another probe already")
        if probe.where is not None:
            yield from _expression_faults(probe.where, f"probes.{k}.where")
        for point in probe.at or ():
            if len(point) != scene.dim:
                yield Fault(
                    0, f"probes.{k}.at", f"{list(point)} has {len(point)} coordinates in a scene of dim = {scene.dim}"
                )


def _field_faults(scene: "Scene") -> Iterator[Fault]:
    """Fields that no body of the scene has, in frames and probes."""
    internals: list[str] = []
    for body in scene.bodies:
        material, faults = build("materials", body.material.model, body.material.options(), "", "model")
        if faults:
            return  # the fields a faulty material would have are not known; its own faults are reported
        internals += getattr(material, "internals", {})
        internals += ["dissipation"] if getattr(material, "depends_on_stress", True) else []
    names = known(internals, scene.dim)
    wanted = [("output.fields", name) for name in scene.output.fields]
    for k, probe in enumerate(scene.probes):
        wanted += [(f"probes.{k}.fields", name) for name in probe.fields]
        for name in probe.fields:
            if probe.reduce and (
                name in ("von_mises", "pressure", "density")
                or (probe.reduce == "max" and name in ("velocity", "displacement", "stress"))
            ):
                yield Fault(
                    0,
                    f"probes.{k}.fields",
                    f"{name!r} cannot be reduced to its {probe.reduce}; name components, such as stress_xx",
                )
    for key, name in wanted:
        if name not in names:
            close = difflib.get_close_matches(name, names, 1)
            yield Fault(
                0,
                key,
                f"no field is named {name!r}; "
                + (f"did you mean {close[0]!r}?" if close else f"there is {', '.join(names)}"),
            )


def _expression_faults(text: str, key: str) -> Iterator[Fault]:
    try:
        compile_expression(text)
    except ValueError as error:
        yield Fault(0, key, str(error))


def _value_faults(scene: "Scene", value: "Value", unit: str, key: str) -> Iterator[Fault]:
    try:
        scene.value(value, unit)
    except ValueError as error:
        hint = f"; functions: {', '.join(scene.functions)}" if scene.functions else ""
        yield Fault(0, key, f"{value!r} is no number, quantity [{unit}], expression or function: {error}{hint}")


def of_plugins(data: dict[str, Any]) -> list[Fault]:
    """Faults in what the scene says to its plugins, found even where the rest of the scene is at fault."""
    faults: list[Fault] = []
    bodies = data.get("bodies")
    for k, body in enumerate(bodies if isinstance(bodies, (list, tuple)) else ()):
        material = body.get("material") if isinstance(body, dict) else None
        if isinstance(material, dict) and isinstance(material.get("model"), str):
            options = {key: value for key, value in material.items() if key != "model"}
            faults += build("materials", material["model"], options, f"bodies.{k}.material", "model")[1]
    run = data.get("run")
    integrator = run.get("integrator") if isinstance(run, dict) else None
    if isinstance(integrator, str):
        integrator = {"name": integrator}
    if isinstance(integrator, dict) and isinstance(integrator.get("name"), str):
        try:
            registry.load("integrators", integrator["name"])
        except PluginError as error:
            faults.append(Fault(0, "run.integrator", str(error)))
    return faults


def lines(text: str) -> dict[str, int]:
    """Line of every table header and key of a TOML text, by dotted path."""
    found: dict[str, int] = {}
    counts: dict[str, int] = {}
    table, depth = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split("#", 1)[0].strip() if '"' not in line else line.strip()
        if depth == 0 and code.startswith("["):
            name = code.split("]", 1)[0].lstrip("[").strip().replace('"', "")
            parent, _, last = name.rpartition(".")
            prefix = f"{parent}.{counts[parent]}." if parent in counts else (f"{parent}." if parent else "")
            if code.startswith("[["):
                counts[name] = counts.get(name, -1) + 1
                table = f"{prefix}{last}.{counts[name]}"
            else:
                table = f"{prefix}{last}"
            found[table] = number
        elif depth == 0 and "=" in code and not code.startswith("#"):
            key = code.split("=", 1)[0].strip().replace('"', "")
            found[f"{table}.{key}" if table else key] = number
        if not code.startswith("[") or depth:
            depth = max(depth + code.count("[") + code.count("{") - code.count("]") - code.count("}"), 0)
    return found


def line_of(found: dict[str, int], key: str) -> int:
    """The line of a key, or of the nearest table around it; 0 where there is none."""
    while key and key not in found:
        key = key.rpartition(".")[0]
    return found.get(key, 0)
