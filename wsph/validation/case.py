"""Published cases: figures beside their oracles."""

# pyright: strict

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import SupportsFloat

import numpy as np

import wsph
from wsph.scene.scene import Scene

_HERE = Path(__file__).resolve()

EXAMPLES = next(p for p in (_HERE.parents[1] / "examples", _HERE.parents[2] / "examples") if p.is_dir())
"""The shipped scenes: beside the package in a checkout, inside it in an installation."""


@dataclass(frozen=True)
class Row:
    """One figure of a case. `reached` in `unit`; it meets what is asked from `low` to `high`."""

    figure: str
    published: str
    reached: float
    low: float
    high: float
    unit: str = "%"

    @property
    def asked(self) -> str:
        """The range in words."""
        if self.low == -np.inf and self.high == np.inf:
            return "reported"
        return f"at most {self.high:g}" if self.low == -np.inf else f"{self.low:g} to {self.high:g}"

    @property
    def meets(self) -> bool:
        """Whether the figure is within what is asked."""
        return bool(self.low <= self.reached <= self.high)


def at_most(figure: str, published: str, reached: SupportsFloat, high: float, unit: str = "%") -> Row:
    """A figure that meets what is asked up to `high`."""
    return Row(figure, published, float(reached), -np.inf, high, unit)


def between(figure: str, published: str, reached: SupportsFloat, low: float, high: float, unit: str = "%") -> Row:
    """A figure that meets what is asked from `low` to `high`."""
    return Row(figure, published, float(reached), low, high, unit)


def reported(figure: str, published: str, reached: SupportsFloat, unit: str = "%") -> Row:
    """A figure of which nothing is asked."""
    return Row(figure, published, float(reached), -np.inf, np.inf, unit)


@dataclass(frozen=True)
class Case:
    """A published case: where from, what its oracle is, and how to run it."""

    name: str
    source: str
    oracle: str
    rows: Callable[[bool], Iterator[Row]]


def case(name: str, source: str, oracle: str) -> Callable[[Callable[[bool], Iterator[Row]]], Case]:
    """The case whose rows, of its short or its full form, a function gives."""
    return lambda rows: Case(name, source, oracle, rows)


def example(name: str) -> Scene:
    """A shipped scene."""
    return wsph.load(EXAMPLES / f"{name}.toml")


def with_particles(scene: Scene, n: int, **overrides: object) -> Scene:
    """A bar of 1 m with n particles."""
    return scene.with_(**{"bodies.0.spacing": 1.0 / (n - 1)}, **overrides)
