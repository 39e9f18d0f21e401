"""What rows will take: a lower bound where steps get shorter, and by the rows that were run better than that."""

from pathlib import Path

import pytest

import wsph
from tests import scenes
from wsph.accuracy.planning.shrinking import shrinks
from wsph.accuracy.rows import Rows
from wsph.cli import main
from wsph.simulation.compose import compose
from wsph.study.forecast import Forecast, forecasts
from wsph.study.plan import planned
from wsph.study.runs import run_study
from wsph.study.tables import Study

FORMS = ("stress-points", "total-lagrangian", "updated-lagrangian")
SCENE = """
schema = 1
dim = 2
[run]
integrator = "leapfrog"
formulation = "total-lagrangian"
cfl = "auto"
end = 2.0
[[bodies]]
name = "b"
shape = { type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }
spacing = 0.125
state = "strain"
velocity = ["-0.2", "0"]
viscosity = { alpha = 0.5, beta = 0.5 }
[bodies.material]
model = "mises"
density = 1.0
youngs_modulus = 1.0
poisson_ratio = 0.3
yield_stress = 2e-3
hardening_modulus = 0.01
[[boundary]]
body = "b"
face = "-x"
symmetry = "x"
"""
"""That of `crushed`, in the total-Lagrangian form."""
GRID = {"bodies.0.spacing": [1.0 / n for n in (4, 6, 8)]}


def crushed(form: str, cells: int = 8, speed: float = 0.2, **run: object) -> wsph.Scene:
    """A soft block that flies into a wall and flows."""
    law = scenes.material("mises", yield_stress=2e-3, hardening_modulus=0.01)
    keys = {"formulation": form, "cfl": "auto", "end": 2.0, **run}
    tables = {"boundary": [{"body": "b", "face": "-x", "symmetry": "x"}]}
    damped = {"viscosity": {"alpha": 0.5, "beta": 0.5}}
    return scenes.block(2, cells, run=keys, velocity=[f"-{speed}", "0"], material=law, tables=tables, **damped)


def study(**grid: object) -> Study:
    return Study.model_validate({"schema": 1, "scene": "", "grid": grid})


@pytest.mark.parametrize("form", FORMS)
def test_a_row_says_what_the_next_one_takes(form: str, tmp_path: Path) -> None:
    """Before any row the least; by a row at most twice off, where the bound is 1.7 to 4 times too low."""
    scene, asked = crushed(form), study(**GRID)
    plan = planned(asked, scene)
    outcome = run_study(asked, scene, tmp_path, workers=1)
    took = [outcome.made[k].row["steps"] for k in range(3)]
    before = [found for _, found in forecasts(plan, {})]
    for row, steps in zip(before, took, strict=True):
        assert isinstance(row, Forecast)
        assert row.steps < 0.75 * steps
        assert "at least" in str(row)
        assert "(steps get shorter: 'b' can flow)" in str(row)
    after = [found for _, found in forecasts(plan, {k: outcome.made[k] for k in (0, 1)})]
    assert [row.steps for row in after[:2]] == took[:2]
    assert "(by its own run)" in str(after[0])
    assert 0.5 * took[2] < after[2].steps < 1.3 * took[2]
    assert after[2].steps > before[2].steps
    assert after[2].work == pytest.approx(before[2].work * after[2].steps / before[2].steps, rel=0.02)
    assert str(after[2]).endswith(f"(by {plan[1].name!r})")


def test_where_steps_stay_nothing_is_a_bound() -> None:
    elastic = scenes.block(2, 4, run={"cfl": "auto"})
    assert shrinks(compose(elastic)) == ""
    assert shrinks(compose(crushed("stress-points"))) == "'b' can flow"
    fixed = crushed("stress-points").with_(**{"run.cfl": None, "run.dt": 0.01})
    assert shrinks(compose(fixed)) == ""
    assert shrinks(compose(crushed("stress-points", guard="off", cfl=0.2))) == ""
    floor = {"name": "floor", "shape": {"type": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}, "against": ["b"]}
    assert shrinks(compose(scenes.block(2, 4, run={"cfl": "auto"}, tables={"tools": [floor]}))) == "tools touch"
    # Small strain: nothing of the step follows the motion.
    small = scenes.block(2, 4, run={"integrator": "tsph", "cfl": 0.5}, material=scenes.material("mises", yield_stress=1.0, hardening_modulus=0.1))  # fmt: skip
    assert shrinks(compose(small)) == ""


def test_a_dry_run_takes_the_rows_of_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    text = 'schema = 1\nscene = "scene.toml"\n[grid]\n"bodies.0.spacing" = '
    file, out = tmp_path / "grids.toml", str(tmp_path / "out")
    file.write_text(text + "[0.25]\n")
    assert main(["study", str(file), "-o", out, "--dry-run"]) == 0
    assert "11 steps" in capsys.readouterr().out
    assert main(["study", str(file), "-o", out]) == 0
    file.write_text(text + "[0.25, 0.125]\n")
    capsys.readouterr()
    assert main(["study", str(file), "-o", out, "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "about 16 steps" in said
    assert "(by 'scene: bodies.0.spacing = 0.25')" in said
    assert "2 rows: 47 right-hand sides" in said
    file.write_text(text.replace("[grid]", '[set]\n"run.end" = 1.5\n[grid]') + "[0.25, 0.125]\n")
    assert main(["study", str(file), "-o", out, "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "tell nothing: row 'scene: bodies.0.spacing = 0.25' was made with another scene" in said
    assert "2 rows: at least " in said


def test_rows_of_a_search_say_the_least_first_and_then_what_rows_took() -> None:
    told: list[str] = []
    probe = {"name": "p", "where": "x >= 1", "reduce": "mean", "fields": ["displacement_x"]}
    rows = Rows(crushed("total-lagrangian").with_(probes=[probe]), tell=told.append)
    first = rows.make(4)
    second = rows.make(8)
    assert "at least 11 steps" in told[0]
    assert told[0].endswith("(steps get shorter: 'b' can flow)")
    more = first.work / rows.costs.plan(4).work
    assert more > 1.3
    assert f"{rows.costs.plan(8).steps * more:.0f} steps" in told[1]
    assert "at least" not in told[1]
    assert second.planned == pytest.approx(rows.costs.plan(8).work * more)
    assert abs(second.planned - second.work) < abs(rows.costs.plan(8).work - second.work)
