"""Studies on a cluster's engine: the same rows, whatever becomes of a worker."""

import json
import os
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.ranks.launch import MPIEXEC, command, environment, needs_mpi
from wsph.cli import main
from wsph.study.cluster import executor_at
from wsph.study.runs import run_study
from wsph.study.tables import load_study

ROOT = Path(__file__).resolve().parents[2]
TIMES = {"seconds", "cpu_seconds", "wall_seconds", "joules"}
"""Columns that are not the same twice."""

VALUES = ", ".join(f"{0.30 + 0.02 * k:.2f}" for k in range(32))
TEXT = f"""
schema = 1
title = "many"
scene = "{ROOT / "examples" / "shock_bar.toml"}"
[grid]
"run.cfl" = [{VALUES}]
[[variants]]
name = "one"
[oracle]
probe = "fixed-end"
column = "stress_xx"
exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"
norm = 1
"""

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs wsph[cluster]")


def rows(folder: Path) -> list[dict[str, object]]:
    found = json.loads((folder / "study.json").read_text())["rows"]
    return [{key: value for key, value in row.items() if key not in TIMES} for row in found]


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The study by one process."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "study.toml").write_text(TEXT)
    assert main(["study", str(folder / "study.toml"), "-o", str(folder / "out"), "--workers", "1"]) == 0
    return folder / "out"


@needs_dask
@pytest.mark.filterwarnings("default")
def test_a_worker_of_dask_is_killed_on_the_way(alone: Path, tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    (tmp_path / "study.toml").write_text(TEXT)
    study, scene = load_study(tmp_path / "study.toml")
    left: list[int] = []
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            pids = list(client.run(os.getpid).values())
        assert len(pids) == 2

        def keep(place: int, made: object) -> None:
            left.append(place)
            if len(left) == 4:
                os.kill(pids[0], signal.SIGKILL)

        with executor_at(cluster.scheduler_address) as executor:
            outcome = run_study(study, scene, tmp_path, executor, keep=keep)
    assert not outcome.lost
    assert sorted(left) == list(range(32))
    for found, wanted in zip(json.loads(json.dumps(outcome.rows)), rows(alone), strict=True):
        assert {key: value for key, value in found.items() if key in wanted} == {
            key: wanted[key] for key in found if key in wanted
        }


@needs_dask
def test_where_no_scheduler_answers_it_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "study.toml").write_text(TEXT)
    words = ["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out"), "--scheduler", "nowhere"]
    assert main(words) == 2
    assert "no scheduler of Dask answers there" in capsys.readouterr().err


@needs_mpi
def test_rows_by_workers_of_mpi(alone: Path, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TEXT)
    assert MPIEXEC
    words = ["-m", "mpi4py.futures", "-m", "wsph", "study", str(tmp_path / "study.toml"), "--scheduler", "mpi"]
    done = subprocess.run(
        command(3, *words, "-o", str(tmp_path / "out")),
        capture_output=True,
        text=True,
        timeout=240,
        env=environment(),
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert rows(tmp_path / "out") == rows(alone)
    assert sys.executable in command(1)
