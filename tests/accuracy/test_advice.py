"""The table of schemes: whole, and what it says of scenes of every kind."""

import pytest

import wsph
from tests.scenes import bar, held
from wsph.accuracy.accurate import accurate
from wsph.accuracy.schemes.advice import advise, best, rules
from wsph.accuracy.schemes.kinds import kind_of
from wsph.cli import main
from wsph.validation.case import EXAMPLES


def test_every_kind_has_alternatives_the_best_first():
    for kind in rules().values():
        errors = [each["error"] for each in kind["alternatives"]]
        assert len(errors) >= 3
        assert errors == sorted(errors)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("shock_bar", "wave-1d"),
        ("vibrating_bar", "smooth-1d"),
        ("viscoplastic_bar", "plastic-1d"),
        ("oscillating_beam", "smooth"),
        ("plate_with_void", "struck"),
        ("taylor_bar", "plastic"),
        ("two_rods", "contact"),
    ],
)
def test_kinds_of_the_examples(name, kind):
    assert kind_of(wsph.load(EXAMPLES / f"{name}.toml")) == kind
    assert kind in rules()


def test_work_is_that_of_the_scene_itself():
    made = bar(20, velocity=["1e-3*sin(pi*x)"], tables={"boundary": [held("-x", 1), held("+x", 1)]})
    for each in (each for each in advise(made) if not each.refusal):
        s = wsph.run(made.with_(**each.changes)).summary
        assert each.work == s["pairs"] * s["right_hand_sides"]


def test_the_best_scheme_is_taken_where_it_is_free():
    jump = {"boundary": [held("-x", 1)], "probes": [{"name": "p", "at": [[0.5]], "fields": ["velocity"]}]}
    made = bar(
        20,
        velocity=["1e-3"],
        tables=jump | {"accuracy": {"tolerance": 0.1, "free": ["spacing", "integrator", "formulation"]}},
    )
    assert best(made)["run.integrator"] == {"name": "tsph"}
    found = accurate(made)
    assert found.result.scene.run.integrator.name == "tsph"
    assert "by the table of wsph advise" in found.why
    own = accurate(made.with_(**{"accuracy.free": ["spacing"], "accuracy.tolerance": 0.3}))
    assert own.result.scene.run.integrator.name == "leapfrog"


def test_the_command(capsys):
    assert main(["advise", str(EXAMPLES / "shock_bar.toml")]) == 0
    said = capsys.readouterr().out
    assert "tsph" in said.splitlines()[2]
    assert "pair visits" in said
