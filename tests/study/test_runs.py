"""Studies: every variant at every place of the grid, cost and error of each, faults by name."""

import csv
import json
from pathlib import Path

import pytest

from wsph import run
from wsph.cli import main
from wsph.errors import SceneError
from wsph.study.runs import run_study
from wsph.study.tables import load_study

ROOT = Path(__file__).resolve().parents[2]
TEXT = f"""
schema = 1
title = "two supports"
scene = "{ROOT / "examples" / "shock_bar.toml"}"
[grid]
"run.cfl" = [0.5, 1.0, 1.5]
[[variants]]
name = "narrow"
[[variants]]
name = "wide"
set = {{ "run.support" = 1.8 }}
[oracle]
probe = "fixed-end"
column = "stress_xx"
exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"
norm = 1
"""


def study(folder: Path, text: str = TEXT) -> Path:
    """A study file."""
    path = folder / "study.toml"
    path.write_text(text)
    return path


def test_rows_of_cost_and_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(study(tmp_path)), "-o", str(tmp_path / "out")]) == 0
    assert "narrow: run.cfl = 1.0: completed, 400 right-hand sides, error 0.03" in capsys.readouterr().out
    rows = json.loads((tmp_path / "out" / "study.json").read_text())["rows"]
    assert [(r["variant"], r["run.cfl"]) for r in rows] == [(v, c) for v in ("narrow", "wide") for c in (0.5, 1.0, 1.5)]
    assert rows[0]["error"] > 4 * rows[1]["error"]
    assert rows[1]["pair_visits"] == 400 * 400
    assert rows[2]["status"] == "refused"
    assert "beyond its stability limit 1.000" in rows[2]["reason"]
    with (tmp_path / "out" / "study.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [row["status"] for row in table] == [row["status"] for row in rows]
    assert float(table[0]["error"]) == rows[0]["error"]
    assert (tmp_path / "out" / "front.png").stat().st_size > 5000


def test_processes_make_the_same_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded, scene = load_study(study(tmp_path))
    alone = run_study(loaded, scene, tmp_path)
    monkeypatch.setattr("wsph.study.runs.SPREAD_SECONDS", 0.0)
    seen: list[tuple[int, int]] = []
    spread = run_study(loaded, scene, tmp_path, lambda done, of: seen.append((done, of)), workers=2)
    timeless = [[{k: v for k, v in row.items() if k != "seconds"} for row in rows] for rows in (alone, spread)]
    assert timeless[0] == timeless[1]
    assert seen == [(k, 6) for k in range(1, 7)]


def test_an_interrupt_ends_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded, scene = load_study(study(tmp_path))
    interrupted = run(scene, end=1e-4)
    interrupted.status = "interrupted"
    monkeypatch.setattr("wsph.study.runs.run", lambda *_, **__: interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_study(loaded, scene, tmp_path)


def test_a_reference_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "reference.csv").write_text(
        "time,stress\n0,0\n5e-3,0\n5.001e-3,-8e5\n7.5e-3,-8e5\n7.501e-3,0\n1e-2,0\n"
    )
    text = TEXT.replace('exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"', 'reference = "reference.csv"').replace(
        "[0.5, 1.0, 1.5]", "[1.0]"
    )
    assert main(["study", str(study(tmp_path, text)), "-o", str(tmp_path / "out")]) == 0
    rows = json.loads((tmp_path / "out" / "study.json").read_text())["rows"]
    assert rows[0]["error"] == pytest.approx(0.02, abs=0.015)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("norm = 1", "nrom = 1"), r"line 16: oracle.nrom: unknown key; did you mean 'norm'"),
        (('exact = "', 'exact = "foo + '), "line 15: oracle.exact: unknown name 'foo'"),
        (('probe = "fixed-end"', 'field = "stress_xx"'), "oracle: give either field, or probe and column"),
        (("shock_bar.toml", "shok_bar.toml"), "no such file"),
        (('"run.cfl" = [', '"run.cfl" = [['), "is not TOML"),
        (("schema = 1", "schema = 2"), "line 2: schema: 2 is none of 1"),
    ],
)
def test_faults(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        load_study(study(tmp_path, TEXT.replace(*change)))


def test_an_override_or_a_probe_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(study(tmp_path, TEXT.replace("run.support", "run.suport")))]) == 2
    assert "run.suport: unknown key; did you mean 'support'" in capsys.readouterr().err
    wrong = TEXT.replace('column = "stress_xx"', 'column = "stress_yy"').replace("[0.5, 1.0, 1.5]", "[1.0]")
    assert main(["study", str(study(tmp_path, wrong))]) == 2
    assert "no column 'stress_yy' of probe 'fixed-end'; there is time, stress_xx" in capsys.readouterr().err
