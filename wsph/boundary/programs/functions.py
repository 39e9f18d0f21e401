"""Functions of time, as a scene's table has them."""

# pyright: strict

from bisect import bisect_left
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, model_validator

from wsph.declarations import example
from wsph.quantities import Model, Unit, as_tuple


class Function(Model):
    """A function of time: a table (t, value, interp) or an expression of x, y, z, t."""

    model_config = example({"t": [0.0, "1 ms"], "value": [0.0, 1.0], "interp": "linear"})
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
