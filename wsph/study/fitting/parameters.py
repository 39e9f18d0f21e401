"""Parameters that are fitted: the keys of a scene, between bounds, in their units."""

# pyright: strict

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from wsph.errors import Fault, SceneError, WsphError
from wsph.quantities import is_list, is_table
from wsph.scene.scene import Scene
from wsph.units import quantity, unit

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RANGE = re.compile(rf"\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*([^@]*?)\s*(?:@\s*({_NUMBER})\s*)?")


@dataclass(frozen=True)
class Parameter:
    """A key that is fitted: dotted `key`, its bounds `low` and `high` and where the search starts, in `unit` (empty for a
    plain number)."""

    key: str
    low: float
    high: float
    unit: str
    start: float

    @property
    def name(self) -> str:
        """The last word of its key."""
        return self.key.rpartition(".")[2]

    def value(self, part: float) -> float:
        """Its value at a part of the way between its bounds."""
        return self.low + float(part) * (self.high - self.low)

    def written(self, value: float) -> float | str:
        """As a scene takes it."""
        return f"{value:.17g} {self.unit}" if self.unit else value


def read_parameter(text: str, scene: Scene) -> Parameter:
    """KEY=LOW..HIGH [UNIT] [@START]; the search starts where the scene is, or in the middle where that is not between the
    bounds. Raises WsphError."""
    key, separator, given = text.partition("=")
    key, match = key.strip(), _RANGE.fullmatch(given)
    if not separator or not key or not match:
        raise WsphError(f"--free {text}: write it as KEY=LOW..HIGH UNIT, e.g. bodies.0.material.density=1..2 g/cm3")
    low, high, within = float(match[1]), float(match[2]), match[3]
    if not low < high:
        raise WsphError(f"--free {key}: {low:g} is not below {high:g}")
    try:
        factor = float(unit(within)[0])
    except ValueError as error:
        raise WsphError(f"--free {key}: {error}") from None
    if not match[4]:
        own = _own(scene, key, within, factor)
        return Parameter(key, low, high, within, own if own is not None and low <= own <= high else 0.5 * (low + high))
    start = float(match[4])
    if not low <= start <= high:
        raise WsphError(f"--free {key}: its start {start:g} is not between {low:g} and {high:g}")
    return Parameter(key, low, high, within, start)


def check_parameters(parameters: Sequence[Parameter], scene: Scene) -> None:
    """Raise SceneError where the scene does not take a bound of one, WsphError where there is none or one twice."""
    if not parameters:
        raise WsphError("nothing to fit: give --free KEY=LOW..HIGH UNIT at least once")
    if len(keys := {each.key for each in parameters}) < len(parameters):
        raise WsphError(f"--free {', '.join(sorted(keys))}: one of them is given twice")
    for end in (0.0, 1.0):
        with_values(scene, parameters, np.full(len(parameters), end))
    known = scene.data()
    for each in parameters:
        if _found(known, each.key) is None:
            raise SceneError(
                "scene", [Fault(0, each.key, "the scene does not have it, and its default is no number to fit")]
            )


def with_values(scene: Scene, parameters: Sequence[Parameter], parts: np.ndarray) -> Scene:
    """The scene with its parameters at parts (n,) of the ways between their bounds. Raises SceneError."""
    changes = {each.key: each.written(each.value(part)) for each, part in zip(parameters, parts, strict=True)}
    return scene.with_(**changes)


def starts(parameters: Sequence[Parameter]) -> np.ndarray:
    """Where the search starts, as parts of the ways between the bounds (n,)."""
    return np.array([(each.start - each.low) / (each.high - each.low) for each in parameters])


def _own(scene: Scene, key: str, within: str, factor: float) -> float | None:
    with suppress(ValueError):
        return quantity(_found(scene.data(), key), within) / factor


def _found(data: object, key: str) -> object:
    """What stands at a dotted key, None where nothing does."""
    for word in key.split("."):
        if is_table(data):
            data = data.get(word)
        elif is_list(data) and word.isdecimal() and int(word) < len(data):
            data = data[int(word)]
        else:
            return None
    return data
