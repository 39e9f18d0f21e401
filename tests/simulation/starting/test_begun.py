"""Numbers that people read off where bodies begin at rest or in steps: works begin with the run, and a boundary does nothing
in a step in which it does not hold."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "total-lagrangian", "support": 2.0},
    {"formulation": "updated-lagrangian"},
    {"formulation": "stress-points", "integrator": "rk4"},
]
STEPS = [{"name": "first", "duration": 1.5}, {"name": "second", "duration": 0.5}, {"name": "third", "duration": 0.5}]
PULL = {"body": "b", "face": "+x", "name": "pull", "traction": {"x": 1e-3}}


def bar(boundary: list[Any], run: dict[str, Any], steps: list[Any] = STEPS, **tables: Any) -> wsph.Scene:
    given = {"output": {"history": 1}, "boundary": boundary, "steps": steps, **tables}
    data = scenes.bar(20, run={"cfl": 0.4, **run}, tables={"output": {"history": 1}}).data()
    data["run"].pop("end", None)
    return wsph.Scene(**{**data, **given})


def holding(name: str, *steps: str) -> dict[str, Any]:
    return {"body": "b", "face": "-x", "name": name, "fixed": ["x"], "steps": list(steps)}


def balance(result: wsph.Result) -> float:
    """How far reactions are from the change of momentum, beside the largest of them."""
    history = result.history
    total = sum(values[1:] for name, values in history.items() if name.startswith("reaction_"))
    change = np.diff(history["momentum_x"]) / np.diff(history["time"])
    return float(np.abs(change - total).max() / np.abs(total).max())


def within(result: wsph.Result, begins: float, ends: float) -> np.ndarray:
    """The rows of steps that end in a window of time."""
    slack = 1e-9
    return (result.history["time"] > begins + slack) & (result.history["time"] <= ends + slack)


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_supports_in_turn_have_each_the_reaction_of_its_steps(run: dict[str, Any]) -> None:
    result = wsph.run(bar([holding("one", "first", "third"), holding("two", "second"), PULL], run))
    history = result.history
    one, two = history["reaction_one_x"], history["reaction_two_x"]
    second = within(result, 1.5, 2.0)
    assert (one[second] == 0.0).all()
    assert (two[~second] == 0.0).all()
    assert np.abs(one[~second]).max() > 1e-4
    assert np.abs(two[second]).max() > 1e-4
    assert balance(result) < 1e-10
    # As one that holds in all of them.
    whole = wsph.run(bar([holding("one", "first", "second", "third"), PULL], run))
    assert np.abs(one + two - whole.history["reaction_one_x"]).max() < 1e-12 * np.abs(one).max()


@pytest.mark.parametrize("run", FORMS, ids=str)
def test_a_support_that_lets_go_has_no_reaction(run: dict[str, Any]) -> None:
    result = wsph.run(bar([holding("one", "first"), PULL], run))
    one, first = result.history["reaction_one_x"], within(result, 0.0, 1.5)
    assert np.abs(one[first]).max() > 1e-4
    assert (one[~first] == 0.0).all()
    assert balance(result) < 1e-10


@pytest.mark.parametrize("run", FORMS[:2], ids=str)
def test_a_rest_in_the_middle_leaves_no_force_behind(run: dict[str, Any]) -> None:
    """The first step after it has the force of one step, not that of all steps of the relaxation."""
    steps = [STEPS[0], {**STEPS[1], "relax": {}}]
    boundary = [
        {"body": "b", "face": "-x", "name": "foot", "fixed": ["x"]},
        {**PULL, "traction": {"x": "1e-3*min(t/1.5, 1)"}},
    ]
    result = wsph.run(bar(boundary, run, steps))
    foot, after = result.history["reaction_foot_x"], within(result, 1.5, 2.0)
    assert after.sum() > 5
    assert foot[after] == pytest.approx(-1e-3, rel=2e-2)


SUPPORTS: list[dict[str, Any]] = [
    {"spring": {"stiffness": 1.0, "damping": 0.5}},
    {"displacement": {"x": "1e-4*sin(3*t)"}},
    {"acceleration": {"x": "1e-3*cos(5*t)"}},
]


@pytest.mark.parametrize("support", SUPPORTS, ids=str)
@pytest.mark.parametrize("run", FORMS[:4], ids=str)
def test_works_begin_with_the_run(run: dict[str, Any], support: dict[str, Any], tmp_path: Path) -> None:
    foot = {"body": "b", "face": "-x", "name": "foot", **support}
    probes = [
        {"name": "each", "of": "foot", "fields": ["force", "work"], "every": 1},
        {"name": "some", "of": "foot", "fields": ["force", "work"], "every": 7},
    ]
    tables = {
        "output": {"history": 1},
        "boundary": [foot, PULL],
        "relax": {},
        "probes": probes,
        "checkpoint": {"every": 10, "keep": 9},
    }
    made = scenes.bar(20, run={"cfl": 0.4, "end": 0.5, **run}, tables=tables)
    result = wsph.run(made, tmp_path / "out")
    history = result.history
    assert history["work_foot"][0] == history["work_pull"][0] == 0.0
    assert result.probes["each"]["work"] == pytest.approx(history["work_foot"], rel=1e-12, abs=1e-20)
    assert result.probes["some"]["work"][:3] == pytest.approx(history["work_foot"][:15:7], rel=1e-12, abs=1e-20)
    if "spring" not in support:
        external = history["external_work"] - history["external_work"][0]
        assert (
            np.abs(external - history["work_foot"] - history["work_pull"]).max()
            < 1e-12 * np.abs(external).max() + 1e-18
        )
    for path in sorted((tmp_path / "out/checkpoints").glob("*.npz"))[2:]:
        path.unlink()
    again = wsph.run(made, tmp_path / "out", resume=True)
    for name, values in history.items():
        assert (values == again.history[name]).all(), name
    for name, values in result.probes["each"].items():
        assert (values == again.probes["each"][name]).all(), name


def test_works_of_contacts_begin_with_the_run() -> None:
    """A bar that rests on another has stored energy in the contact, and is to bring none of it as work."""
    lower = scenes.body(scenes.box(1.0), 0.1, name="a", state="stress")
    upper = scenes.body(scenes.box((1.001, 2.001)), 0.1, name="b", state="stress")
    tables = {
        "boundary": [scenes.held("-x", 1, "a")],
        "gravity": {"x": -1e-3},
        "contact": [{"between": ["a", "b"], "name": "gap"}],
        "probes": [{"name": "of_gap", "of": "gap", "fields": ["force", "work"], "every": 1}],
        "relax": {"until": 1e-5},
        "output": {"history": 1},
    }
    result = wsph.run(scenes.scene(lower, upper, run={"cfl": 0.3, "end": 0.2}, **tables))
    assert result.history["contact_gap_x"][0] == pytest.approx(-1e-3, rel=2e-2)
    assert result.history["contact_gap_work"][0] == result.probes["of_gap"]["work"][0] == 0.0
    stored = result.history["contact"]
    assert stored[0] > 0.0
    assert result.history["contact_gap_work"] == pytest.approx(stored[0] - stored, abs=1e-12 * stored[0])
