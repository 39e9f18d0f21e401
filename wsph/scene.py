"""Scenes: what a run is made of, as validated data. The TOML file and the Python API are the same models.

Every fault of a scene is reported at once, each with its line, key, value and what would be right, before anything is
compiled or written. What a plugin says about its own keys is checked here too: the material and the integrator that the
scene names are the only plugins imported.
"""

import dataclasses
import difflib
import tomllib
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from wsph import registry
from wsph.errors import Fault, PluginError, SceneError
from wsph.expressions import Expression, compile_expression, constant_program
from wsph.fields import known
from wsph.shapes import Shape
from wsph.smoothing import SMOOTHING
from wsph.units import quantity

AXES = ("x", "y", "z")
COMPONENTS = {1: ("xx",), 2: ("xx", "yy", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "xz")}


class Model(BaseModel):
    """Base of the scene's tables: unknown keys, wrong types, NaN and infinities are faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def _in(unit: str, **limits: Any) -> Any:
    return Annotated[float, BeforeValidator(partial(quantity, expected=unit)), Field(**limits)]


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _cadence(value: object) -> int | float:
    if isinstance(value, int) and not isinstance(value, bool):
        if value < 1:
            raise ValueError(f'{value} steps: at least 1 (or a time such as "1 ms")')
        return value
    seconds = quantity(value, "s")
    if seconds <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return seconds


def _smoothing(name: str) -> str:
    if name not in SMOOTHING:
        raise ValueError(f"{name!r} is none of {', '.join(SMOOTHING)}")
    return name


Cadence = Annotated[int | float, BeforeValidator(_cadence)]
"""An integer counts steps, a float or a unit string is seconds."""
Value = float | int | str
"""A number, a quantity with its unit, an expression of x, y, z, t, or the name of a function."""
Strings = Annotated[tuple[str, ...], BeforeValidator(_tuple)]


class IntegratorSpec(Model):
    """An integrator's registry name and its own options."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)
    name: str

    def options(self) -> dict[str, Any]:
        """The integrator's own keys."""
        return dict(self.model_extra or {})


class MaterialSpec(Model):
    """A material's registry name and its own fields."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)
    model: str

    def options(self) -> dict[str, Any]:
        """The material's own keys."""
        return dict(self.model_extra or {})


class Run(Model):
    """How to integrate: method, time, precision, device."""

    integrator: Annotated[IntegratorSpec, BeforeValidator(lambda v: {"name": v} if isinstance(v, str) else v)]
    end: _in("s", gt=0)
    cfl: _in("", gt=0) | None = None
    dt: _in("s", gt=0) | None = None
    precision: Literal["f64", "f32"] = "f64"
    device: Annotated[str, Field(pattern=r"^(auto|cpu|cuda:\d+)$")] = "auto"
    threads: Annotated[int, Field(ge=0, le=1, description="0 or 1: launches are not yet split over cores")] = 0
    formulation: Literal["small-strain", "total-lagrangian"] | None = None
    kernel: Annotated[str, AfterValidator(_smoothing)] = "cubic-spline"
    support: _in("", gt=0) | None = None
    guard: Literal["refuse", "warn", "off"] = "refuse"
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="after")
    def _one_step(self) -> "Run":
        if (self.cfl is None) == (self.dt is None):
            raise ValueError(
                "exactly one of cfl and dt is needed: " + ("neither is given" if self.cfl is None else "both are given")
            )
        return self


class Body(Model):
    """One deformable body."""

    name: str
    shape: Shape
    spacing: _in("m", gt=0)
    state: Literal["stress", "strain"] | None = None
    jitter: _in("", ge=0, le=0.5) = 0.0
    velocity: Annotated[tuple[Value, ...], BeforeValidator(_tuple)] | None = None
    material: MaterialSpec


class Function(Model):
    """A function of time: a table (t, value, interp) or an expression of x, y, z, t."""

    t: Annotated[tuple[_in("s"), ...], BeforeValidator(_tuple)] | None = None
    value: Annotated[tuple[float | int, ...], BeforeValidator(_tuple)] | None = None
    interp: Literal["linear", "step"] = "linear"
    expression: str | None = None

    @model_validator(mode="after")
    def _table_or_expression(self) -> "Function":
        if (self.expression is None) == (self.t is None and self.value is None):
            raise ValueError("either a table (t and value) or an expression is needed")
        if self.expression is None:
            if self.t is None or self.value is None or len(self.t) != len(self.value) or not self.t:
                raise ValueError("t and value must have the same number of entries, at least one")
            if any(a >= b for a, b in zip(self.t, self.t[1:], strict=False)):
                raise ValueError("t must increase from entry to entry")
        return self


class Boundary(Model):
    """Prescribed values on a face or on the particles that `where` selects."""

    body: str
    where: str | None = None
    face: Annotated[str, Field(pattern=r"^[+-][xyz]$")] | None = None
    velocity: dict[str, Value] = {}
    fixed: Strings = ()
    symmetry: Literal["x", "y", "z"] | None = None
    stress: dict[str, Value] = {}

    @model_validator(mode="after")
    def _complete(self) -> "Boundary":
        if (self.where is None) == (self.face is None):
            raise ValueError("exactly one of where and face is needed")
        if not (self.velocity or self.fixed or self.symmetry or self.stress):
            raise ValueError("nothing is prescribed: give velocity, fixed, symmetry or stress")
        return self


class Probe(Model):
    """A record of fields at material points, or of the particles that `where` selects, reduced to one number."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=100)]
    at: (
        Annotated[tuple[Annotated[tuple[_in("m"), ...], BeforeValidator(_tuple)], ...], BeforeValidator(_tuple)] | None
    ) = None
    where: str | None = None
    reduce: Literal["mean", "sum", "max"] | None = None
    fields: Annotated[Strings, Field(min_length=1)]
    every: Cadence = 1

    @model_validator(mode="after")
    def _complete(self) -> "Probe":
        if (self.at is None) == (self.where is None):
            raise ValueError("exactly one of at and where is needed")
        if self.at is not None and not self.at:
            raise ValueError("at names no point")
        if (self.where is None) != (self.reduce is None):
            raise ValueError('reduce = "mean", "sum" or "max" goes with where')
        return self


class Output(Model):
    """What is written, and when."""

    every: Cadence | None = None
    formats: Annotated[tuple[Literal["vtu", "xdmf", "npz"], ...], BeforeValidator(_tuple)] = ("vtu",)
    fields: Strings = ("velocity", "stress")
    history: Cadence | None = None


class Stop(Model):
    """When a run that goes on by itself is ended."""

    energy: _in("", gt=0) = 0.10


class Scene(Model):
    """A whole scene. `wsph.Scene(...)` and a TOML file take the same keys; both raise SceneError."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=False)

    schema_: Annotated[Literal[1], Field(alias="schema")]
    title: str = ""
    dim: Literal[1, 2, 3]
    run: Run
    bodies: Annotated[tuple[Body, ...], BeforeValidator(_tuple), Field(min_length=1)]
    functions: dict[str, Function] = {}
    boundary: Annotated[tuple[Boundary, ...], BeforeValidator(_tuple)] = ()
    probes: Annotated[tuple[Probe, ...], BeforeValidator(_tuple)] = ()
    output: Output = Output()
    stop: Stop = Stop()

    def __init__(self, **data: Any):
        faults: list[Fault] = []
        try:
            super().__init__(**data)
        except ValidationError as error:
            faults = [_fault(e) for e in error.errors(include_url=False)]
        else:
            faults = list(_cross_faults(self))
        faults += _plugin_faults(data)
        if faults:
            raise SceneError("scene", faults)

    def data(self) -> dict[str, Any]:
        """The scene as plain data, as a TOML file would give it."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True, exclude_unset=True)

    def with_(self, **overrides: Any) -> "Scene":
        """The scene with some keys changed.

        A key is a dotted path (`**{"bodies.0.spacing": 0.005}`) or the name of a key of [run] (`cfl=2.0`). Giving one of
        cfl and dt takes the other away. Raises SceneError.
        """
        data = self.data()
        for path, value in overrides.items():
            apply_override(data, path, value)
        return Scene(**data)

    def value(self, value: Value, unit: str) -> Expression | Function:
        """What a value of the scene means: a table of `functions`, or an expression (a number is a constant one)."""
        if isinstance(value, str) and value in self.functions:
            function = self.functions[value]
            return compile_expression(function.expression) if function.expression is not None else function
        if isinstance(value, str):
            try:
                return compile_expression(value)
            except ValueError as not_expression:
                try:
                    return constant_program(quantity(value, unit))
                except ValueError:
                    raise not_expression from None
        return constant_program(float(value))


def apply_override(data: dict[str, Any], path: str, value: Any) -> None:
    """Set the dotted `path` in a scene's data. Raises SceneError where the path leads nowhere."""
    keys = path.split(".") if "." in path or path in Scene.model_fields else ["run", path]
    if keys in (["run", "cfl"], ["run", "dt"]):
        data.get("run", {}).pop("dt" if keys[1] == "cfl" else "cfl", None)
    place: Any = data
    for key in keys[:-1]:
        try:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        except (ValueError, IndexError):
            raise SceneError("scene", [Fault(0, path, f"there is no entry {key!r}")]) from None
    if isinstance(place, list):
        try:
            place[int(keys[-1])] = value
        except (ValueError, IndexError):
            raise SceneError("scene", [Fault(0, path, f"there is no entry {keys[-1]!r}")]) from None
    elif isinstance(place, dict):
        place[keys[-1]] = value
    else:
        raise SceneError("scene", [Fault(0, path, "leads into a value, not into a table")])


def load(path: str | Path, overrides: dict[str, Any] | None = None) -> Scene:
    """Read and validate a scene file. Raises SceneError with every fault, its line and key."""
    source = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(source, [Fault(0, "", "no such file")]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(source, [Fault(0, "", f"cannot be read: {error}")]) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(source, [Fault(0, "", f"is not TOML: {error}")]) from None
    lines = _line_numbers(text)
    try:
        for key, value in (overrides or {}).items():
            apply_override(data, key, value)
        return Scene(**data)
    except SceneError as error:
        raise SceneError(source, [Fault(_line(lines, f.key), f.key, f.message) for f in error.faults]) from None


def _line_numbers(text: str) -> dict[str, int]:
    """Line of every table header and key of a TOML text, by dotted path."""
    lines: dict[str, int] = {}
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
            lines[table] = number
        elif depth == 0 and "=" in code and not code.startswith("#"):
            key = code.split("=", 1)[0].strip().replace('"', "")
            lines[f"{table}.{key}" if table else key] = number
        if not code.startswith("[") or depth:
            depth = max(depth + code.count("[") + code.count("{") - code.count("]") - code.count("}"), 0)
    return lines


def _line(lines: dict[str, int], key: str) -> int:
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 0)


def _fault(error: Any) -> Fault:
    """A pydantic error in the words of a scene's author."""
    skipped = {"float", "int", "str", "Function", "Box"}
    keys = [str(k) for k in error["loc"] if str(k) not in skipped and "function-" not in str(k)]
    key, kind, given = ".".join(keys), error["type"], error.get("input")
    if kind == "extra_forbidden":
        known = _known_keys(keys[:-1])
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


def _known_keys(path: list[str]) -> list[str]:
    """The keys that the table at `path` can have."""
    model: Any = Scene
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


def _cross_faults(scene: Scene) -> Iterator[Fault]:
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


def _field_faults(scene: Scene) -> Iterator[Fault]:
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


def _value_faults(scene: Scene, value: Value, unit: str, key: str) -> Iterator[Fault]:
    try:
        scene.value(value, unit)
    except ValueError as error:
        hint = f"; functions: {', '.join(scene.functions)}" if scene.functions else ""
        yield Fault(0, key, f"{value!r} is no number, quantity [{unit}], expression or function: {error}{hint}")


def _plugin_faults(data: dict[str, Any]) -> list[Fault]:
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


def build(group: str, name: str, options: dict[str, Any], key: str, name_key: str) -> tuple[Any, list[Fault]]:
    """Make a plugin's dataclass from a scene's keys: (instance or None, faults).

    Every field may declare `metadata={"unit": ..., "min": ..., "max": ..., "above": ..., "below": ...}`; min and max are
    allowed values, above and below are not.
    """
    try:
        plugin = registry.load(group, name)
    except PluginError as error:
        return None, [Fault(0, f"{key}.{name_key}", str(error))]
    if not dataclasses.is_dataclass(plugin):
        return None, [Fault(0, f"{key}.{name_key}", f"{name!r} from {registry.origin(group, name)} is not a dataclass")]
    fields = {f.name: f for f in dataclasses.fields(plugin)}
    faults, values = [], {}
    for option, value in options.items():
        if option not in fields:
            close = difflib.get_close_matches(option, fields, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"{name} knows {', '.join(fields)}"
            faults.append(Fault(0, f"{key}.{option}", f"unknown key; {hint}"))
            continue
        try:
            values[option] = _checked(value, fields[option].metadata)
        except ValueError as error:
            faults.append(Fault(0, f"{key}.{option}", str(error)))
    for option, field in fields.items():
        required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if required and option not in options:
            faults.append(
                Fault(0, f"{key}.{option}", f"is missing: {name} needs it [{field.metadata.get('unit') or '-'}]")
            )
    if faults:
        return None, faults
    try:
        return plugin(**values), []
    except ValueError as error:
        return None, [Fault(0, key, str(error))]


def _checked(value: object, rules: Any) -> float:
    number = quantity(value, rules.get("unit", ""))
    tests = (("above", number > rules.get("above", -float("inf"))), ("min", number >= rules.get("min", -float("inf"))),
             ("below", number < rules.get("below", float("inf"))), ("max", number <= rules.get("max", float("inf"))))  # fmt: skip
    for rule, holds in tests:
        if not holds:
            words = {"above": "above", "min": "at least", "below": "below", "max": "at most"}[rule]
            raise ValueError(f"{value!r} must be {words} {rules[rule]:g} {rules.get('unit', '')}".rstrip())
    return number
