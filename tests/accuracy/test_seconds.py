"""Budgets in seconds on a clock that is made up: what rows take is foreseen, with what setting up takes, and is kept to."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from coverage_clock import Timed

import wsph
from tests.scenes import bar, held
from wsph.accuracy.accurate import accurate
from wsph.accuracy.budget import spend
from wsph.accuracy.columns import aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.planning.cost import Plan
from wsph.accuracy.planning.rate import Rate
from wsph.accuracy.planning.took import Took
from wsph.accuracy.planning.watch import Due, Watch
from wsph.simulation.compose import compose


def vibrating() -> wsph.Scene:
    probe = {"name": "p", "at": [[0.25]], "fields": ["velocity"]}
    tables = {"boundary": [held("-x", 1), held("+x", 1)], "probes": [probe]}
    return bar(20, velocity=["1e-6*sin(pi*x)"], run={"end": 2.5}, tables=tables)


def clocked(composing, around, visit: float, step: float = 1e-4) -> Timed:
    """Rows that take `composing` and `around`, functions of their particles, and a rate of steps and of work."""
    return Timed(
        vibrating(),
        lambda cells, plan: (
            composing(plan.particles),
            around(plan.particles),
            step * plan.steps + visit * plan.work,
        ),
    )


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
    rows, limit = clocked(*SET_UPS[set_up], visit), Limit(seconds)
    rows.due = limit.due
    found = spend(rows, aims(rows.scene, 0.01), limit)
    assert found.status == "met"
    assert rows.now <= 1.02 * seconds
    # A row by itself that takes as long, by the same clock.
    fits, cells = rows.first, rows.first
    while sum(rows.taking(cells, rows.costs.plan(cells))) <= seconds:
        fits, cells = cells, rows.lattices.next(1.05 * cells)
    # Below, the constants of three rows are most of it; a steep set-up leaves a coarser row nothing to be cheaper by.
    if seconds >= 5.0 and set_up != "steeper":
        assert rows.made[-1].cells >= 0.7 * fits, [row.cells for row in rows.made]
        assert len(rows.made) >= 3
    if seconds >= 60.0:
        assert sum(row.wall_seconds for row in rows.made[:-1]) <= 0.3 * rows.now


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


def stepping(cells: int, per_step: float, per_visit: float, capture: float, part: float = 1.0) -> Took:
    plan = Plan(cells, 4.0 * cells, 2.0 * cells, 2.0 * cells, 0.9)
    inside = per_step * plan.steps + per_visit * plan.work
    return Took(plan, part * plan.work, part * inside, 0.0, capture, part)


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_steps_that_cost_the_same_however_small_are_told_from_visits(noise):
    rate, signs = Rate(), (1.0, -1.0, 1.0, -1.0)
    for cells, sign in zip((8, 64, 500, 1500), signs, strict=True):
        rate.learn(stepping(cells, (1.0 + noise * sign) * 1e-5, (1.0 + noise * sign) * 2e-9, 0.1))
    far = stepping(5000, 1e-5, 2e-9, 0.1)
    # Visits are taken to be a tenth dearer, as fewer of them are in the caches.
    assert rate.seconds(far.plan) == pytest.approx(far.inside + far.around, rel=0.12 + 2.0 * noise)


def test_a_jump_of_what_is_beside_the_steps_is_not_taken_for_growth():
    """Captured steps are more from some row on, and no more after it."""
    rate = Rate()
    for cells, capture in ((8, 0.01), (60, 0.03), (80, 0.2)):
        rate.learn(stepping(cells, 1e-5, 2e-9, capture))
    far = stepping(800, 1e-5, 2e-9, 0.2)
    assert rate.around(far.plan) <= 0.2 * 10.0
    rate.learn(stepping(200, 1e-5, 2e-9, 0.2))
    assert rate.around(far.plan) == pytest.approx(0.2)


def test_a_row_that_was_ended_tells_what_its_steps_take():
    rate, ended = Rate(), stepping(5000, 1e-5, 3e-9, 0.1, part=0.1)
    rate.learn(stepping(500, 1e-5, 2e-9, 0.1))
    rate.learn(ended)
    whole = stepping(5000, 1e-5, 3e-9, 0.1)
    assert rate.more == pytest.approx(1.0)
    assert rate.seconds(whole.plan) == pytest.approx(whole.inside + whole.around, rel=0.1)


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_watch_ends_what_would_end_too_late():
    clock = Clock()
    watch = Watch(Due(10.0), clock=clock)
    assert not watch.late()
    # The first block has no pace, the second is slow alone, the last ones would end at 10.5.
    for clock.now, step, late in (
        (3.0, 100, False),
        (5.0, 200, False),
        (5.5, 300, False),
        (7.0, 400, False),
        (8.5, 500, True),
    ):
        watch.progress(step, 640, 0.0)
        assert watch.late() == late
    patient = Watch(Due(10.0), clock=clock)
    clock.now = 10.5
    assert patient.late()
    for clock.now in (1e6, 2e6):
        endless = Watch(Due(), clock=clock)
        endless.progress(1, 10**9, 0.0)
        assert not endless.late()


def ended_at(seconds: float, due: Due, begun: float = 0.0) -> float:
    """The part of its steps at which a run of so many seconds is ended, begun at a time of its search."""
    clock = Clock()
    clock.now = begun
    watch = Watch(due, clock=clock)
    for step in range(1, 101):
        clock.now = begun + seconds * step / 100.0
        watch.progress(step, 100, 0.0)
        if watch.late():
            return step / 100.0
    return 1.0


def test_a_run_that_is_nearly_done_may_end_a_little_later():
    due = Due(10.0, 0.3)
    assert ended_at(10.0, due) == 1.0
    assert ended_at(10.2, due) < 0.3
    assert ended_at(12.0, due) < 0.3


def test_a_run_is_ended_in_favour_of_a_larger_one_that_is_paid_for():
    due = Due(10.0, 0.3, 9.5, 1.2)
    assert ended_at(5.0, due) < 0.3
    assert ended_at(5.0, due, begun=4.0) == 1.0
    assert ended_at(7.5, due) == 1.0  # what its first steps took is lost
    assert ended_at(5.0, Due(10.0, 0.3, 9.5)) == 1.0
    assert ended_at(0.2, due) == 1.0  # its end is as near


def test_a_run_ends_where_somebody_has_had_enough():
    asked = []

    def enough() -> bool:
        asked.append(1)
        return len(asked) > 3

    result = wsph.run(vibrating().with_(end=1e3), throw=False, enough=enough)
    assert result.status == "interrupted"
    assert 0 < result.summary["steps"] < 4000


@pytest.mark.parametrize("guard", ["refuse", "off"])
def test_a_run_that_is_watched_has_the_bits_of_one_that_is_not(guard):
    scene, seen = vibrating().with_(end=200.0, guard=guard), []
    alone = wsph.run(scene)
    watched = wsph.run(scene, enough=lambda: False, progress=lambda step, steps, at: seen.append(step / steps))
    assert len(seen) >= 32
    assert max(np.diff(seen)) < 0.05
    assert np.array_equal(alone.probes["p"]["velocity_x"], watched.probes["p"]["velocity_x"])
    assert np.array_equal(alone.particles["stress"], watched.particles["stress"])


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
