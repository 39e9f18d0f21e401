"""Functions of time, or of time and place, as a scene's table has them."""

# pyright: strict

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Literal, cast

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from wsph.declarations import QUANTITY, example
from wsph.expressions import OPERATIONS, Expression
from wsph.quantities import Model, Unit, as_tuple, is_list
from wsph.units import in_si, quantity

MOST_ENTRIES = 400
"""Of a table in time and place: every evaluation looks at all of them."""


def _entry(value: object) -> object:
    """A number, or a string with a unit: which one it is to be is known where the function is used."""
    if isinstance(value, str):
        in_si(value)
        return value
    return quantity(value, "")


_NUMBER_OR_QUANTITY = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": QUANTITY}], "unit": "of its use"}
_Entry = Annotated[float | str, BeforeValidator(_entry), WithJsonSchema(_NUMBER_OR_QUANTITY)]
_Row = Annotated[tuple[_Entry, ...], BeforeValidator(as_tuple)]
_Places = Annotated[tuple[Annotated[float, Unit("m")], ...], BeforeValidator(as_tuple), Field(min_length=2)] | None


def _kind(value: object) -> str:
    """Whether values are those of the time alone, or rows of them."""
    rows: Sequence[object] = ()
    if is_list(value) or isinstance(value, tuple):
        rows = cast(Sequence[object], value)
    return "function-rows" if any(isinstance(row, list | tuple) for row in rows) else "function-row"


_Values = Annotated[
    Annotated[_Row, Tag("function-row")] | Annotated[tuple[_Row, ...], BeforeValidator(as_tuple), Tag("function-rows")],
    Discriminator(_kind),
]


class Function(Model):
    """A function of time: a table (t, value, interp), or an expression of x, y, z, t; or a table of time and place, where
    x, y or z has coordinates of the reference and `value` a row a time, linear between and constant beyond. Values are
    numbers in SI, or strings with a unit, "-5 MPa"."""

    model_config = example({"t": [0.0, "1 ms"], "value": [0.0, "5 MPa"], "interp": "linear"})
    t: Annotated[tuple[Annotated[float, Unit("s")], ...], BeforeValidator(as_tuple)] | None = None
    """times, increasing: the first value holds before, the last one after"""
    x: _Places = None
    """places of the columns of `value`"""
    y: _Places = None
    """the same along y"""
    z: _Places = None
    """the same along z"""
    value: _Values | None = None
    """a value a time, or a row of them: numbers in SI, or strings with a unit"""
    interp: Literal["linear", "step"] = "linear"
    """between the times; a step holds from one entry to the next"""
    expression: str | None = None
    """of x, y, z and t, in place of a table"""

    @model_validator(mode="after")
    def _table_or_expression(self) -> "Function":
        if (self.expression is None) == (self.t is None and self.value is None):
            raise ValueError("either a table (t and value) or an expression is needed")
        if self.expression is None:
            if self.t is None or self.value is None or len(self.t) != len(self.value) or not self.t:
                raise ValueError("t and value must have the same number of entries, at least one")
            for name, entries in (("t", self.t), ("x", self.x), ("y", self.y), ("z", self.z)):
                if entries is not None and any(a >= b for a, b in pairwise(entries)):
                    raise ValueError(f"{name} must increase from entry to entry")
            self._check_rows()
        elif self.axis:
            raise ValueError(f"{self.axis[0]} goes with a table (t and value)")
        return self

    def _check_rows(self) -> None:
        """Raise ValueError where the values are no rows over the places that it names."""
        listed = [isinstance(each, tuple) for each in self.value or ()]
        if not self.axis:
            if any(listed):
                raise ValueError("value has rows: name the places of their columns, as x = [0.0, 1.0]")
            return
        name, places = self.axis
        if len([each for each in (self.x, self.y, self.z) if each is not None]) > 1:
            raise ValueError("a table is of the time and of one of x, y and z")
        if not all(listed) or any(len(row) != len(places) for row in self.rows):
            raise ValueError(
                f"value has a row for every t, each with a number for every entry of {name}: {len(places)}"
            )
        if self.interp != "linear":
            raise ValueError(f'interp = "{self.interp}" is of a table of the time alone')
        if len(self.rows) * len(places) > MOST_ENTRIES:
            count = len(self.rows) * len(places)
            raise ValueError(
                f"has {count} values; at most {MOST_ENTRIES}: every particle looks at all of them in every step"
            )

    @property
    def axis(self) -> tuple[str, tuple[float, ...]] | None:
        """The axis and the places of its columns [m], of a table in time and place."""
        return next(((name, each) for name, each in zip("xyz", (self.x, self.y, self.z), strict=True) if each), None)

    @property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """The rows of a table in time and place, one a time, in SI."""
        return tuple(tuple(map(_number, each if isinstance(each, tuple) else (each,))) for each in self.value or ())

    @property
    def column(self) -> tuple[float, ...]:
        """The values of a table of the time alone, in SI."""
        return tuple(_number(each) for each in self.value or (0.0,) if not isinstance(each, tuple))

    def within(self, unit: str) -> "Function":
        """The table with its values as numbers in an SI unit. Raises ValueError where one has another."""
        value = self.value or ()
        if not any(isinstance(each, str) for row in value for each in (row if isinstance(row, tuple) else (row,))):
            return self
        numbers = tuple(
            tuple(_number(each, unit) for each in row) if isinstance(row, tuple) else _number(row, unit)
            for row in value
        )
        return self.model_copy(update={"value": numbers})

    @property
    def program(self) -> Expression | None:
        """A table in time and place as an expression, None where it is one of the time alone."""
        if self.axis is None:
            return None
        name, places = self.axis
        columns = list(zip(*self.rows, strict=True))
        times = self.t or (0.0,)
        found = _piecewise("t", times, columns[0])
        for k, (left, right) in enumerate(pairwise(columns)):
            change = [b - a for a, b in zip(left, right, strict=True)]
            part = [*_piecewise("t", times, change), *_share(name, places[k], places[k + 1]), _op("multiply")]
            found += [*part, _op("add")]
        return Expression(f"a table of {name} and t", tuple(found))

    def at(self, time: float) -> float:
        """The value of a table at a time [s]: it holds its first value before, and its last one after; a step holds from
        just after an entry to the next."""
        t, value = self.t or (0.0,), self.column
        if self.interp == "linear":
            return float(np.interp(time, t, value))
        return value[max(bisect_left(t, time) - 1, 0)]


def _number(entry: float | str, unit: str | None = None) -> float:
    """An entry in SI; of a `unit`, where that is given."""
    if not isinstance(entry, str):
        return entry
    return in_si(entry)[0] if unit is None else quantity(entry, unit)


Instruction = tuple[int, float]


def _op(name: str, number: float = 0.0) -> Instruction:
    return OPERATIONS[name], number


def _share(variable: str, low: float, high: float) -> list[Instruction]:
    """How far a variable is from `low` to `high`, 0 before and 1 beyond."""
    ratio = [_op(variable), _op("constant", low), _op("subtract"), _op("constant", 1.0 / (high - low)), _op("multiply")]
    return [*ratio, _op("constant", 0.0), _op("max"), _op("constant", 1.0), _op("min")]


def _piecewise(variable: str, at: Sequence[float], values: Sequence[float]) -> list[Instruction]:
    """Linear from value to value, constant beyond: the first, and what each piece adds to it."""
    found = [_op("constant", values[0])]
    for low, high, a, b in zip(at, at[1:], values, values[1:], strict=False):
        if a != b:
            found += [*_share(variable, low, high), _op("constant", b - a), _op("multiply"), _op("add")]
    return found
