"""The tables of a scene, as validated data."""

# pyright: strict

import dataclasses
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Literal, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    WithJsonSchema,
    create_model,
    model_validator,
)
from pydantic.config import JsonDict
from pydantic.fields import FieldInfo

from wsph.boundary.loads.regions import GRAVITY, RegionForce
from wsph.boundary.tables import Boundary, Function
from wsph.declarations import Also, Choice, Measured, example, list_of, number_schema
from wsph.expressions import Expression, compile_expression, constant_program
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.shape import BaseShape, Rotation
from wsph.output.fields import Formula
from wsph.parts.body_force import Damping
from wsph.parts.part import Part
from wsph.parts.table import PARTS
from wsph.plugins.formulations import names
from wsph.plugins.options import keys_of
from wsph.quantities import (
    Model,
    NumberOrAuto,
    Table,
    Unit,
    Value,
    as_tuple,
    is_sequence,
    is_table,
    printable,
    read_switch,
)
from wsph.scene.messages import none_of
from wsph.scene.numbers import Section, boundary_names
from wsph.scene.outputs import Accuracy, Checkpoint, NamedFormula, Output, Stop
from wsph.scene.probes import Probe
from wsph.scene.states import Initial, Relax, Stage, begins_of, windows_of
from wsph.scene.touch.contact import Contact
from wsph.scene.touch.tools import Tool
from wsph.sph.smoothing import DEFAULT, SMOOTHING
from wsph.units import looks_like_quantity, quantity


def _whole(value: object) -> object:
    # Literal compares: without this 1.0 and true would pass for 1.
    if isinstance(value, (bool, float)):
        raise ValueError(f"{value!r} must be a whole number")
    return value


DEVICE = r"^(auto|cpu|cuda(:\d+)?)$"


def _device(name: str) -> str:
    if not re.match(DEVICE, name):
        raise ValueError(f'{name!r} is no device: write "auto", "cpu", "cuda" or "cuda:1" (a number of a GPU)')
    return name


def _known(name: str, known: Iterable[str]) -> str:
    if name not in (known := tuple(known)):
        raise ValueError(none_of(name, known))
    return name


class IntegratorSpec(Model):
    """An integrator's registry name and its own options."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)
    name: str

    def options(self) -> dict[str, object]:
        """The integrator's own keys."""
        return dict(self.model_extra or {})


class MaterialSpec(Model):
    """A material's registry name and its own fields."""

    model_config = ConfigDict(strict=True, extra="allow", frozen=True)
    model: str

    def options(self) -> dict[str, object]:
        """The material's own keys."""
        return dict(self.model_extra or {})


def _material(value: object) -> object:
    """A material as an object of a plugin, by its keys."""
    return keys_of("materials", value) if dataclasses.is_dataclass(value) else value


def _named(value: object) -> object:
    return {"name": value} if isinstance(value, str) else value


class Run(Model):
    """How to integrate: method, time, precision, device."""

    model_config = example({"integrator": "leapfrog", "end": "1 ms", "cfl": "auto"})
    integrator: Annotated[IntegratorSpec, BeforeValidator(_named), Also({"type": "string"})]
    end: Annotated[float, Unit("s", gt=0)] | None = None
    """when it ends; with `steps` it is their sum"""
    cfl: NumberOrAuto | None = None
    """Courant number: time step times wave speed over spacing, or the largest stable step"""
    dt: Annotated[float, Unit("s", gt=0)] | None = None
    """time step, in place of cfl"""
    precision: Literal["f64", "f32"] = "f64"
    """double or single"""
    device: Annotated[str, AfterValidator(_device), WithJsonSchema({"type": "string", "pattern": DEVICE})] = "auto"
    """cpu, cuda or cuda:1; auto takes a GPU where there is one"""
    threads: Annotated[int, Field(ge=0, le=1024)] = 0
    """of the CPU; 0: all cores, where a scene is worth it"""
    formulation: Annotated[str, AfterValidator(lambda name: _known(name, names())), Choice(tuple(names()))] | None = (
        None
    )
    """what particles see; without it that of the integrator"""
    correction: Literal["symmetric", "paper"] = "symmetric"
    """of the kernel's gradients: keeps momentum, or as published"""
    kernel: Annotated[str, AfterValidator(lambda name: _known(name, SMOOTHING)), Choice(tuple(SMOOTHING))] = DEFAULT
    """smoothing kernel; one that is named asks for the pairs of a kernel"""
    support: Annotated[float, Unit("", gt=0)] | None = None
    """radius of the kernel in spacings; without it that of the form"""
    guard: Literal["refuse", "warn", "off"] = "refuse"
    """what becomes of a time step beyond the limit"""
    seed: Annotated[int, Field(ge=0)] = 0
    """of what is random, as jitter"""

    @model_validator(mode="after")
    def _one_step(self) -> "Run":
        if (self.cfl is None) == (self.dt is None):
            raise ValueError(
                "exactly one of cfl and dt is needed: " + ("neither is given" if self.cfl is None else "both are given")
            )
        return self

    @property
    def kernel_by(self) -> str:
        """The key that asks for the pairs of a kernel, where a form has others by default; "" where none does."""
        return "run.support" if self.support is not None else "run.kernel" if self.kernel != DEFAULT else ""


_Point = Annotated[tuple[Annotated[float, Unit("m")], ...], BeforeValidator(as_tuple)]


class CrackLine(Model):
    """A cut from the start: in 2D a segment, in 3D a rectangle with these two corners. Reference coordinates."""

    model_config = example({"from": [0.0, 0.0], "to": ["10 mm", 0.0]})
    start: _Point = Field(alias="from")
    end: _Point = Field(alias="to")


def _spacing(value: object, info: ValidationInfo) -> object:
    """One length, or one for each axis, or what a number of cells comes to across the longest edge of the shape's bounds, or
    numbers for each axis."""
    if is_table(value):
        return _of_cells(value, info.data.get("shape"))
    lengths = tuple(quantity(v, "m") for v in value) if is_sequence(value) else quantity(value, "m")
    if not ((isinstance(lengths, tuple) and lengths) or isinstance(lengths, float)):
        raise ValueError(f"{value!r} is no length and no list of lengths")
    if min(lengths if isinstance(lengths, tuple) else (lengths,)) <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return lengths


def _of_cells(table: Table, shape: BaseShape | None) -> object:
    if set(table) != {"cells"}:
        raise ValueError("as a table it is { cells = 40 }, across the longest edge, or { cells = [40, 20] }")
    if shape is None:
        raise ValueError("counts cells across a shape, and there is none")
    low, high = shape.bounds()
    cells = table["cells"]
    counts = tuple(cells) if is_sequence(cells) else (cells,)
    if not all(isinstance(n, int) and not isinstance(n, bool) and n > 0 for n in counts):
        raise ValueError(f"cells = {cells!r} is no whole number above zero and no list of such")
    if len(counts) not in (1, len(low)):
        raise ValueError(f"cells = {cells!r} has {len(counts)} numbers in {len(low)}D")
    if len(counts) == 1:
        return float((high - low).max()) / cast(int, counts[0])
    return tuple(float(side) / cast(int, n) for side, n in zip(high - low, counts, strict=True))


_COUNT = {"type": "integer", "minimum": 1}
_CELLS = {
    "type": "object",
    "properties": {"cells": {"anyOf": [_COUNT, list_of(_COUNT)]}},
    "required": ["cells"],
    "additionalProperties": False,
}
_EACH = number_schema("m", 0.0)
_SPACING = {"anyOf": [_EACH, list_of(_EACH), _CELLS], "unit": "m"}


def _spaced(value: float | tuple[float, ...] | None, info: ValidationInfo) -> float | tuple[float, ...] | None:
    if value is None and info.data.get("mesh") is None and info.data.get("points") is None:
        raise ValueError("is missing")
    return value


class MeshFile(Model):
    """Cells from a `file`, looked for beside the scene, whose lengths are in units of `scale`; `part`: of its groups of
    cells this one alone."""

    file: Annotated[str, Field(min_length=1)]
    scale: Annotated[float, Unit("m", gt=0)] = 1.0
    part: str | None = None


class PointsFile(Model):
    """Particles alone, from a `file` of comma-separated x, y, z and volume in units of `scale`, beside the scene."""

    file: Annotated[str, Field(min_length=1)]
    scale: Annotated[float, Unit("m", gt=0)] = 1.0


_OF_POINTS = PointsFile.model_json_schema()
_POINTS = {
    "type": "object",
    "properties": {"type": {"const": "points"}, **_OF_POINTS["properties"]},
    "required": ["type", *_OF_POINTS["required"]],
    "additionalProperties": False,
}


def _listed(value: object) -> object:
    """One table as a list of one."""
    return (value,) if is_table(value) else as_tuple(value)


class _Matter(Model):
    """The keys of a body, without those of its parts."""

    name: Annotated[str, Field(max_length=100), AfterValidator(printable)]
    """of messages, files and columns"""
    mesh: MeshFile | None = None
    """cells from a file, in place of a shape"""
    points: PointsFile | None = None
    """particles alone from a file, in place of a shape"""
    shape: Annotated[Shape | None, Also(_POINTS)] = None
    """its region, cut into cells or fitted"""
    spacing: Annotated[
        Annotated[float | tuple[float, ...], BeforeValidator(_spacing), WithJsonSchema(_SPACING)] | None,
        AfterValidator(_spaced),
        Field(validate_default=True),
    ] = None
    """edge of a cell, one or one an axis, or { cells = n } across it"""
    lattice_rotate: Rotation = 0.0
    """turns the lattice inside the shape"""
    map: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] | None = None
    """expressions of x, y, z that move the lattice"""
    state: Literal["stress", "strain"] | None = None
    """plane stress or plane strain; in 1D a bar or a column"""
    surface: Literal["fitted", "stairs"] | None = None
    """whether its surface is fitted or in steps of a cell"""
    jitter: Annotated[float, Unit("", ge=0, le=0.5)] = 0.0
    """moves nodes at random, a part of the spacing"""
    cracks: Annotated[tuple[CrackLine, ...], BeforeValidator(as_tuple)] = ()
    """cuts from the start"""
    damping: Damping | None = None
    """a = -rate v"""
    body_force: Annotated[tuple[RegionForce, ...], BeforeValidator(_listed), Also({"type": "object"})] = ()
    """force per volume, by component"""


def _key_of(part: type[Part]) -> object:
    """The type of a part's key: its table, or false where it is switchable."""
    return (
        Annotated[part | None, BeforeValidator(read_switch), Also({"const": False})] if part.switchable else part | None
    )


if TYPE_CHECKING:
    _WithParts = _Matter
else:
    _WithParts = create_model(
        "_WithParts", __base__=_Matter, **{key: (_key_of(part), None) for key, part in PARTS.items()}
    )


_BODY: JsonDict = {
    "name": "bar",
    "shape": {"type": "box", "min": [0.0, 0.0], "max": ["100 mm", "20 mm"]},
    "spacing": "1 mm",
    "state": "stress",
    "material": {"model": "elastic", "density": 7850.0, "youngs_modulus": "210 GPa", "poisson_ratio": 0.3},
}


class Body(_WithParts):
    """One deformable body."""

    model_config = example(_BODY)
    placement: Literal["cells", "nodes"] | None = None
    """where particles of one set are"""
    velocity: Annotated[tuple[Annotated[Value, Measured("m/s")], ...], BeforeValidator(as_tuple)] | None = None
    """initial, by component"""
    initial: Initial | None = None
    """what it begins with beside its velocity"""
    material: Annotated[MaterialSpec, BeforeValidator(_material)]
    """its law, by `model`, and the fields of that"""

    @model_validator(mode="before")
    @classmethod
    def _points_as_a_shape(cls, data: object) -> object:
        """`shape = { type = "points", file = ... }` is `points = { file = ... }`."""
        shape = data.get("shape") if is_table(data) else None
        if is_table(data) and is_table(shape) and shape.get("type") == "points" and "points" not in data:
            rest = {key: value for key, value in data.items() if key != "shape"}
            return {**rest, "points": {key: value for key, value in shape.items() if key != "type"}}
        return data

    @model_validator(mode="after")
    def _of_shape_or_mesh(self) -> "Body":
        if [self.shape, self.mesh, self.points].count(None) != 2:
            raise ValueError("exactly one of shape, mesh and points is needed")
        given = [
            key
            for key in ("spacing", "lattice_rotate", "map", "surface", "jitter", "cracks", "placement")
            if getattr(self, key)
        ]
        if self.shape is None and given:
            raise ValueError(f"{', '.join(given)} is of bodies with a shape; a file has its own cells or particles")
        return self

    @property
    def unscaled(self) -> str:
        """The key of a file whose lengths are metres because no `scale` says otherwise; "" where there is none."""
        if self.shape is not None:
            return "shape" if self.shape.unscaled else ""
        files = {"mesh": self.mesh, "points": self.points}
        return next((key for key, file in files.items() if file and "scale" not in file.model_fields_set), "")

    @property
    def parts(self) -> dict[str, Part]:
        """The parts that the scene names, by their keys, those that it switches off included."""
        given = {key: getattr(self, key, None) for key in PARTS}
        return {key: part for key, part in given.items() if part is not None}


class SceneTables(Model):
    """The keys of a whole scene."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False, populate_by_name=False)

    schema_: Annotated[Literal[1], BeforeValidator(_whole), Field(alias="schema")]
    title: str = ""
    dim: Annotated[Literal[1, 2, 3], BeforeValidator(_whole)]
    run: Run
    bodies: Annotated[tuple[Body, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    functions: dict[str, Function] = {}
    boundary: Annotated[tuple[Boundary, ...], BeforeValidator(as_tuple)] = ()
    contact: Annotated[tuple[Contact, ...], BeforeValidator(as_tuple)] = ()
    sections: Annotated[tuple[Section, ...], BeforeValidator(as_tuple)] = ()
    tools: Annotated[tuple[Tool, ...], BeforeValidator(as_tuple)] = ()
    probes: Annotated[tuple[Probe, ...], BeforeValidator(as_tuple)] = ()
    gravity: dict[Literal["x", "y", "z"], Annotated[Value, Measured(GRAVITY)]] = {}
    accuracy: Accuracy | None = None
    fields: dict[str, NamedFormula] = {}
    output: Output = Output()
    checkpoint: Checkpoint | None = None
    stop: Stop = Stop()
    relax: Relax | None = None
    steps: Annotated[tuple[Stage, ...], BeforeValidator(as_tuple)] = ()

    @property
    def end(self) -> float:
        """When the run ends [s]."""
        return self.run.end if self.run.end is not None else self.begins[-1]

    @property
    def begins(self) -> tuple[float, ...]:
        """When each step of [[steps]] begins, and when the last ends [s]."""
        return begins_of(self.steps)

    @property
    def formulas(self) -> dict[str, Formula]:
        """The fields that the scene makes of others, by name."""
        return {name: each.formula for name, each in self.fields.items()}

    @property
    def relaxes(self) -> bool:
        """Whether bodies come to rest anywhere."""
        return self.relax is not None or any(stage.relax is not None for stage in self.steps)

    @property
    def relaxes_first(self) -> bool:
        """Whether they do before the first step."""
        return self.relax is not None or any(stage.relax is not None for stage in self.steps[:1])

    def windows(self, names: tuple[str, ...]) -> tuple[tuple[float, float], ...]:
        """The times in which steps are, by their names: joined where one follows another. The first begins before all times,
        and the last has no end."""
        return windows_of(self.steps, names)

    @property
    def boundary_names(self) -> tuple[str, ...]:
        """The names of the boundaries, those that the scene leaves out too."""
        return boundary_names(self.boundary)

    @property
    def balls(self) -> frozenset[str]:
        """The bodies whose particles are balls to others: those of pinball contact."""
        return frozenset(name for contact in self.contact if contact.law == "pinball" for name in contact.names)

    def value(self, value: Value, unit: str) -> Expression | Function:
        """The meaning of a value in the scene: a table of `functions`, or an expression (a number is a constant one)."""
        if isinstance(value, str) and value in self.functions:
            function = self.functions[value]
            if function.expression is not None:
                return compile_expression(function.expression)
            try:
                function = function.within(unit)
            except ValueError as error:
                raise ValueError(f"functions.{value}.value: {error}") from None
            return function.program or function
        if isinstance(value, str):
            # What begins as a number with a unit is one: "1 MPa" where a velocity belongs is a wrong unit, no expression.
            return constant_program(quantity(value, unit)) if looks_like_quantity(value) else compile_expression(value)
        return constant_program(float(value))


def add_part(part: type[Part], *scenes: type[SceneTables]) -> None:
    """Give bodies the key of a part that has joined `PARTS` after they were defined; `scenes` are the classes built on
    `SceneTables`."""
    PARTS[part.key] = part
    Body.__pydantic_fields__[part.key] = FieldInfo.from_annotated_attribute(cast(type, _key_of(part)), None)
    for model in (Body, SceneTables, *scenes):
        model.model_rebuild(force=True)


def remove_part(part: type[Part], *scenes: type[SceneTables]) -> None:
    """Undo `add_part`."""
    del PARTS[part.key], Body.__pydantic_fields__[part.key]
    for model in (Body, SceneTables, *scenes):
        model.model_rebuild(force=True)
