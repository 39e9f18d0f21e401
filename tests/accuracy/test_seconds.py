"""Budgets in seconds on a clock that is made up: what rows take is foreseen, with what setting up takes, and is kept to."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import wsph
from tests.scenes import bar, held
from wsph.accuracy.accurate import accurate
from wsph.accuracy.budget import spend
from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.planning.cost import Plan
from wsph.accuracy.planning.rate import Rate, Took
from wsph.accuracy.planning.watch import Watch
from wsph.accuracy.row import Late, Row
from wsph.accuracy.rows import Rows
from wsph.simulation.compose import compose

TIMES = np.linspace(0.0, 1.0, 101)


def vibrating() -> wsph.Scene:
    probe = {"name": "p", "at": [[0.25]], "fields": ["velocity"]}
    tables = {"boundary": [held("-x", 1), held("+x", 1)], "probes": [probe]}
    return bar(20, velocity=["1e-6*sin(pi*x)"], run={"end": 2.5}, tables=tables)


class Timed(Rows):
    """Rows that nobody runs: they take `composing` and `around`, functions of their particles, and a rate of work, on a
    clock of their own."""

    def __init__(self, composing, around, step=1e-4, visit=1e-6):
        self.now, self._composing, self._around, self._step, self._visit = 0.0, composing, around, step, visit
        super().__init__(vibrating())
        self.costs = Clocked(self)
        self.costs.plan(self.first)

    @property
    def seconds(self) -> float:
        return self.now

    def run(self, scene, cells, planned, progress=None, composed=None):
        plan = self.costs.plan(cells)
        inside, around = self._step * plan.steps + self._visit * plan.work, self._around(plan.particles)
        again = 0.0 if composed is not None else self._composing(plan.particles)
        taken, share = again + around + inside, 1.0
        if self.now + taken > self.until:
            share = max((self.until - self.now - around - again) / inside, 0.0)
            taken = self.until - self.now
        self.now += taken
        record = (TIMES, np.sin(4.0 * TIMES) * (1.0 + 0.3 / cells**2))
        summary = {"steps": round(share * plan.steps), "particles": plan.particles}
        result = SimpleNamespace(
            work=share * plan.work, seconds=share * inside, summary=summary, recorded=lambda: {"p.velocity_x": record}
        )
        row = Row(cells, self.lattices.spacing(cells), planned, taken, taken, result)
        if share < 1.0:
            raise Late("late", row)
        self.spent += row.work
        return row


class Clocked:
    """The plans of rows, whose making takes time of their clock."""

    def __init__(self, rows: Timed):
        self._rows, self._own = rows, rows.costs
        self.taken, self._ready = {}, 0

    def plan(self, cells):
        plan = self._own.plan(cells)
        if cells not in self.taken:
            self.taken[cells] = self._rows._composing(plan.particles)
            self._rows.now += self.taken[cells]
            self._ready = cells
        return plan

    def holds(self, cells):
        return cells == self._ready

    def ready(self, cells):
        return self if cells == self._ready else None


SET_UPS = {
    "none": (lambda n: 0.0, lambda n: 0.0),
    "constant": (lambda n: 0.1, lambda n: 0.3),
    "in proportion": (lambda n: 0.1 + 5e-3 * n, lambda n: 0.2),
    "steeper": (lambda n: 0.05 + 2e-5 * n**1.8, lambda n: 0.2 + 1e-3 * n),
    "squared": (lambda n: 2e-5 * n**2, lambda n: 0.1),
}


@pytest.mark.parametrize("visit", [1e-5, 1e-7])
@pytest.mark.parametrize("seconds", [2.0, 10.0, 60.0])
@pytest.mark.parametrize("set_up", list(SET_UPS))
def test_seconds_are_kept_to_with_what_setting_up_takes(set_up, seconds, visit):
    rows, limit = Timed(*SET_UPS[set_up], visit=visit), Limit(seconds)
    rows.until = limit.until
    found = spend(rows, aims(rows.scene, 0.01), limit)
    assert found.status == "met"
    assert rows.now <= seconds
    # A row by itself that takes as long, by the same clock.
    fits, cells = rows.first, rows.first
    while True:
        plan = rows.costs._own.plan(cells)
        alone = rows._composing(plan.particles) + rows._around(plan.particles) + rows._step * plan.steps
        if alone + visit * plan.work > seconds:
            break
        fits, cells = cells, rows.lattices.next(1.05 * cells)
    # Below, the constants of three rows are most of it; a steep set-up leaves a coarser row nothing to be cheaper by.
    if seconds >= 5.0 and set_up != "steeper":
        assert rows.made[-1].cells >= 0.4 * fits, [row.cells for row in rows.made]
        assert len(rows.made) >= 3


def took(particles: float, composing: float, around: float, inside: float = 1.0) -> Took:
    plan = Plan(particles, 10.0 * particles, 100.0, 100.0, 0.9)
    return Took(plan, plan.work, inside, composing, around)


def test_a_set_up_grows_by_what_two_rows_show():
    rate = Rate()
    assert math.isnan(rate.seconds(took(100.0, 0.0, 0.0).plan))
    rate.learn(took(100.0, 0.5, 0.0, inside=0.0))
    careful = rate.seconds(took(1000.0, 0.0, 0.0).plan)
    assert careful >= 5.0  # all of it may grow
    rate.learn(took(200.0, 0.6, 0.0, inside=0.0))
    known = rate.seconds(took(1000.0, 0.0, 0.0).plan)
    assert known == pytest.approx(0.4 + 0.1 * 10.0)
    assert known < careful
    assert rate.seconds(took(1000.0, 0.0, 0.0).plan, composed=True) == 0.0


def test_a_watch_ends_what_would_end_too_late(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("wsph.accuracy.planning.watch.time.perf_counter", lambda: now[0])
    watch = Watch(10.0)
    assert not watch.late()
    # The first block has no pace, the second is slow alone, the last ones would end at 10.5.
    for now[0], step, late in (
        (3.0, 100, False),
        (5.0, 200, False),
        (5.5, 300, False),
        (7.0, 400, False),
        (8.5, 500, True),
    ):
        watch.progress(step, 640, 0.0)
        assert watch.late() == late
    patient = Watch(10.0)
    now[0] = 10.5
    assert patient.late()
    for now[0] in (1e6, 2e6):
        endless = Watch(math.inf)
        endless.progress(1, 10**9, 0.0)
        assert not endless.late()


def test_a_run_ends_where_somebody_has_had_enough():
    asked = []

    def enough() -> bool:
        asked.append(1)
        return len(asked) > 3

    result = wsph.run(vibrating().with_(end=1e3), throw=False, enough=enough)
    assert result.status == "interrupted"
    assert 0 < result.summary["steps"] < 4000


def test_what_is_composed_is_run_as_it_is():
    scene = vibrating()
    made, found = compose(scene), wsph.run(scene)
    again = wsph.run(scene, composed=made)
    assert np.array_equal(found.probes["p"]["velocity_x"], again.probes["p"]["velocity_x"])


def test_a_row_that_would_go_beyond_the_seconds_is_ended_and_the_one_before_is_the_answer(monkeypatch):
    # All rows are thought to take no time, so that the search goes for what it cannot pay.
    monkeypatch.setattr(Limit, "cost", lambda self, rows, plan, *, composed=False: 1e-10 * plan.work)
    said: list[str] = []
    found = accurate(vibrating(), limit=Limit(5.0), tell=said.append)
    assert found.result is not None
    assert found.result.status == "completed"
    assert any("was ended" in each for each in said)
