"""Scenes: what a run is made of, as validated data. The TOML file and the Python API are the same models.

Every fault of a scene is reported at once, each with its line, key, value and what would be right, before anything is
compiled or written. What a plugin says about its own keys is checked here too: the material and the integrator that the
scene names are the only plugins imported.
"""

import copy
import re
import tomllib
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PrivateAttr,
    ValidationError,
    model_validator,
)

from wsph.errors import Fault, SceneError
from wsph.expressions import Expression, compile_expression, constant_program
from wsph.faults import between_tables, of_plugins, of_validation, scene_path
from wsph.lines import line_of, lines
from wsph.shapes import Rotation, Shape, as_tuple
from wsph.smoothing import SMOOTHING
from wsph.units import looks_like_quantity, quantity


class Model(BaseModel):
    """Base of the scene's tables: unknown keys, wrong types, NaN and infinities are faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def _in(unit: str, **limits: Any) -> Any:
    return Annotated[float, BeforeValidator(partial(quantity, expected=unit)), Field(**limits)]


def _whole(value: Any) -> Any:
    # Literal compares: without this 1.0 and true would pass for 1.
    if isinstance(value, (bool, float)):
        raise ValueError(f"{value!r} must be a whole number")
    return value


def _face(value: str) -> str:
    if value not in ("-x", "+x", "-y", "+y", "-z", "+z"):
        raise ValueError(f"{value!r} is no face; write -x, +x, -y, ...")
    return value


def _cadence(value: object) -> int | float:
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value < 2**53:
            raise ValueError(f'{value} steps: from 1 to 2^53 (or a time such as "1 ms")')
        return value
    seconds = quantity(value, "s")
    if seconds <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return seconds


def _smoothing(name: str) -> str:
    if name not in SMOOTHING:
        raise ValueError(f"{name!r} is none of {', '.join(SMOOTHING)}")
    return name


def _plain(value: object) -> object:
    return value if isinstance(value, str) else quantity(value, "")


Cadence = Annotated[int | float, BeforeValidator(_cadence)]
"""An integer counts steps, a float or a unit string is seconds."""
Value = Annotated[float | str, BeforeValidator(_plain)]
"""A number, a quantity with its unit, an expression of x, y, z, t, or the name of a function."""
Strings = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]


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
    threads: Annotated[int, Field(ge=0, le=1024)] = 0
    formulation: Literal["small-strain", "total-lagrangian", "stress-points", "updated-lagrangian"] | None = None
    correction: Literal["symmetric", "paper"] = "symmetric"
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


class Damping(Model):
    """Damping of every particle's motion: dv/dt = ... - rate v, rate in 1/s."""

    rate: _in("1/s", ge=0)


class Viscosity(Model):
    """Artificial viscosity between particles (He & Seaid 2016, eq 17): `alpha` linear, `beta` quadratic in the closing
    speed, on approaching pairs; kind "pair" damps all pairs, linearly. `correction`, that of the run where not said:
    "symmetric" keeps momentum and angular momentum; "paper" acts along each particle's own corrected gradient, as it does
    there, and keeps neither at a boundary."""

    alpha: _in("", ge=0)
    beta: _in("", ge=0) = 0.0
    kind: Literal["approach", "pair"] = "approach"
    correction: Literal["symmetric", "paper"] | None = None


class Residual(Model):
    """Stiffness of what a linear field leaves of the displacement differences, in Young's moduli."""

    coefficient: _in("", ge=0)


class Hourglass(Model):
    """Hourglass control (Ganzenmueller 2015), in Young's moduli: in place of the residual, unless that is named too."""

    coefficient: _in("", ge=0)


class ArtificialStress(Model):
    """Artificial stress (He & Seaid 2016, eqs 19-23): tension is opposed by `epsilon` of it where particles are near."""

    epsilon: _in("", ge=0, le=1) = 0.3
    exponent: _in("", ge=0) = 4.0


def _switch(value: Any) -> Any:
    """A part that is there by default: false takes it away."""
    if value is True:
        raise ValueError("true says nothing: leave the key out for the default, or give its coefficient")
    if isinstance(value, (int, float)) and value is not False:
        raise ValueError(f"{value!r} is no table; write {{ coefficient = {value} }}")
    return {"coefficient": 0.0} if value is False else value


class PhaseField(Model):
    """Phase-field fracture (`wsph.phase_field`): `fracture_energy` G_c [J/m2], `length` l [m], model "AT1" (no damage below
    a strength) or "AT2"."""

    fracture_energy: _in("J/m2", gt=0)
    length: _in("m", gt=0)
    model: Literal["AT1", "AT2"] = "AT1"


class Links(Model):
    """Virtual links that break (`wsph.links`): by `criterion`, at `threshold` (a strain, or Pa for principal-stress) or, for
    "energy", at the `fracture_energy` [J/m2]; only between particles that `where` selects, if it is given."""

    criterion: Literal["stretch", "energy", "plastic-strain", "principal-stress"]
    threshold: float | str | None = None
    fracture_energy: _in("J/m2", gt=0) | None = None
    where: str | None = None

    @model_validator(mode="after")
    def _one_measure(self) -> "Links":
        wanted = "fracture_energy" if self.criterion == "energy" else "threshold"
        given = [name for name in ("threshold", "fracture_energy") if getattr(self, name) is not None]
        if given != [wanted]:
            raise ValueError(
                f"criterion {self.criterion!r} needs {wanted} and nothing else: given {given or 'neither'}"
            )
        if self.threshold is not None and self.limit <= 0.0:
            raise ValueError(f"threshold = {self.threshold!r} is not above zero")
        return self

    @property
    def limit(self) -> float:
        """The threshold: a strain, or Pa."""
        return quantity(self.threshold, "Pa" if self.criterion == "principal-stress" else "")


class CrackLine(Model):
    """A cut from the start: in 2D a segment, in 3D a rectangle with these two corners. Reference coordinates."""

    start: Annotated[tuple[_in("m"), ...], BeforeValidator(as_tuple)] = Field(alias="from")
    end: Annotated[tuple[_in("m"), ...], BeforeValidator(as_tuple)] = Field(alias="to")


def _spacing(value: Any) -> Any:
    """One length, or one for each axis."""
    lengths = tuple(quantity(v, "m") for v in value) if isinstance(value, (list, tuple)) else quantity(value, "m")
    if not ((isinstance(lengths, tuple) and lengths) or isinstance(lengths, float)):
        raise ValueError(f"{value!r} is no length and no list of lengths")
    if min(lengths if isinstance(lengths, tuple) else (lengths,)) <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return lengths


class Body(Model):
    """One deformable body."""

    name: Annotated[str, Field(min_length=1)]
    shape: Shape
    spacing: Annotated[float | tuple[float, ...], BeforeValidator(_spacing)]
    lattice_rotate: Rotation = 0.0
    map: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] | None = None
    state: Literal["stress", "strain"] | None = None
    jitter: _in("", ge=0, le=0.5) = 0.0
    cracks: Annotated[tuple[CrackLine, ...], BeforeValidator(as_tuple)] = ()
    damping: Damping | None = None
    viscosity: Viscosity | None = None
    residual: Annotated[Residual | None, BeforeValidator(_switch)] = None
    hourglass: Annotated[Hourglass | None, BeforeValidator(_switch)] = None
    artificial_stress: ArtificialStress | None = None
    phase_field: PhaseField | None = None
    links: Links | None = None
    placement: Literal["cells", "nodes"] = "cells"
    velocity: Annotated[tuple[Value, ...], BeforeValidator(as_tuple)] | None = None
    material: MaterialSpec


def damage_model(body: Body) -> str:
    """How a body breaks: "AT1" or "AT2" by a phase field, "links", or "" where it does not."""
    if body.phase_field is not None:
        return body.phase_field.model
    return "links" if body.links is not None else ""


class Function(Model):
    """A function of time: a table (t, value, interp) or an expression of x, y, z, t."""

    t: Annotated[tuple[_in("s"), ...], BeforeValidator(as_tuple)] | None = None
    value: Annotated[tuple[_in(""), ...], BeforeValidator(as_tuple)] | None = None
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
    face: Annotated[str, AfterValidator(_face)] | None = None
    velocity: dict[str, Value] = {}
    fixed: Strings = ()
    symmetry: Literal["x", "y", "z"] | None = None
    stress: dict[str, Value] = {}
    traction: dict[str, Value] = {}

    @model_validator(mode="after")
    def _complete(self) -> "Boundary":
        if (self.where is None) == (self.face is None):
            raise ValueError("exactly one of where and face is needed")
        if not (self.velocity or self.fixed or self.symmetry or self.stress or self.traction):
            raise ValueError("nothing is prescribed: give velocity, fixed, symmetry, stress or traction")
        return self


class Contact(Model):
    """Contact `between` two bodies, or of `self` (`wsph.contact`): a `law`, its `stiffness` as a multiple of the materials',
    `friction`, and the `radius` of a particle in spacings."""

    between: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] | None = None
    self_: Annotated[str | None, Field(alias="self")] = None
    law: Literal["penalty", "pinball"] = "penalty"
    stiffness: _in("", gt=0) = 1.0
    friction: _in("", ge=0) = 0.0
    radius: _in("", gt=0, le=1) = 0.5

    @model_validator(mode="after")
    def _complete(self) -> "Contact":
        if (self.between is None) == (self.self_ is None):
            raise ValueError('exactly one of between = ["a", "b"] and self = "a" is needed')
        if self.between is not None and (len(self.between) != 2 or self.between[0] == self.between[1]):
            raise ValueError('between names two different bodies; for one with itself write self = "a"')
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies that take part."""
        return self.between if self.between is not None else (self.self_ or "",)


class Probe(Model):
    """A record of fields at material points, or of the particles that `where` selects, reduced to one number."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=100)]
    body: str | None = None
    at: (
        Annotated[tuple[Annotated[tuple[_in("m"), ...], BeforeValidator(as_tuple)], ...], BeforeValidator(as_tuple)]
        | None
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
    formats: Annotated[tuple[Literal["vtu", "xdmf", "npz"], ...], BeforeValidator(as_tuple)] = ("vtu",)
    fields: Strings = ("velocity", "stress")
    history: Cadence | None = None


def _due(value: object) -> int | float:
    """Steps, or wall time."""
    if isinstance(value, float):
        raise ValueError(f'{value} is no number of steps; for wall time write it with its unit, "10 min"')
    return _cadence(value)


class Checkpoint(Model):
    """When the whole state is kept, to resume from: an integer counts steps, "10 min" is wall time; the last `keep` stay."""

    every: Annotated[int | float, BeforeValidator(_due)]
    keep: Annotated[int, Field(ge=1)] = 2


class Stop(Model):
    """When a run that goes on by itself is ended."""

    energy: _in("", gt=0) = 0.10


class Scene(Model):
    """A whole scene. `wsph.Scene(...)` and a TOML file take the same keys; both raise SceneError."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=False)

    schema_: Annotated[Literal[1], BeforeValidator(_whole), Field(alias="schema")]
    title: str = ""
    dim: Annotated[Literal[1, 2, 3], BeforeValidator(_whole)]
    run: Run
    bodies: Annotated[tuple[Body, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    functions: dict[str, Function] = {}
    boundary: Annotated[tuple[Boundary, ...], BeforeValidator(as_tuple)] = ()
    contact: Annotated[tuple[Contact, ...], BeforeValidator(as_tuple)] = ()
    probes: Annotated[tuple[Probe, ...], BeforeValidator(as_tuple)] = ()
    gravity: dict[Literal["x", "y", "z"], _in("m/s2")] = {}
    output: Output = Output()
    checkpoint: Checkpoint | None = None
    stop: Stop = Stop()

    _source: str = PrivateAttr("scene")
    _lines: dict[str, int] = PrivateAttr(default_factory=dict)

    def __init__(self, /, **data: Any):
        faults: list[Fault] = []
        try:
            super().__init__(**data)
        except ValidationError as error:
            faults = [of_validation(e, Scene) for e in error.errors(include_url=False)]
            faults += _beyond(data, error)
        else:
            faults = list(between_tables(self))
        faults += of_plugins(data)
        if faults:
            raise SceneError("scene", faults)

    def __hash__(self) -> int:
        return hash(self.model_dump_json())

    def __eq__(self, other: object) -> bool:
        # Where a scene was read is not part of what it is.
        return isinstance(other, Scene) and self.model_dump() == other.model_dump()

    def located(self, error: SceneError) -> SceneError:
        """A fault found later, with this scene's file and the lines of its keys."""
        return SceneError(self._source, [Fault(line_of(self._lines, f.key), f.key, f.message) for f in error.faults])

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
        changed = Scene(**data)
        changed._source, changed._lines = self._source, self._lines
        return changed

    def value(self, value: Value, unit: str) -> Expression | Function:
        """What a value of the scene means: a table of `functions`, or an expression (a number is a constant one)."""
        if isinstance(value, str) and value in self.functions:
            function = self.functions[value]
            return compile_expression(function.expression) if function.expression is not None else function
        if isinstance(value, str):
            # What begins as a number with a unit is one: "1 MPa" where a velocity belongs is a wrong unit, no expression.
            return constant_program(quantity(value, unit)) if looks_like_quantity(value) else compile_expression(value)
        return constant_program(float(value))


def apply_override(data: dict[str, Any], path: str, value: Any) -> None:
    """Set the dotted `path` in a scene's data. Raises SceneError where the path leads nowhere."""
    keys = path.split(".") if "." in path or path in (*Scene.model_fields, "schema") else ["run", path]
    if keys in (["run", "cfl"], ["run", "dt"]) and isinstance(data.get("run"), dict):
        data["run"].pop("dt" if keys[1] == "cfl" else "cfl", None)
    place: Any = data
    for key in keys[:-1]:
        if isinstance(place, dict):
            place = place.setdefault(key, {})
        elif isinstance(place, list) and key.isdigit() and int(key) < len(place):
            place = place[int(key)]
        else:
            raise SceneError("scene", [Fault(0, path, f"there is no entry {key!r}")])
    if isinstance(place, dict):
        place[keys[-1]] = value
    elif isinstance(place, list) and keys[-1].isdigit() and int(keys[-1]) < len(place):
        place[int(keys[-1])] = value
    else:
        raise SceneError("scene", [Fault(0, path, f"there is no entry {keys[-1]!r}")])


def load(path: str | Path, overrides: dict[str, Any] | None = None) -> Scene:
    """Read and validate a scene file. Raises SceneError with every fault, its line and key."""
    source = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(source, [Fault(0, "", "no such file")]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(source, [Fault(0, "", f"cannot be read: {error}")]) from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, found = str(error), re.search(r" \(at line (\d+), column (\d+)\)", str(error))
        line = int(found[1]) if found else 0
        raise SceneError(source, [Fault(line, "", f"is not TOML: {message.split(' (at ')[0]}")]) from None
    where = lines(text)
    try:
        for key, value in (overrides or {}).items():
            apply_override(data, key, value)
        scene = Scene(**data)
    except SceneError as error:
        found = [Fault(line_of(where, f.key), f.key, f.message) for f in error.faults]
        raise SceneError(source, found) from None
    scene._source, scene._lines = source, where
    return scene


def _beyond(data: dict[str, Any], error: ValidationError) -> list[Fault]:
    """Faults between tables of a scene that has unknown keys: found without them, so that all are told at once."""
    if any(e["type"] != "extra_forbidden" for e in error.errors()):
        return []
    repaired = copy.deepcopy(data)
    for e in error.errors():
        place: Any = repaired
        *outer, last = scene_path(e["loc"])
        for key in outer:
            place = place[key]
        place.pop(last, None)
    try:
        Scene(**repaired)
    except SceneError as other:
        return other.faults
    return []
