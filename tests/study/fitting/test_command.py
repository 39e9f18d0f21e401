"""`wsph calibrate` from the command line, and what the mesh leaves open of its parameters."""

import json
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.study.fitting.test_fit import FREE, NAMES, TIMES, bar, needs_scipy, noisy
from tests.study.test_workers import Losing
from wsph import Scene
from wsph.cli import main
from wsph.study.fitting.curves import computed
from wsph.study.fitting.fit import fit
from wsph.study.fitting.mesh import mesh_bar
from wsph.study.fitting.parameters import read_parameter
from wsph.study.fitting.runs import Runs

tomli_w = pytest.importorskip("tomli_w")


def files(folder: Path, scene: Scene, values: np.ndarray) -> tuple[Path, Path]:
    """A scene's file, and one of curves."""
    (folder / "bar.toml").write_text(tomli_w.dumps(scene.data()))
    rows = [",".join(map(str, row)) for row in np.vstack([TIMES, values]).T]
    (folder / "data.csv").write_text("\n".join([",".join(("time", *NAMES[: len(values)])), *rows]) + "\n")
    return folder / "bar.toml", folder / "data.csv"


@needs_scipy
def test_calibrate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene, data = files(tmp_path, bar(16), noisy(computed(NAMES[:1], TIMES, bar(64)).values, 0.004, 1).values)
    key, free = "bodies.0.material.youngs_modulus", ["--free", f"{FREE[0].partition(' @')[0]}"]
    asked = ["calibrate", str(scene), str(data), *free, "-o", str(tmp_path / "out"), "--workers", "1"]
    assert main(asked) == 0
    said = capsys.readouterr().out
    assert f"{key} = 2" in said or f"{key} = 19" in said
    assert "GPa (one standard deviation), mesh " in said
    assert "finding: the mesh can move youngs_modulus further than the scatter of the data" in said
    found = json.loads((tmp_path / "out" / "calibration.json").read_text())
    (modulus,) = found["parameters"]
    assert modulus["value"] == pytest.approx(200.0, rel=0.02)
    assert 0.0 < modulus["standard_deviation"] < modulus["mesh_bar"] < 60.0
    assert found["covariance"] == [[pytest.approx(modulus["standard_deviation"] ** 2)]]
    assert found["correlation"] == [[pytest.approx(1.0)]]
    assert found["cells"][0] == 16
    assert (tmp_path / "out" / "fit.csv").read_text().startswith("time,mid.stress_xx,mid.stress_xx (fit)\n")
    assert (tmp_path / "out" / "fit.png").stat().st_size > 5000
    # What is printed last is a command that takes the fit.
    assert f'--set {key}="' in said.splitlines()[-1]
    assert main(asked) == 2
    assert "holds files already; choose another folder with -o, or give --overwrite" in capsys.readouterr().err
    (tmp_path / "notes.txt").write_text("of somebody")
    assert main([*asked[:-3], str(tmp_path), "--overwrite"]) == 2
    assert "holds no calibration of wsph, so --overwrite does not touch it" in capsys.readouterr().err


@needs_scipy
def test_the_mesh_moves_parameters_less_than_its_bar_says() -> None:
    """Fitted to a fine run without noise, what is off is the mesh's."""
    fine = computed(NAMES, TIMES, bar(80)).values
    scene = bar(20)
    free = [read_parameter(each.partition(" @")[0], scene) for each in FREE]
    with Runs(NAMES, TIMES, 1) as runs:
        curves = noisy(fine, 0.0, 1)
        found = fit(scene, curves, free, runs)
        mesh = mesh_bar(scene, curves, found, runs)
    off = np.abs(found.values - [200.0, 300.0])
    assert (off > 1e-4).all()
    assert (off < mesh.bars).all()
    assert (mesh.bars < [40.0, 60.0]).all()
    assert all(each.converges for each in mesh.estimates.values())


@needs_scipy
def test_a_body_from_a_file_has_no_ladder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from wsph.errors import Refused

    def refused(scene: Scene) -> None:
        raise Refused("body 'bar' comes from a file")

    scene = bar(8)
    free = [read_parameter(FREE[0], scene)]
    monkeypatch.setattr("wsph.study.fitting.mesh.Lattices", refused)
    with Runs(NAMES, TIMES, 1) as runs:
        curves = noisy(computed(NAMES, TIMES, scene).values, 0.0, 1)
        mesh = mesh_bar(scene, curves, fit(scene, curves, free, runs), runs)
    assert np.isnan(mesh.bars).all()
    assert mesh.reason == "body 'bar' comes from a file"


def test_faults_come_before_any_run(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    scene, data = files(tmp_path, bar(8), np.ones((2, len(TIMES))))
    monkeypatch.setattr("wsph.accuracy.running.wanted.run", lambda *_, **__: pytest.fail("a run was made"))
    for free, message in (
        ([], "nothing to fit: give --free"),
        (["--free", "bodies.0.material.youngs_modulu=1..2 GPa"], "youngs_modulu: unknown key"),
        (["--free", "bodies.0.material.youngs_modulus=1..2 m"], "is not in units of"),
    ):
        assert main(["calibrate", str(scene), str(data), *free]) == 2
        assert message in capsys.readouterr().err
    assert not (tmp_path / "bar-fit").exists()


def test_long_runs_go_to_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    from concurrent.futures import ThreadPoolExecutor

    monkeypatch.setattr("wsph.study.fitting.runs.SPREAD_SECONDS", 0.0)
    monkeypatch.setattr("wsph.study.fitting.runs.Workers", ThreadPoolExecutor)
    with Runs(NAMES, TIMES, 2) as runs:
        (alone,) = runs([bar(8)])
        spread = runs([bar(8), bar(16)])
    assert np.array_equal(alone.values, spread[0].values)
    assert not np.array_equal(alone.values, spread[1].values)


def test_a_run_whose_worker_is_lost_is_made_again() -> None:
    scenes = [bar(8), bar(16)]
    alone = Runs(NAMES, TIMES, 1)(scenes)
    again = Runs(NAMES, TIMES, 1, Losing(0, 1))(scenes)
    for one, other in zip(alone, again, strict=True):
        assert np.array_equal(one.values, other.values)
    with pytest.raises(OSError, match="a run of the fit is lost: its process was killed by signal 9"):
        Runs(NAMES, TIMES, 1, Losing(1, 2))(scenes)


def test_an_interrupt_drops_the_runs_that_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    class Interrupted(Executor):
        def __init__(self, *_: int) -> None:
            self.sent: list[Future[Any]] = []
            self.ended: dict[str, bool] = {}

        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            self.sent.append(Future())
            if len(self.sent) == 1:
                self.sent[0].set_exception(KeyboardInterrupt())
            return self.sent[-1]

        def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
            self.ended = {"at once": cancel_futures}

    pool = Interrupted()
    monkeypatch.setattr("wsph.study.fitting.runs.SPREAD_SECONDS", -1.0)
    monkeypatch.setattr("wsph.study.fitting.runs.Workers", lambda _: pool)
    with pytest.raises(KeyboardInterrupt), Runs(NAMES, TIMES, 2) as runs:
        runs([bar(8), bar(16)])
    assert [each.cancelled() for each in pool.sent] == [False, True]
    assert pool.ended == {"at once": True}
