"""What runs take in seconds, learned from rows, and how much more work than was planned."""

# pyright: strict

import math

import numpy as np

from wsph.accuracy.planning.cost import Plan
from wsph.accuracy.planning.took import Took

STEEP, STEEPEST = 1.25, 2.0
"""The power of the particles that a set-up goes with where one row alone tells of it: cells are fitted in sweeps over all of
them, and more of them on finer lattices. Two rows have a power of their own, of at least one, and at most the other."""

LEAST = 0.1
"""The part of a row's set-up that is taken to grow at least."""

VISITS = 0.05
"""The part of a row's steps that its visits are taken to be at least: small rows do not show it."""

CACHES = 0.04
"""The power of the work by which a visit takes longer in a larger row: less of it is in the caches."""


class Rate:
    """Seconds of runs, learned from rows: those of the set-up, a constant and a part that grows with the particles, and
    those of the steps, a steps + b work."""

    def __init__(self) -> None:
        self._rows: list[Took] = []
        self._rates = 0.0, 0.0

    @property
    def more(self) -> float:
        """Work of the last run as a multiple of its plan."""
        return max((row.more for row in self._rows[-1:]), default=1.0)

    def expected(self, asked: Plan) -> Plan:
        """A plan with as many times its steps as the last run had of its own."""
        return asked.longer(self.more)

    def learn(self, row: Took) -> None:
        """Note what a run took."""
        self._rows.append(row)
        self._rates = self._fitted()

    def seconds(self, asked: Plan, *, composed: bool = False) -> float:
        """What a run will take [s], not a number before the first; without the setting up for its plan where that has been
        `composed`. From one row all seconds are taken to grow, several times too long perhaps."""
        if not self._rows:
            return math.nan
        a, b = self._rates
        around = self.around(asked)
        composing = 0.0 if composed else self._composing(asked)
        b *= max(asked.work / self._rows[-1].plan.work, 1.0) ** CACHES
        return composing + around + self.more * (a * asked.steps + b * asked.work)

    def around(self, asked: Plan) -> float:
        """What a run will take beside its set-up and its steps [s]: captures, and checks and records along with its steps;
        none before the first."""
        if not self._rows:
            return 0.0
        last = self._rows[-1]
        slope = last.around / last.plan.steps
        if len(self._rows) > 1:
            before = self._rows[-2]
            more = max(last.plan.steps - before.plan.steps, 1.0)
            slope = min(max((last.around - before.around) / more, 0.0), slope)
        return last.around + slope * max(asked.steps - last.plan.steps, 0.0)

    def _composing(self, asked: Plan) -> float:
        """What goes with the particles in some power but for a constant, by the last two rows."""
        last, power, growing = self._rows[-1], STEEP, 1.0
        before = self._rows[-2] if len(self._rows) > 1 else last
        fewer = before.plan.particles / last.plan.particles
        if fewer < 1.0 and min(before.composing, last.composing) > 0.0:
            ratio = before.composing / last.composing
            power = min(max(math.log(ratio) / math.log(fewer), 1.0), STEEPEST)
            growing = min(max((1.0 - ratio) / (1.0 - fewer**power), LEAST), 1.0)
        more = max((asked.particles / last.plan.particles) ** power - 1.0, 0.0)
        return last.composing * (1.0 + growing * more)

    def _fitted(self) -> tuple[float, float]:
        """Seconds of a step, and of a pair visit, by least squares over all rows, whose scatter goes with the root of what
        they take; neither below zero. One row has no steps that take the same whatever their work."""
        last = self._rows[-1]
        alone = last.inside / last.work
        if len(self._rows) < 2 or min(row.inside for row in self._rows) <= 0.0:
            return 0.0, alone
        seconds: np.ndarray = np.array([row.inside for row in self._rows])
        table: np.ndarray = np.array([(row.steps, row.work) for row in self._rows]) / np.sqrt(seconds)[:, None]
        a, b = np.linalg.lstsq(table, np.sqrt(seconds), rcond=None)[0].tolist()
        if a <= 0.0:
            return 0.0, alone
        # The last row is met, whatever the others say.
        b = max(b, VISITS * alone)
        met = last.inside / (a * last.steps + b * last.work)
        return met * a, met * b
