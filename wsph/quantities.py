"""How quantities are written in a scene: the types of its tables' keys."""

from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from wsph.units import quantity


def _length(value: object) -> float:
    return quantity(value, "m")


def as_tuple(value: Any) -> Any:
    """A list of a scene as the tuple that its model holds."""
    return tuple(value) if isinstance(value, list) else value


Length = Annotated[float, BeforeValidator(_length)]
Positive = Annotated[float, BeforeValidator(_length), Field(gt=0)]
Point = Annotated[tuple[Length, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=3)]


class Model(BaseModel):
    """Base of the scene's tables: unknown keys, wrong types, NaN and infinities are faults."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def in_unit(unit: str, **limits: Any) -> Any:
    return Annotated[float, BeforeValidator(partial(quantity, expected=unit)), Field(**limits)]


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


Cadence = Annotated[int | float, BeforeValidator(read_cadence)]
"""An integer counts steps, a float or a unit string is seconds."""

Value = Annotated[float | str, BeforeValidator(_plain)]
"""A number, a quantity with its unit, an expression of x, y, z, t, or the name of a function."""

Strings = Annotated[tuple[str, ...], BeforeValidator(as_tuple)]


def read_switch(value: Any) -> Any:
    """A part that is there by default: false takes it away."""
    if value is True:
        raise ValueError("true says nothing: leave the key out for the default, or give its coefficient")
    if isinstance(value, (int, float)) and value is not False:
        raise ValueError(f"{value!r} is no table; write {{ coefficient = {value} }}")
    return {"coefficient": 0.0} if value is False else value
