"""Searches on a clock that is made up: rows that nobody runs, which take what they are said to take.

What a search does with its seconds is seen so without a quiet machine, and in no time: with costs that are formulas
(tests/accuracy/test_seconds.py), or those of rows that were timed once (`timed`, `replayed`), with as much scatter as is
wished for.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from coverage import true_errors
from coverage_scenes import Case

from wsph.accuracy.budget import spend
from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.planning.cost import Plan
from wsph.accuracy.planning.watch import WATCHED, Watch
from wsph.accuracy.row import Late, Row
from wsph.accuracy.rows import Rows
from wsph.scene.scene import Scene

TIMES = np.linspace(0.0, 1.0, 101)
DENSE = 1.25
"""Cells of a row over those of the one before, of the rows that are timed."""

Taking = Callable[[int, Plan], tuple[float, float, float]]
"""What a row of so many cells, with its plan, takes for composing, around its steps and inside of them [s]."""


class Timed(Rows):
    """Rows on a clock of their own, `now` [s]; plans are those of the scene where none are given (`planned`)."""

    def __init__(self, scene: Scene, taking: Taking, planned: Callable[[int], Plan] | None = None, begun: float = 0.0):
        self.now, self.taking = begun, taking
        super().__init__(scene)
        self.costs = Clocked(self, planned or self.costs.plan)
        self.costs.plan(self.first)

    @property
    def seconds(self) -> float:
        return self.now

    def _watch(self, progress):
        return Watch(self.due, 0.0, progress, lambda: self.now)

    def run(self, scene, cells, planned, progress=None, composed=None):
        plan = self.costs.plan(cells)
        composing, around, inside = self.taking(cells, plan)
        begun, watch = self.now, self._watch(progress)
        self.now += around + (0.0 if composed is not None else composing)
        share, part = 0.0, inside / WATCHED
        for number in range(1, WATCHED + 1):
            self.now += part
            share = number / WATCHED
            watch.progress(number, WATCHED, 0.0)
            if watch.late() and number < WATCHED:
                break
        taken = self.now - begun
        record = (TIMES, np.sin(4.0 * TIMES) * (1.0 + 0.3 / cells**2))
        summary = {"steps": round(share * plan.steps), "particles": plan.particles}
        result = SimpleNamespace(
            work=share * plan.work,
            seconds=share * inside,
            summary=summary,
            crack_area=0.0,
            recorded=lambda: {"p.velocity_x": record},
        )
        row = Row(cells, self.lattices.spacing(cells), planned, taken, taken, result)
        if share < 1.0:
            raise Late("late", row, watch.early)
        self.spent += row.work
        return row


class Clocked:
    """The plans of rows, whose making takes time of their clock."""

    def __init__(self, rows: Timed, planned: Callable[[int], Plan]):
        self._rows, self._planned = rows, planned
        self.taken, self._ready = {}, 0

    def plan(self, cells):
        plan = self._planned(cells)
        if cells not in self.taken:
            self.taken[cells] = self._rows.taking(cells, plan)[0]
            self._rows.now += self.taken[cells]
            self._ready = cells
        return plan

    def holds(self, cells):
        return cells == self._ready

    def ready(self, cells):
        return self if cells == self._ready else None


# --- rows that were timed once ----------------------------------------------------------------------------------------

KEYS = ("particles", "pairs", "steps", "right_hand_sides", "composing", "around", "inside", "error")


def timed(case: Case, most: float) -> list[dict]:
    """Rows of a scene, up to those that take longer than `most` [s]: their plans, what they took, and their errors."""
    rows = Rows(case.scene)
    found, cells, whole = [], rows.first, 0.0
    while whole * DENSE ** (case.scene.dim + 1) < most:
        plan = rows.costs.plan(cells)
        row = rows.run(rows.lattices.scene_at(cells), cells, 0.0, composed=rows.costs.ready(cells))
        # Beyond some size a plan is scaled, and the run sets itself up.
        composing, inside = rows.costs.taken.get(cells, 0.0), row.result.seconds
        whole = composing + row.wall_seconds
        error = max(max(true_errors(case, row).values()), case.floor)
        numbers = (plan.particles, plan.pairs, plan.steps, plan.right_hand_sides)
        each = dict(zip(KEYS, (*numbers, composing, row.wall_seconds - inside, inside, error), strict=True))
        found.append({"cells": cells} | {key: float(f"{value:.5g}") for key, value in each.items()})
        cells = rows.lattices.next(max(DENSE * cells, cells + 0.5))
    return found


def whole(row: dict) -> float:
    """All seconds of a row by itself."""
    return row["composing"] + row["around"] + row["inside"]


@dataclass(frozen=True)
class Table:
    """What was measured of rows, for any number of cells: by powers between two, and beyond as the last ones go."""

    rows: list[dict]

    def at(self, cells: float) -> dict[str, float]:
        """Figures of a row."""
        known = np.log([row["cells"] for row in self.rows])
        k = int(np.clip(np.searchsorted(known, math.log(cells)), 1, len(known) - 1))
        part = (math.log(cells) - known[k - 1]) / (known[k] - known[k - 1])
        before, after = self.rows[k - 1], self.rows[k]
        least = 1e-12
        return {
            key: math.exp((1.0 - part) * math.log(max(before[key], least)) + part * math.log(max(after[key], least)))
            for key in KEYS
        }

    def plan(self, cells: int) -> Plan:
        """The plan of a row."""
        row = self.at(cells)
        return Plan(row["particles"], row["pairs"], row["steps"], row["right_hand_sides"], 0.9)


def replayed(case: Case, measured: list[dict], seconds: float, scatter: float = 0.0, seed: int = 0) -> dict:
    """What a budget of seconds finds with rows that take what was `measured`, each off by a factor of its own of so much
    `scatter`: the part of it that is used, its error, and its rows with what they took [s]."""
    table, dice = Table(measured), np.random.default_rng(seed)
    factors: dict[int, float] = {}

    def taking(cells: int, plan: Plan) -> tuple[float, float, float]:
        row = table.at(cells)
        off = factors.setdefault(cells, math.exp(scatter * dice.standard_normal()))
        return row["composing"], row["around"], off * row["inside"]

    rows, limit = Timed(case.scene, taking, table.plan), Limit(seconds)
    rows.due = limit.due
    spend(rows, aims(case.scene, 0.01), limit)
    error = table.at(rows.made[-1].cells)["error"] if rows.made else math.nan
    return {
        "used": rows.now / seconds,
        "error": error,
        "cells": [row.cells for row in rows.made],
        "wall": [row.wall_seconds for row in rows.made],
    }
