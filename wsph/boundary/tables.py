"""The tables of a scene that say what is prescribed: boundary conditions and functions of time."""

# pyright: strict

from bisect import bisect_left
from typing import TYPE_CHECKING, Annotated, Literal, Protocol, cast

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, create_model, model_validator
from pydantic.fields import FieldInfo

from wsph.boundary.load import LOADS, Load
from wsph.expressions import Expression
from wsph.quantities import Model, Strings, Unit, Value, as_tuple


def _face(value: str) -> str:
    if value not in ("-x", "+x", "-y", "+y", "-z", "+z"):
        raise ValueError(f"{value!r} is no face; write -x, +x, -y, ...")
    return value


class Function(Model):
    """A function of time: a table (t, value, interp) or an expression of x, y, z, t."""

    t: Annotated[tuple[Annotated[float, Unit("s")], ...], BeforeValidator(as_tuple)] | None = None
    value: Annotated[tuple[Annotated[float, Unit("")], ...], BeforeValidator(as_tuple)] | None = None
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

    def at(self, time: float) -> float:
        """The value of a table at a time [s]: it holds its first value before, and its last one after; a step holds from
        just after an entry to the next."""
        t, value = self.t or (0.0,), self.value or (0.0,)
        if self.interp == "linear":
            return float(np.interp(time, t, value))
        return value[max(bisect_left(t, time) - 1, 0)]


class _Selection(Model):
    """Where something is prescribed, and what is prescribed there of the body's own fields."""

    body: str
    where: str | None = None
    face: Annotated[str, AfterValidator(_face)] | None = None
    velocity: dict[str, Value] = {}
    fixed: Strings = ()
    symmetry: Literal["x", "y", "z"] | None = None
    stress: dict[str, Value] = {}
    traction: dict[str, Value] = {}


if TYPE_CHECKING:
    _WithLoads = _Selection
else:
    _WithLoads = create_model(
        "_WithLoads", __base__=_Selection, **{key: (load | None, None) for key, load in LOADS.items()}
    )


class Boundary(_WithLoads):
    """Prescribed values on a face or on the particles that `where` selects."""

    @model_validator(mode="after")
    def _complete(self) -> "Boundary":
        if (self.where is None) == (self.face is None):
            raise ValueError("exactly one of where and face is needed")
        if not (self.velocity or self.fixed or self.symmetry or self.stress or self.traction or self.acting):
            kinds = ["velocity", "fixed", "symmetry", "stress", "traction", *LOADS]
            raise ValueError(f"nothing is prescribed: give {', '.join(kinds[:-1])} or {kinds[-1]}")
        return self

    @property
    def acting(self) -> dict[str, Load]:
        """Loads that follow the state, by their keys."""
        given = {key: getattr(self, key, None) for key in LOADS}
        return {key: load for key, load in given.items() if load is not None}


class Prescribing(Protocol):
    """A scene, as its boundary conditions see it."""

    @property
    def dim(self) -> int: ...

    @property
    def boundary(self) -> tuple[Boundary, ...]: ...

    def value(self, value: Value, unit: str) -> Expression | Function:
        """The program of a value: a table of `functions`, or an expression."""
        ...


def add_load(load: type[Load], *scenes: type[BaseModel]) -> None:
    """Give boundaries the key of a load that has joined `LOADS` after they were defined; `scenes` are the models that hold
    boundaries."""
    LOADS[load.key] = load
    Boundary.__pydantic_fields__[load.key] = FieldInfo.from_annotated_attribute(cast(type, load | None), None)
    for model in (Boundary, *scenes):
        model.model_rebuild(force=True)


def remove_load(load: type[Load], *scenes: type[BaseModel]) -> None:
    """Undo `add_load`."""
    del LOADS[load.key], Boundary.__pydantic_fields__[load.key]
    for model in (Boundary, *scenes):
        model.model_rebuild(force=True)
