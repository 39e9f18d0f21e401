"""Searches whose answer is known: what they say of it, what they cost, and how they end."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from coverage import true_errors
from coverage_scenes import KNOWN

import wsph
from tests.scenes import bar, held
from wsph.accuracy.accurate import accurate
from wsph.accuracy.columns import aims
from wsph.accuracy.envelope import FLOOR
from wsph.accuracy.limits import Limit
from wsph.accuracy.measures import Record, distances
from wsph.accuracy.rows import Rows
from wsph.accuracy.search import search
from wsph.cli import main
from wsph.output.view.tables import Tables

TOML = """
schema = 1
dim = 1
[run]
integrator = "leapfrog"
end = 2.5
cfl = 0.5
[[bodies]]
name = "b"
shape = { type = "box", min = [0.0], max = [1.0] }
spacing = 0.05
state = "stress"
velocity = ["1e-6*sin(pi*x)"]
material = { model = "elastic", density = 1.0, youngs_modulus = 1.0, poisson_ratio = 0.0 }
[[boundary]]
body = "b"
face = "-x"
fixed = ["x"]
[[boundary]]
body = "b"
face = "+x"
fixed = ["x"]
"""
PROBE = """
[[probes]]
name = "p"
at = [[0.25]]
fields = ["velocity"]
"""


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    path = tmp_path / "bar.toml"
    path.write_text(TOML + PROBE)
    return path


def vibrating(**tables) -> wsph.Scene:
    probe = {"name": "p", "at": [[0.25]], "fields": ["velocity"]}
    hold = {"boundary": [held("-x", 1), held("+x", 1)], "probes": [probe], **tables}
    # A Poisson's ratio does nothing in uniaxial stress.
    return bar(20, velocity=["1e-6*sin(pi*x)"], run={"end": 2.5}, tables=hold)


def true_error(result: wsph.Result) -> float:
    probe = result.probes["p"]
    times = np.linspace(0.0, probe["time"][-1], 5001)
    exact = Record(times, 1e-6 * np.sin(0.25 * np.pi) * np.cos(np.pi * times))
    return float(distances([exact, Record(probe["time"], probe["velocity_x"])])[0, 1])


@pytest.mark.parametrize("tolerance", [0.02, 0.001])
def test_a_tolerance_is_met_and_the_bar_holds(tolerance):
    found = accurate(vibrating(), tolerance=tolerance)
    assert found.status == "met"
    assert true_error(found.result) <= min(tolerance, found.data["bar"])
    assert found.data["bar"] < 4.0 * true_error(found.result)
    assert found.data["order"] == pytest.approx(1.75, abs=0.26)
    planned = [row["planned_work"] for row in found.data["rows"]]
    assert planned == [row["work"] for row in found.data["rows"]]


def test_a_coarsest_row_that_is_of_no_order_does_not_end_a_search():
    """Plastic waves with viscosity: their first four rows have an order of one and an error of 4 %, the three finest of them
    one of a half and 8 %; it is 14 %."""
    (case,) = (case for case in (make() for make in KNOWN) if case.name == "plastic bar, leapfrog")
    rows = Rows(case.scene)
    found = search(rows, aims(case.scene, 0.05), Limit(None, 1e7))
    assert found.status == "met"
    assert len(rows.made) > 4
    assert max(true_errors(case, rows.made[-1]).values()) <= 0.05


def test_sure_puts_the_whole_bar_within():
    found = accurate(vibrating(), tolerance=0.003, sure=True)
    assert found.data["bar"] <= 0.003
    assert len(found.data["rows"]) >= len(accurate(vibrating(), tolerance=0.003).data["rows"])


def test_out_of_reach_is_refused_before_it_is_paid_for():
    found = accurate(vibrating(), tolerance=1e-6, limit=Limit(None, 1e5))
    assert found.status == "out of reach"
    assert "within 1e+05 pair visits expect" in found.why
    assert found.data["total_work"] < 1e5
    assert found.result is not None


def test_a_budget_is_used_and_kept_to():
    spent = accurate(vibrating(), limit=Limit(None, 1e6))
    assert spent.status == "met"
    assert 0.5e6 < spent.data["total_work"] <= 1e6
    assert true_error(spent.result) <= spent.data["bar"]
    half = accurate(vibrating(), limit=Limit(None, 2e5))
    assert true_error(half.result) > 2.0 * true_error(spent.result)


def test_another_scheme_agrees():
    found = accurate(vibrating(), tolerance=0.01, check=True)
    assert "agrees within the bars" in found.why


def test_another_scheme_is_judged_by_the_floor_of_its_precision(monkeypatch):
    monkeypatch.setitem(FLOOR, "f32", 10.0)  # above all differences of rows: no bar but zero
    found = accurate(vibrating().with_(precision="f32"), tolerance=0.01, check=True)
    assert "bars 0 % and 0 %" in found.why


def test_probes_say_what_is_judged():
    probes = [
        {"name": "p", "at": [[0.25]], "fields": ["velocity"], "quantity": "frequency", "tolerance": "5%"},
        {"name": "q", "at": [[0.5]], "fields": ["velocity"], "tolerance": False},
    ]
    found = accurate(vibrating(probes=probes), tolerance=1e-9)
    assert found.status == "met"
    assert list(found.data["columns"]) == ["p.velocity_x"]
    assert found.data["columns"]["p.velocity_x"]["quantity"] == "frequency"
    for probe in probes:
        probe["tolerance"] = False
    with pytest.raises(wsph.SceneError, match=r"probes.0.tolerance: .*nothing to be accurate about"):
        accurate(vibrating(probes=probes), tolerance=0.01)


def test_columns_that_are_zero_by_symmetry_are_named():
    probe = {"name": "p", "at": [[0.25], [0.5]], "fields": ["stress_xx"]}
    found = accurate(vibrating(probes=[probe]), tolerance=0.02)
    assert list(found.data["columns"]) == ["p.stress_xx[0]"]
    assert "zero by symmetry, not judged: p.stress_xx[1]" in found.why


def test_the_command_line(scene_file, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["run", str(scene_file), "--accuracy", "1%", "-o", str(out)]) == 0
    kept = json.loads((out / "accuracy.json").read_text())
    assert kept["status"] == "met"
    assert kept["chosen"] == json.loads((out / "summary.json").read_text())["particles"] - 1
    assert not (out / ".row").exists()
    said = capsys.readouterr()
    assert "p.velocity_x" in said.out
    assert "pair visits" in said.err
    assert main(["run", str(scene_file), "--accuracy", "0.0001%", "--budget", "1e5", "-o", str(out)]) == 2
    assert (
        main(["run", str(scene_file), "--accuracy", "0.0001%", "--budget", "1e5", "-o", str(out), "--overwrite"]) == 4
    )
    assert (out / "summary.json").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--accuracy", "many"], "'many' is no tolerance"),
        (["--budget", "3 kg"], "'3 kg' is not in units of s"),
        (["--accuracy", "1%", "--resume"], "--resume: a search begins anew"),
        (["--check"], "--check goes with --accuracy or --budget"),
        (["--accuracy", "150%"], "--accuracy: '150%' is not above 0 and below 1"),
        (["--accuracy", "1%", "--budget", "-1 s"], "--budget: '-1 s' is not above zero"),
        (["--accuracy"], "accuracy: neither a tolerance nor a budget is given"),
    ],
)
def test_options_that_do_not_go(scene_file, tmp_path, capsys, options, words):
    assert main(["run", str(scene_file), "-o", str(tmp_path / "out"), *options]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_pictures_have_its_bars(scene_file, tmp_path):
    out = tmp_path / "out"
    main(["run", str(scene_file), "--accuracy", "5%", "-o", str(out)])
    kept = json.loads((out / "accuracy.json").read_text())["columns"]["p.velocity_x"]
    (series,) = Tables(out).series("p.velocity_x")
    mean = np.trapezoid(np.abs(series.values), series.times) / series.times[-1]
    assert series.bar == pytest.approx(kept["bar"] * mean)
    assert main(["view", str(out), "--curve", "p", "--save", str(tmp_path / "a.png")]) == 0


NUMBERS = {"frequency": (0.5, "Hz"), "mean": (None, "m/s"), "final": (None, "m/s"), "peak": (None, "m/s"), "arrival": (0.0, "s")}  # fmt: skip


@pytest.mark.parametrize("quantity", list(NUMBERS))
def test_numbers_have_their_bar_their_unit_and_a_row_each(scene_file, tmp_path, capsys, quantity):
    scene_file.write_text(TOML.replace("end = 2.5", "end = 3.2") + PROBE + f'quantity = "{quantity}"\nscale = 1e-7\n')
    out, (right, unit) = tmp_path / "out", NUMBERS[quantity]
    if quantity == "frequency":
        scene_file.write_text(scene_file.read_text().replace("scale = 1e-7\n", ""))
    main(["run", str(scene_file), "--accuracy", "2%", "-o", str(out)])
    data = json.loads((out / "accuracy.json").read_text())
    kept = data["columns"]["p.velocity_x"]
    assert kept["unit"] == unit
    assert kept["words"].startswith(quantity)
    assert kept["words"].endswith(unit)
    assert f"p.velocity_x {kept['words']}: error about" in capsys.readouterr().out
    rows = [row["values"]["p.velocity_x"] for row in data["rows"]]
    assert rows[-1] == pytest.approx(kept["value"], rel=1e-9)
    assert [row["differences"]["p.velocity_x"] for row in data["rows"]][-1] == 0.0
    if right is not None:
        assert abs(kept["value"] - right) <= kept["half_width"] + 1e-12
    (series,) = Tables(out).series("p.velocity_x")
    assert series.mark is not None
    assert (series.mark.value, series.mark.half_width) == (kept["value"], kept["half_width"])
    assert series.words == kept["words"]
    (turned,) = Tables(out).series("-p.velocity_x")
    assert turned.words == f"p.velocity_x {kept['words']}"
    assert series.bar == 0.0
    assert main(["view", str(out), "--curve", "p.velocity_x", "--save", str(tmp_path / "a.png")]) == 0


def test_a_curve_says_that_there_is_no_bar_to_draw(scene_file, tmp_path):
    scene_file.write_text(TOML + PROBE + PROBE.replace('"p"', '"q"') + "tolerance = false\n")
    out = tmp_path / "out"
    main(["run", str(scene_file), "--accuracy", "5%", "-o", str(out)])
    assert [each.words for each in Tables(out).series("q")] == ["not judged: no error bar"]
    assert [each.words for each in Tables(out).series("p")] == [""]


@pytest.mark.parametrize("budget", [None, Limit(None, 1e6)])
def test_a_frequency_of_less_than_a_period_is_refused_after_the_first_row(budget):
    probe = {"name": "p", "at": [[0.25]], "fields": ["velocity"], "quantity": "frequency"}
    found = accurate(vibrating(probes=[probe]).with_(end=0.8), tolerance=None if budget else 0.01, limit=budget)
    assert found.status == "refused"
    assert len(found.data["rows"]) == 1
    assert (
        "p.velocity_x: no whole period to have a frequency of: the record has about 0.4 of one; end at 3" in found.why
    )


def test_progress_is_of_the_steps_of_a_row():
    seen = []
    found = accurate(vibrating(), tolerance=0.02, progress=lambda *each: seen.append(each))
    assert {steps for _, steps, _ in seen} == {row["steps"] for row in found.data["rows"]}


def test_what_it_leaves_can_be_written_over(scene_file, tmp_path):
    out = tmp_path / "out"
    (out / ".row" / "frames").mkdir(parents=True)  # as a search that was killed leaves it
    assert main(["run", str(scene_file), "--accuracy", "5%", "-o", str(out)]) == 0
    assert main(["run", str(scene_file), "-o", str(out), "--overwrite"]) == 0
    assert not (out / "accuracy.json").exists()
    none = tmp_path / "none"
    assert main(["run", str(scene_file), "--accuracy", "5%", "--budget", "10", "-o", str(none)]) == 4
    assert not none.exists()


def test_without_probes_it_is_refused(tmp_path, capsys):
    path = tmp_path / "bar.toml"
    path.write_text(TOML)
    assert main(["run", str(path), "--accuracy", "1%", "-o", str(tmp_path / "out")]) == 2
    assert f"{path}: probes: nothing to be accurate about: add a probe" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")
def test_an_interrupt_leaves_the_best_row(tmp_path):
    path, out = tmp_path / "bar.toml", tmp_path / "out"
    path.write_text(TOML.replace("end = 2.5", "end = 400.0") + PROBE + 'every = "10 s"\n')
    command = [sys.executable, "-m", "wsph.cli", "run", str(path), "--accuracy", "0.01%", "-o", str(out)]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})  # fmt: skip
    deadline = time.monotonic() + 60.0
    while not (out / "summary.json").is_file() and time.monotonic() < deadline:
        time.sleep(0.05)
    running.send_signal(signal.SIGTERM)
    said, _ = running.communicate(timeout=60)
    assert running.returncode == 130, said
    assert "interrupted" in said
    kept = json.loads((out / "accuracy.json").read_text())
    assert kept["status"] == "interrupted"
    assert kept["chosen"] == json.loads((out / "summary.json").read_text())["particles"] - 1
    assert not (out / ".row").exists()
