"""Prescribed displacements and accelerations: motions of particles whose velocities follow from them."""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.rates import rate_of
from wsph.expressions import Expression

UNITS = {"velocity": "m/s", "displacement": "m", "acceleration": "m/s2"}
"""The keys by which a boundary prescribes components of a motion, and their units."""


@dataclass(frozen=True)
class Motion:
    """A component of the motion of particles: its displacement [m] or its acceleration [m/s2] is `of`. Where that is an
    acceleration, the motion begins with what velocity the particles have at the start of the run."""

    kind: Literal["displacement", "acceleration"]
    of: Expression | Function

    @cached_property
    def rate(self) -> Expression | Function:
        """The velocity [m/s] of a displacement. Raises ValueError for one that jumps, or whose rate is nested too deep."""
        if isinstance(self.of, Expression):
            return rate_of(self.of)
        if self.of.interp == "step":
            raise ValueError('a displacement cannot jump: give interp = "linear", or an expression')
        t, value = np.array(self.of.t), np.array(self.of.column)
        # A step table holds its first value before its first entry, and the value of an entry from just after it.
        times = (float(t[0]) - 1.0, *t.tolist())
        slopes = (0.0, *(np.diff(value) / np.diff(t)).tolist(), 0.0)
        return Function(t=times, value=slopes, interp="step")

    def at_start(self, position: np.ndarray) -> np.ndarray:
        """Displacements at t = 0 of particles at `position` (n, dim) [m], (n,) [m]."""
        if self.kind == "acceleration":
            return np.zeros(len(position))
        if isinstance(self.of, Function):
            return np.full(len(position), self.of.at(0.0))
        return self.of(position, 0.0)
