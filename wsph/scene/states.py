"""The tables of a scene that say what its run begins with."""

# pyright: strict

from typing import Annotated

from pydantic import Field, model_validator

from wsph.quantities import Model, Unit, Value


class Initial(Model):
    """What a body begins with beside its velocity: `stress` by its components, expressions of the reference position, or the
    state of the same body in a checkpoint, from a `file`."""

    stress: dict[str, Value] = {}
    file: Annotated[str, Field(min_length=1)] | None = None
    temperature: Value | None = None

    @model_validator(mode="after")
    def _something(self) -> "Initial":
        if not self.stress and self.file is None and self.temperature is None:
            raise ValueError("says nothing: give stress or file")
        return self


class Relax(Model):
    """Rest before t = 0: where the kinetic energy has fallen below `until` of the strain energy, in at most `max_steps`."""

    until: Annotated[float, Unit("", gt=0, lt=1)] = 1e-6
    max_steps: Annotated[int, Field(ge=1)] = 100_000
