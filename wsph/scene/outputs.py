"""The tables of a scene that say what a run writes, when it is kept, when it is stopped, and how accurate it is to be."""

# pyright: strict

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from wsph.declarations import QUANTITY, Also, Choice, example
from wsph.expressions import compile_expression, names_in
from wsph.output import formats
from wsph.output.fields import Formula
from wsph.quantities import Cadence, Model, Strings, Unit, as_tuple, quantity, read_cadence
from wsph.scene.messages import none_of
from wsph.units import unit as unit_named


def _format(name: object) -> object:
    known = formats.names()
    if name not in known:
        raise ValueError(none_of(name, known))
    return name


_Format = Annotated[str, BeforeValidator(_format), Choice(tuple(formats.names()))]


def _as_formula(value: object) -> object:
    return {"expression": value} if isinstance(value, str) else value


class FieldFormula(Model):
    """A scalar field made of others by an `expression` of their names, as von_mises and velocity_x, and of x, y, z (the
    reference position), with its `unit` in words."""

    model_config = example({"expression": "0.5*7850*(velocity_x^2 + velocity_y^2)", "unit": "J/m3"})
    expression: Annotated[str, Field(min_length=1)]
    unit: str = ""

    @model_validator(mode="after")
    def _readable(self) -> "FieldFormula":
        if self.formula.expression.uses("t"):
            raise ValueError(f"{self.expression!r} uses t: a field is of the state alone")
        _ = unit_named(self.unit)
        return self

    @property
    def formula(self) -> Formula:
        """As frames and probes compute it."""
        return Formula(compile_expression(self.expression, names_in(self.expression)), self.unit)


NamedFormula = Annotated[FieldFormula, BeforeValidator(_as_formula), Also({"type": "string"})]
"""A formula, or its expression alone."""


GATHERED = 1_000_000
"""Particles up to which one of the processes that share them writes whole frames, where a scene says nothing: it takes 0.25
to 0.45 GB for each (tests/benchmarks/parts.py)."""


class Output(Model):
    """Fields and formats of the output, and when it is written."""

    model_config = example({"every": "0.1 ms", "formats": ["vtu"], "fields": ["velocity", "stress", "von_mises"]})
    every: Cadence | None = None
    """between frames: steps, or time with a unit"""
    formats: Annotated[tuple[_Format, ...], BeforeValidator(as_tuple)] = ("vtu",)
    """of frames"""
    fields: Strings = ("velocity", "stress")
    """of frames (`wsph list fields`)"""
    positions: Literal["current", "reference"] = "current"
    """where particles of frames are: now, or at the start"""
    parts: bool | Literal["auto"] = "auto"
    """of processes that share a scene: frames in a file a process, and one that joins them; auto: of more than a million
    particles"""
    history: Cadence | None = None
    """between rows of history.csv: steps, or time with a unit"""

    @model_validator(mode="after")
    def _joined(self) -> "Output":
        if self.parts is True and (alone := self._alone):
            raise ValueError(f"parts: a frame as {', '.join(alone)} is one file: leave out either")
        return self

    @property
    def _alone(self) -> list[str]:
        """The formats whose frames have no parts."""
        return [each.name for each in formats.named(self.formats) if each.joins is None]

    def in_parts(self, particles: int, processes: int) -> bool:
        """Whether each of so many processes writes its part of the frames of so many particles."""
        if processes == 1 or self.parts is False:
            return False
        return self.parts is True or (not self._alone and particles > GATHERED)


def _due(value: object) -> int | float | None:
    """Steps, or wall time."""
    if value is None:
        return None
    if isinstance(value, float):
        raise ValueError(f'{value} is no number of steps; for wall time write it with its unit, "10 min"')
    return read_cadence(value)


_DUE = {"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string", "pattern": QUANTITY}], "unit": "steps, or s"}


class Checkpoint(Model):
    """When the whole state is kept, to resume from: an integer counts steps, "10 min" is wall time; the last `keep` stay.
    `final`: at the end too, so that a longer run may go on from there, or a body of another scene begin with it."""

    model_config = example({"every": "10 min"})
    every: Annotated[int | float | None, BeforeValidator(_due), WithJsonSchema(_DUE)] = None
    """steps, or wall time with a unit"""
    keep: Annotated[int, Field(ge=1)] = 2
    """how many stay, the last ones"""
    final: bool = False
    """one at the end too"""

    @model_validator(mode="after")
    def _sometime(self) -> "Checkpoint":
        if self.every is None and not self.final:
            raise ValueError("says not when: give every, or final = true")
        return self


class Stop(Model):
    """The limit that ends a run early: energy created, as a part of the largest seen."""

    model_config = example({"energy": 0.1})
    energy: Annotated[float, Unit("", gt=0)] = 0.10
    """created, as a part of the largest seen"""


Quantity = Literal["history", "frequency", "mean", "final", "peak", "arrival"]
"""What of a probe's columns a tolerance is of; `wsph.accuracy.measures` says what each is."""


def read_tolerance(value: object) -> float:
    """A relative error as a number or in per cent: 0.01 or "1%". Raises ValueError."""
    text = value.strip() if isinstance(value, str) else ""
    try:
        number = 0.01 * float(text[:-1]) if text.endswith("%") else float(text) if text else quantity(value, "")
    except ValueError:
        raise ValueError(f'{value!r} is no tolerance: write a relative error, "1%" or 0.01') from None
    if not 0.0 < number < 1.0:
        raise ValueError(f"{value!r} is not above 0 and below 1 (100%)")
    return number


Tolerance = Annotated[float, BeforeValidator(read_tolerance)]


def _unless_false(value: object) -> object:
    if value is True:
        raise ValueError('true says nothing: write a relative error, "1%", or false for what is recorded, not judged')
    return value if value is False or value is None else read_tolerance(value)


Judged = Annotated[float | Literal[False] | None, BeforeValidator(_unless_false)]
"""The tolerance of a probe: its own, that of the scene (None), or false, where it is not judged."""


class Accuracy(Model):
    """How accurate the probes are to be: the `tolerance` of a `quantity` of all their columns, what a search for it may
    cost, as a time (`budget`) or as pair visits (`work`), and what it is `free` to choose beside the time step. `sure`: the
    whole bar is to be within the tolerance, not the estimate alone."""

    tolerance: Tolerance | None = None
    """relative error of all columns of probes, as 1%"""
    quantity: Quantity = "history"
    """what of the columns is judged"""
    sure: bool = False
    """the whole bar within the tolerance, not the estimate alone"""
    budget: Annotated[float, Unit("s", gt=0)] | None = None
    """time that a search may take"""
    work: Annotated[float, Unit("", gt=0)] | None = None
    """pair visits that it may cost, in place of budget"""
    free: Annotated[
        tuple[Literal["spacing", "integrator", "formulation", "precision"], ...], BeforeValidator(as_tuple)
    ] = ("spacing",)
    """what it may choose beside the time step"""

    @model_validator(mode="after")
    def _one_limit(self) -> "Accuracy":
        if self.budget is not None and self.work is not None:
            raise ValueError("budget and work are both given: a search has one limit")
        if "spacing" not in self.free:
            raise ValueError('free leaves out "spacing", and without it there is no row to compare with')
        return self
