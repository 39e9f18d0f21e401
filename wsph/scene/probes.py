"""The table of a scene that says what is recorded: probes."""

# pyright: strict

import json
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from wsph.declarations import example
from wsph.quantities import Cadence, Model, Point, Strings, Unit, as_tuple, file_name, is_sequence
from wsph.scene.messages import none_of
from wsph.scene.numbers import NUMBERS
from wsph.scene.outputs import Judged, Quantity


class Line(Model):
    """Material points evenly along a line, its ends included."""

    model_config = example({"from": [0.0, "5 mm"], "to": ["100 mm", "5 mm"], "points": 51})
    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    points: Annotated[int, Field(ge=2, le=10_000)] = 51

    @property
    def places(self) -> tuple[tuple[float, ...], ...]:
        """The points [m]."""
        return tuple(
            tuple(a + (b - a) * k / (self.points - 1) for a, b in zip(self.start, self.end, strict=False))
            for k in range(self.points)
        )


def _points(value: object) -> object:
    """Points, each a list of coordinates."""
    if is_sequence(value) and value and not any(is_sequence(each) for each in value):
        raise ValueError(
            f"{json.dumps(list(value))} is one point, and at is a list of them: write at = [{json.dumps(list(value))}]"
        )
    if is_sequence(value) and any(is_sequence(each) and not each for each in value):
        raise ValueError("[] has 0 coordinates: write those of a point, as in at = [[0.5, 0.0]]")
    return as_tuple(value)


class Probe(Model):
    """A record of fields `at` material points or along a `line`, or of the particles that `where` selects, reduced to one
    number ("integral": over their volume at the start, per depth in 2D); or of the numbers `of` a boundary, contact, tool or
    section. `tolerance` and `quantity`: those of its columns, where they are not the scene's; `scale`: a size in their unit
    [SI] that errors are relative to, in place of their own."""

    model_config = example({"name": "tip", "at": [["100 mm", "10 mm"]], "fields": ["displacement", "stress_xx"]})
    name: Annotated[str, AfterValidator(file_name)]
    """of its columns and file"""
    body: str | None = None
    """whose particles; needed where there are several"""
    at: Annotated[tuple[Point, ...], BeforeValidator(_points)] | None = None
    """material points, by reference coordinates"""
    where: str | None = None
    """a comparison of x, y, z that selects particles"""
    of: str | None = None
    """a boundary, contact, tool or section"""
    line: Line | None = None
    """material points along a line"""
    reduce: Literal["min", "max", "mean", "sum", "integral"] | None = None
    """what becomes of the selected particles' values"""
    fields: Annotated[Strings, Field(min_length=1)]
    """what is recorded (`wsph list fields`)"""
    every: Cadence = 1
    """between rows: steps, or time with a unit"""
    tolerance: Judged = None
    """of its columns, for `--accuracy`; false: they are not judged"""
    quantity: Quantity | None = None
    """what of its columns is judged"""
    scale: Annotated[float, Unit("", gt=0)] | None = None
    """a size that errors are relative to, in the columns' unit"""

    @model_validator(mode="after")
    def _complete(self) -> "Probe":
        if [self.at, self.line, self.where, self.of].count(None) != 3:
            raise ValueError("exactly one of at, line, where and of is needed")
        if self.of is not None and self.body is not None:
            raise ValueError("body goes with at, line and where: what `of` names is one thing in the scene")
        unknown = [name for name in self.fields if name not in NUMBERS]
        if self.of is not None and unknown:
            raise ValueError(f"of {self.of!r} fields are {', '.join(NUMBERS)}: {none_of(unknown[0], NUMBERS)}")
        if self.at is not None and not self.at:
            raise ValueError("at names no point")
        if (self.where is None) != (self.reduce is None):
            raise ValueError('reduce = "min", "max", "mean", "sum" or "integral" goes with where')
        return self

    @property
    def points(self) -> tuple[tuple[float, ...], ...] | None:
        """The material points that it names, None where it names none."""
        return self.line.places if self.line is not None else self.at
