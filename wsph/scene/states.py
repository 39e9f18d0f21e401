"""The tables of a scene that say what its run begins with, and the steps that it is made of."""

# pyright: strict

import math
from collections.abc import Collection, Sequence
from itertools import accumulate
from typing import Annotated

from pydantic import Field, model_validator

from wsph.declarations import Measured, example
from wsph.quantities import Model, Unit, Value


class Initial(Model):
    """What a body begins with beside its velocity: `stress` by its components, expressions of the reference position, or the
    state of the same body in a checkpoint, from a `file`."""

    model_config = example({"stress": {"xx": "10 MPa"}})
    stress: dict[str, Annotated[Value, Measured("Pa")]] = {}
    file: Annotated[str, Field(min_length=1)] | None = None
    temperature: Annotated[Value, Measured("K")] | None = None

    @model_validator(mode="after")
    def _something(self) -> "Initial":
        if not self.stress and self.file is None and self.temperature is None:
            raise ValueError("says nothing: give stress or file")
        return self


class Relax(Model):
    """Rest before t = 0: where the kinetic energy has fallen below `until` of the strain energy, in at most `max_steps`."""

    model_config = example({"until": 1e-6})
    until: Annotated[float, Unit("", gt=0, lt=1)] = 1e-6
    """kinetic over strain energy"""
    max_steps: Annotated[int, Field(ge=1)] = 100_000
    """at most so many"""


class Stage(Model):
    """A step of [[steps]]: its name, which boundaries name, how long it is, and whether bodies come to rest before it."""

    model_config = example({"name": "preload", "duration": "1 ms"})
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}$")]
    """that boundaries name"""
    duration: Annotated[float, Unit("s", gt=0)]
    """how long it is"""
    relax: Relax | None = None
    """bodies come to rest before it"""


def begins_of(stages: Sequence[Stage]) -> tuple[float, ...]:
    """When each step begins, and when the last ends [s]."""
    return tuple(accumulate((stage.duration for stage in stages), initial=0.0))


def windows_of(stages: Sequence[Stage], names: Collection[str]) -> tuple[tuple[float, float], ...]:
    """The times in which the named steps are, joined where one follows another. The first of a run begins before all times,
    and its last has no end."""
    begins = (-math.inf, *begins_of(stages)[1:-1], math.inf)
    found: list[tuple[float, float]] = []
    for stage, start, stop in zip(stages, begins, begins[1:], strict=False):
        if stage.name not in names:
            continue
        joins = bool(found) and found[-1][1] == start
        found[-1:] = [(found[-1][0], stop)] if joins else [*found[-1:], (start, stop)]
    return tuple(found)
