"""What rows say of each other's errors, on records whose errors are known, and on the bars of the examples."""

from pathlib import Path

import numpy as np
import pytest

from wsph import load
from wsph.cli import main
from wsph.study.judge import judged
from wsph.study.plan import planned
from wsph.study.rows import Made
from wsph.study.runs import run_study
from wsph.study.tables import Study

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SPACINGS = [0.1, 0.05, 0.04, 0.025, 0.02]
TIMES = np.linspace(0.0, 1.0, 801)


def study(*variants: str) -> Study:
    """A ladder of each."""
    return Study.model_validate(
        {
            "schema": 1,
            "scene": "",
            "variants": [{"name": name, "set": {"run.seed": k}} for k, name in enumerate(variants)],
            "grid": {"bodies.0.spacing": SPACINGS},
        }
    )


def answer(spacing: float, order: float, limit: float) -> np.ndarray:
    """A record that comes to a limit with an order; relative to the exact one it is spacing^order wrong."""
    return np.sin(7.0 * TIMES) * (limit + spacing**order)


def rows(each: Study, **variants: tuple[float, float]) -> dict[int, Made]:
    """Rows of such records, by the order and the limit of the variants."""
    made: dict[int, Made] = {}
    for number, row in enumerate(planned(each, load(EXAMPLES / "shock_bar.toml"))):
        values = answer(row.spacing or 0.0, *variants[row.variant])
        made[number] = Made({"variant": row.variant}, {"tip.velocity_x": np.array([TIMES, values])})
    return made


def test_bars_hold_and_orders_are_seen() -> None:
    each = study("first", "half")
    made = rows(each, first=(1.0, 1.0), half=(0.5, 1.0))
    ladders = judged(planned(each, load(EXAMPLES / "shock_bar.toml")), made)
    assert [ladder.name for ladder in ladders] == ["first", "half"]
    for number, (order, spacing) in enumerate([(order, h) for order in (1.0, 0.5) for h in SPACINGS]):
        row, true = made[number].row, spacing**order
        assert row["order"] == pytest.approx(order, abs=0.1)
        assert row["estimate"] == pytest.approx(true, rel=0.2)
        assert true <= float(row["bar"] or 0.0) <= 2.0 * true
        assert row["convergence"] == row["disagrees"] == ""


def test_variants_that_come_to_other_answers_are_told() -> None:
    each = study("right", "wrong", "near")
    plan = planned(each, load(EXAMPLES / "shock_bar.toml"))
    made = rows(each, right=(1.0, 1.0), wrong=(1.0, 1.2), near=(1.0, 1.01))
    judged(plan, made)
    said = {made[k].row["variant"]: made[k].row["disagrees"] for k in made}
    assert said == {
        "right": "disagrees with wrong",
        "wrong": "disagrees with right; near",
        "near": "disagrees with wrong",
    }


def test_no_convergence_has_no_bar() -> None:
    each = study("growing")
    made = rows(each, growing=(-0.5, 1.0))
    judged(planned(each, load(EXAMPLES / "shock_bar.toml")), made)
    assert {made[k].row["convergence"] for k in made} == {"no convergence"}
    assert {made[k].row["bar"] for k in made} == {made[k].row["estimate"] for k in made} == {None}


def test_differences_that_fall_by_chance_are_no_convergence_where_links_break_over_ever_more_area() -> None:
    each = study("chance")
    made = rows(each, chance=(1.0, 1.0))
    for spacing, row in zip(SPACINGS, made.values(), strict=True):
        row.row["crack_area"] = 1.0 / spacing
        row.series["tip.velocity_x"][1] *= 1.2 if spacing == 0.025 else 1.0
    plan = planned(each, load(EXAMPLES / "shock_bar.toml"))
    judged(plan, made)
    assert {row.row["convergence"] for row in made.values()} == {"no convergence"}
    smooth = rows(each, chance=(1.0, 1.0))
    for number, row in smooth.items():
        row.row["crack_area"] = made[number].row["crack_area"]
    judged(plan, smooth)
    assert {row.row["convergence"] for row in smooth.values()} == {""}


def test_columns_that_are_zero_by_symmetry_are_not_judged() -> None:
    each = study("first")
    made = rows(each, first=(1.0, 1.0))
    for k, noise in enumerate((1e-9, 3e-9, 1e-9, 5e-9, 2e-9)):
        made[k].series["tip.velocity_y"] = np.array([TIMES, noise * TIMES])
    (ladder,) = judged(planned(each, load(EXAMPLES / "shock_bar.toml")), made)
    assert list(ladder.columns) == ["tip.velocity_x"]
    assert ladder.converges


def test_too_few_rows_have_no_bar() -> None:
    each = study("first")
    made = rows(each, first=(1.0, 1.0))
    del made[0], made[1]
    judged(planned(each, load(EXAMPLES / "shock_bar.toml")), made)
    assert {made[k].row["convergence"] for k in made} == {"no bar: 4 rows of other spacings are needed"}


def test_bars_of_a_bar_hold(tmp_path: Path) -> None:
    """Taylor-SPH on the elastic shock bar below C = 1, where its order is .6."""
    each = Study.model_validate(
        {
            "schema": 1,
            "scene": "",
            "set": {"run.cfl": 0.9},
            "grid": {"bodies.0.spacing": [0.04, 0.025, 0.02, 0.0125, 0.01]},
            "oracle": {
                "probe": "fixed-end",
                "column": "stress_xx",
                "exact": "-8e5*(t > 5e-3 and t <= 7.5e-3)",
                "norm": 1,
            },
        }
    )
    scene = load(EXAMPLES / "shock_bar.toml")
    outcome = run_study(each, scene, tmp_path)
    judged(planned(each, scene), outcome.made)
    for row in outcome.rows:
        assert float(row["error"] or 0.0) < float(row["bar"] or 0.0) < 4.0 * float(row["error"] or 0.0)
        assert 0.4 < float(row["order"] or 0.0) < 1.2


def test_a_dry_run_tells_the_work_and_runs_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    path = tmp_path / "study.toml"
    path.write_text(f'schema = 1\nscene = "{EXAMPLES / "shock_bar.toml"}"\n[grid]\n"run.cfl" = [0.5, 1.0, 2.0]\n')
    with monkeypatch.context() as m:
        m.setattr("wsph.accuracy.running.wanted.run", lambda *_, **__: pytest.fail("a run was made"))
        assert main(["study", str(path), "-o", str(tmp_path / "out"), "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert "scene: run.cfl = 0.5: 101 particles, 400 steps, 800 right-hand sides, 3.2e+05 pair visits" in said
    assert "scene: run.cfl = 2.0: refused: " in said
    assert "3 rows: 1200 right-hand sides, 4.8e+05 pair visits" in said
    assert not (tmp_path / "out").exists()
    outcome = run_study(Study.model_validate({"schema": 1, "scene": "", "grid": {"run.cfl": [0.5]}}), load(EXAMPLES / "shock_bar.toml"), tmp_path)  # fmt: skip
    assert outcome.rows[0]["pair_visits"] == 320_000


def test_one_key_for_several_and_a_grid_of_a_variant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid = {"bodies.0.spacing, bodies.1.spacing": [0.002, 0.001]}
    scene = load(EXAMPLES / "two_rods.toml")
    own = {"name": "coarse", "grid": {"bodies.0.spacing, bodies.1.spacing": [0.004]}}
    each = Study.model_validate({"schema": 1, "scene": "", "variants": [{"name": "all"}, own], "grid": grid})
    plan = planned(each, scene)
    assert [(row.variant, row.spacing) for row in plan] == [("all", 0.002), ("all", 0.001), ("coarse", 0.004)]
    assert {body.spacing for body in plan[2].scene.bodies} == {0.004}
    assert [row.ladder for row in plan] == ["all", "all", "coarse"]
    path = tmp_path / "study.toml"
    path.write_text('schema = 1\nscene = "x.toml"\n[[variants]]\nname = "a"\n[[variants]]\nname = "a"\n')
    assert main(["study", str(path)]) == 2
    assert "two variants are named 'a'" in capsys.readouterr().err
