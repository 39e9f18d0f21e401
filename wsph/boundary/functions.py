"""Functions of time, as a scene's table has them."""

# pyright: strict

from typing import Annotated, Literal

from pydantic import BeforeValidator, model_validator

from wsph.quantities import Model, Unit, as_tuple


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
