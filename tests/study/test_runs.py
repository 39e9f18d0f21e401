"""Studies: every variant at every place of the grid, cost and error of each, faults by name."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph import Scene, load, run
from wsph.cli import main
from wsph.errors import SceneError
from wsph.output.view.front import undominated
from wsph.study.oracle import Oracle
from wsph.study.plan import facts, planned
from wsph.study.runs import run_study
from wsph.study.tables import Study, load_study
from wsph.validation.meshes import around, moved_grid, write

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


TIMES = {"seconds", "cpu_seconds", "wall_seconds", "joules"}
"""Columns that are not the same twice."""


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
    seen: list[int] = []
    spread = run_study(loaded, scene, tmp_path, workers=2, keep=lambda place, _: seen.append(place))
    timeless = [[{k: v for k, v in row.items() if k not in TIMES} for row in each.rows] for each in (alone, spread)]
    assert timeless[0] == timeless[1]
    assert sorted(seen) == list(range(6))
    for place, made in alone.made.items():
        for name, series in made.series.items():
            assert np.array_equal(series, spread.made[place].series[name])


def test_an_interrupt_ends_a_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded, scene = load_study(study(tmp_path))
    interrupted = run(scene, end=1e-4)
    interrupted.status = "interrupted"
    monkeypatch.setattr("wsph.accuracy.running.wanted.run", lambda *_, **__: interrupted)
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


BAR = TEXT.replace("[0.5, 1.0, 1.5]", "[0.5, 1.0]").replace(
    'exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"', 'reference = "r.csv"'
)


def test_a_reference_is_compared_with_where_it_has_values(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The pulse until it ends at 7.5 ms, in a run of 10 ms: what comes after would count as an error of constant stress."""
    (tmp_path / "r.csv").write_text("time,stress\n0,0\n5e-3,0\n5.001e-3,-8e5\n7.4e-3,-8e5\n")
    assert main(["study", str(study(tmp_path, BAR)), "-o", str(tmp_path / "out")]) == 0
    rows = json.loads((tmp_path / "out" / "study.json").read_text())["rows"]
    over = "from 0 to 0.0074 s of 0 to 0.01 s: the reference has no more"
    assert [row["compared"] for row in rows] == [over] * 4
    assert rows[1]["error"] < 0.03
    assert f"({over})" in capsys.readouterr().out
    (tmp_path / "r.csv").write_text("time,stress\n0,0\n5e-3,0\n5.001e-3,-8e5\n7.5e-3,-8e5\n7.501e-3,0\n2e-2,0\n")
    assert main(["study", str(study(tmp_path, BAR)), "-o", str(tmp_path / "out"), "--overwrite"]) == 0
    rows = json.loads((tmp_path / "out" / "study.json").read_text())["rows"]
    assert {row["compared"] for row in rows} == {"whole run"}


REFERENCES = {
    "not there": (None, "r.csv: cannot be read"),
    "no numbers": ("time,stress\n", "r.csv: has 0 rows of a time and a value; at least 2 are needed|cannot be read"),
    "three columns": ("a,b,c\n0,1,2\n1,2,3\n", "r.csv: cannot be read"),
    "words": ("time,stress\n0,zero\n1,one\n", "r.csv: cannot be read"),
    "not a number": ("time,stress\n0,0\n1e-3,nan\n1,0\n", "r.csv: line 3: has what is no finite number"),
    "back in time": ("time,stress\n0,1\n2e-3,0\n1e-3,0\n", "r.csv: line 4: its time is before that of the line above"),
    "of milliseconds": ("time,stress\n5,1\n10,1\n", "r.csv: is of 5 to 10 s, the run of 0 to 0.01 s"),
}


@pytest.mark.parametrize("each", REFERENCES)
def test_a_reference_at_fault_is_named_before_anything_runs(tmp_path: Path, each: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    content, message = REFERENCES[each]
    if content is not None:
        (tmp_path / "r.csv").write_text(content)
    monkeypatch.setattr("wsph.accuracy.running.wanted.run", lambda *_, **__: pytest.fail("a run was made"))
    assert main(["study", str(study(tmp_path, BAR)), "-o", str(tmp_path / "out")]) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "out").exists()


def test_answers_that_say_nothing_are_refused(tmp_path: Path) -> None:
    over = {"name": "over", "where": "x > 0.5", "reduce": "mean", "fields": ["velocity_x"]}
    two = {"name": "two", "at": [[0.25], [0.75]], "fields": ["velocity_x"]}
    bar = load(ROOT / "examples" / "shock_bar.toml").with_(probes=[over, two], end="1 ms")
    for oracle, message in (
        (
            {"probe": "over", "column": "velocity_x", "exact": "x*t"},
            "'x\\*t' uses a place, but probe 'over' is over a selection",
        ),
        (
            {"probe": "none", "column": "velocity_x", "exact": "t"},
            "no probe is named 'none' in the scene; there is over, two",
        ),
        (
            {"probe": "over", "column": "velocity_x", "exact": "0*t"},
            "oracle.exact: is zero wherever it is compared with",
        ),
        ({"field": "velocity_x", "exact": "0*x"}, "oracle.exact: exact is zero everywhere"),
    ):
        with pytest.raises(SceneError, match=message):
            run_study(Study(schema=1, scene="", oracle=oracle), bar, tmp_path)
    # Of several points the one that the column is of.
    moved = bar.with_(boundary=[], **{"bodies.0.velocity": ["x"]}, end="1 us")
    for k, place in enumerate((0.25, 0.75)):
        exact = Oracle(probe="two", column=f"velocity_x[{k}]", exact="x")
        assert exact.error(run(moved), tmp_path).error < 1e-6, place


def test_a_study_is_never_written_over_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    path, out = study(tmp_path), tmp_path / "out"
    made: list[float] = []

    def counted(scene: Scene, **keys: Any) -> Any:
        made.append(float(scene.run.cfl or 0.0))
        if len(made) == 4:
            raise KeyboardInterrupt
        return run(scene, **keys)

    monkeypatch.setattr("wsph.accuracy.running.wanted.run", counted)
    again = ["study", str(path), "-o", str(out), "--workers", "1"]
    assert main(again) == 130
    assert f"interrupted; rows that are complete are in {out}: go on with --resume" in capsys.readouterr().err
    assert len(json.loads((out / "study.json").read_text())["rows"]) == 3
    assert main(again) == 2
    assert (
        "holds files already; go on from what it holds with --resume, choose another folder with -o, or give --overwrite"
        in capsys.readouterr().err
    )
    made[:] = [0.0] * 4
    assert main([*again, "--resume"]) == 0
    assert made[4:] == [0.5, 1.0, 1.5]
    rows = json.loads((out / "study.json").read_text())["rows"]
    assert [row["status"] for row in rows] == ["completed", "completed", "refused"] * 2
    path.write_text(TEXT.replace("1.0, 1.5", "1.0, 1.5, 0.9"))
    assert main([*again, "--resume"]) == 0
    assert made[7:] == [0.9, 0.9]
    path.write_text(TEXT.replace("norm = 1", "norm = 2"))
    assert main([*again, "--resume"]) == 2
    assert "row 'narrow: run.cfl = 0.5' was made with another answer: give --overwrite" in capsys.readouterr().err
    path.write_text(TEXT.replace("run.support", "run.seed").replace("1.8", "2"))
    assert main([*again, "--resume"]) == 2
    assert "row 'wide: run.cfl = 0.5' was made with another scene" in capsys.readouterr().err
    path.write_text(TEXT)
    for series in (out / "series").glob("*.npz"):
        series.unlink()
    assert main([*again, "--resume"]) == 0
    assert sorted(made[9:]) == [0.5, 0.5, 1.0, 1.0]
    with pytest.raises(SystemExit):
        main([*again, "--resume", "--overwrite"])
    assert main(["study", str(path), "-o", str(tmp_path / "new"), "--resume"]) == 2
    assert "holds no study to resume" in capsys.readouterr().err
    foreign = tmp_path / "photos"
    foreign.mkdir()
    (foreign / "cat.jpg").touch()
    assert main(["study", str(path), "-o", str(foreign), "--overwrite"]) == 2
    assert "holds no study of wsph, so --overwrite does not touch it" in capsys.readouterr().err


def test_a_row_is_of_the_mesh_that_its_file_held(tmp_path: Path) -> None:
    path, (nodes, corners) = tmp_path / "square.vtu", moved_grid((1.0, 1.0), (2, 2), 0.0)
    body = {"name": "b", "mesh": {"file": str(path)}, "state": "strain", "material": scenes.material()}
    scene = Scene(schema=1, dim=2, run={"integrator": "leapfrog", "end": 1.0, "cfl": 0.3}, bodies=[body])
    one = Study.model_validate({"schema": 1, "scene": "scene.toml", "variants": [{"name": "a"}]})
    found: list[str] = []
    for size in (1.0, 1.0, 1.1):
        write(path, size * nodes, quad=around(corners))
        found.append(facts(one, planned(one, scene), tmp_path)[0].scene)
    assert found[0] == found[1]
    assert found[0] != found[2]


def test_a_front_has_no_row_that_another_is_better_than() -> None:
    assert undominated(np.array([3.0, 4.0, 2.0, 2.0, 1.0, 5.0])).tolist() == [True, False, True, False, True, False]
    assert undominated(np.array([])).tolist() == []
