"""What runs take in seconds, learned from rows, and how much more work than was planned."""

# pyright: strict

import math
from dataclasses import dataclass

import numpy as np

from wsph.accuracy.planning.cost import Plan


class Rate:
    """Seconds of runs, learned from rows: those of the set-up, in proportion to the particles, and those of the steps,
    a steps + b work."""

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

    def seconds(self, asked: Plan) -> float:
        """What a run will take [s], not a number before the first. From one row all seconds of steps are taken to go with
        the work, three times too long perhaps."""
        if not self._rows:
            return math.nan
        a, b = self._rates()
        set_up = min(row.set_up * max(asked.particles / row.plan.particles, 1.0) for row in self._rows)
        return set_up + self.more * (a * asked.steps + b * asked.work)

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
    """What a run took beside its `plan`: `work`, and seconds `inside` of its steps and around them, its `set_up`."""

    plan: Plan
    work: float
    inside: float
    set_up: float
