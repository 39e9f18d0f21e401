"""Quantities as scenes write them: the types of the tables' keys."""

# pyright: strict

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal, TypeGuard

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainSerializer,
    ValidationError,
    WithJsonSchema,
    WrapValidator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, ErrorDetails

from wsph.declarations import VALUE, number_schema
from wsph.errors import Fault, SceneError
from wsph.units import quantity

Table = dict[str, object]
"""A table as it stands in a file: its values are numbers, strings, truths, lists and tables."""


def is_table(value: object) -> TypeGuard[Table]:
    """Whether a value of a file is a table."""
    return isinstance(value, dict)


def is_list(value: object) -> TypeGuard[list[object]]:
    """Whether a value of a file is a list."""
    return isinstance(value, list)


def is_sequence(value: object) -> TypeGuard[Sequence[object]]:
    """Whether a value is a list, or the tuple that Python may give for one."""
    return isinstance(value, (list, tuple))


def as_tuple(value: object) -> object:
    """A list of a scene as the tuple that its model holds."""
    return tuple(value) if is_list(value) else value


def printable(name: str) -> str:
    """Names of bodies go into messages and files."""
    if not name.isprintable() or name.strip() != name or not name:
        raise ValueError(
            f"{name!r} has characters that cannot be printed, or blanks at its ends: a name has printed characters"
        )
    return name


def file_name(name: str) -> str:
    """A name that goes into columns, or names a file on every system. Raises ValueError."""
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", name):
        raise ValueError(
            f"{name!r}: a name has at most 100 of a to z, A to Z, 0 to 9, _ . and -, and begins with none of the last two"
        )
    return name


Words = Callable[[ErrorDetails, type[BaseModel]], Fault]


def _plainly(error: ErrorDetails, _: type[BaseModel]) -> Fault:
    return Fault(0, ".".join(map(str, error["loc"])), error["msg"])


in_words: list[Words] = [_plainly]
"""How what is wrong with a table is said, by those who know the scene: the last of them."""


class Made(type(BaseModel)):
    """What makes a table from Python: its faults are SceneErrors, as those of a scene file are."""

    if not TYPE_CHECKING:  # whose checks of keys are by the class

        def __call__(cls, *given, **keys):
            try:
                return super().__call__(*given, **keys)
            except ValidationError as error:
                faults = [in_words[-1](each, cls) for each in error.errors(include_url=False)]
                raise SceneError(cls.__name__, faults) from None


class Model(BaseModel, metaclass=Made):
    """Base of the scene's tables: unknown keys, wrong types, NaN and infinities are faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


@dataclass(frozen=True)
class Unit:
    """A number in a unit ("" for a plain number), or a string with such a unit: `Annotated[float, Unit("m", gt=0)]`."""

    unit: str
    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = BeforeValidator(partial(quantity, expected=self.unit))
        return handler.generate_schema(Annotated[float, number, Field(gt=self.gt, ge=self.ge, lt=self.lt, le=self.le)])

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return number_schema(self.unit, self.gt, self.ge, self.lt, self.le)


Length = Annotated[float, Unit("m")]
Positive = Annotated[float, Unit("m", gt=0)]
Point = Annotated[tuple[Length, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=3)]


def _unless_auto(value: object, number: Callable[[object], float]) -> object:
    return value if value == "auto" else number(value)


def as_it_is(value: object) -> object:
    """How a value of several types is written."""
    return value


if TYPE_CHECKING:
    NumberOrAuto = float | Literal["auto"]
else:
    _auto = WithJsonSchema({"anyOf": [number_schema("", 0.0), {"const": "auto"}]})
    NumberOrAuto = Annotated[float, Unit("", gt=0), WrapValidator(_unless_auto), PlainSerializer(as_it_is), _auto]


def read_cadence(value: object) -> int | float:
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value < 2**53:
            raise ValueError(f'{value} steps: from 1 to 2^53 (or a time such as "1 ms")')
        return value
    seconds = quantity(value, "s")
    if seconds <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return seconds


def _plain(value: object) -> object:
    return value if isinstance(value, str) else quantity(value, "")


_CADENCE = {"anyOf": [{"type": "integer", "minimum": 1}, number_schema("s", 0.0)], "unit": "steps, or s"}

Cadence = Annotated[int | float, BeforeValidator(read_cadence), WithJsonSchema(_CADENCE)]
"""An integer counts steps, a float or a unit string is seconds."""

Value = Annotated[float | str, BeforeValidator(_plain), WithJsonSchema(VALUE)]
"""A number, a quantity with its unit, an expression of x, y, z, t, or the name of a function."""

Strings = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]


def read_switch(value: object) -> object:
    """A part that is there by default: false takes it away."""
    if value is True:
        raise ValueError("true says nothing: leave the key out for the default, or give its coefficient")
    if isinstance(value, (int, float)) and value is not False:
        raise ValueError(f"{value!r} is no table; write {{ coefficient = {value} }}")
    return {"coefficient": 0.0} if value is False else value
