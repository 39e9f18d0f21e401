"""What runs take in seconds, learned from rows, and how much more work than was planned."""

# pyright: strict

import math
from dataclasses import dataclass

import numpy as np

from wsph.accuracy.planning.cost import Plan

STEEP = 1.25
"""The power of the particles that a set-up goes with where one row alone tells of it: cells are fitted in sweeps over all of
them, and more of them on finer lattices. Two rows have a power of their own, of at least one."""

LEAST = 0.2
"""The part of a row's set-up that is taken to grow at least."""

CACHES = 0.04
"""The power of the work by which a visit takes longer in a larger row: less of it is in the caches."""


class Rate:
    """Seconds of runs, learned from rows: those of the set-up, a constant and a part that grows with the particles, and
    those of the steps, a steps + b work."""

    def __init__(self) -> None:
        self._rows: list[Took] = []

    @property
    def more(self) -> float:
        """Work of the last run as a multiple of its plan."""
        return max((row.work / row.plan.work for row in self._rows[-1:]), default=1.0)

    def expected(self, asked: Plan) -> Plan:
        """A plan with as many times its steps as the last run had of its own."""
        return asked.longer(self.more)

    def learn(self, row: "Took") -> None:
        """Note what a run took."""
        self._rows.append(row)

    def seconds(self, asked: Plan, *, composed: bool = False) -> float:
        """What a run will take [s], not a number before the first; without the setting up for its plan where that has been
        `composed`. From one row all seconds are taken to grow, several times too long perhaps."""
        if not self._rows:
            return math.nan
        a, b = self._rates()
        around = self._grown(asked, [row.around for row in self._rows])
        composing = 0.0 if composed else self._grown(asked, [row.composing for row in self._rows])
        b *= max(asked.work / self._rows[-1].plan.work, 1.0) ** CACHES
        return composing + around + self.more * (a * asked.steps + b * asked.work)

    def _grown(self, asked: Plan, seconds: list[float]) -> float:
        """What goes with the particles in some power but for a constant, by the last two rows."""
        last, power, growing = self._rows[-1].plan.particles, STEEP, 1.0
        before = self._rows[-2].plan.particles / last if len(self._rows) > 1 else 1.0
        if before < 1.0 and min(seconds[-2:]) > 0.0:
            ratio = seconds[-2] / seconds[-1]
            power = max(math.log(ratio) / math.log(before), 1.0)
            growing = min(max((1.0 - ratio) / (1.0 - before**power), LEAST), 1.0)
        return seconds[-1] * (1.0 + growing * max((asked.particles / last) ** power - 1.0, 0.0))

    def _rates(self) -> tuple[float, float]:
        """Seconds of a step, and of a pair visit, by the last two rows, neither below zero."""
        last = self._rows[-1]
        alone = (0.0, last.inside / last.work)
        if len(self._rows) < 2:
            return alone
        before = self._rows[-2]
        matrix = np.array([[row.plan.steps * row.work / row.plan.work, row.work] for row in (before, last)])
        if abs(np.linalg.det(matrix / matrix.max(0))) < 1e-3:
            return alone
        a, b = np.linalg.solve(matrix, [before.inside, last.inside]).tolist()
        if b <= 0.0:
            return (0.0, last.inside / last.work)
        return (a, b) if a > 0.0 else alone


@dataclass(frozen=True)
class Took:
    """What a run took beside its `plan`: `work`, and seconds `inside` of its steps, `composing` for its plan, and `around`
    both: captures, checks and its result."""

    plan: Plan
    work: float
    inside: float
    composing: float
    around: float
