"""Studies on a cluster's engine: the same rows, whatever becomes of a worker."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from tests.accuracy.test_elsewhere import same
from tests.accuracy.test_search import PROBE, TOML, vibrating
from tests.ranks.launch import MPIEXEC, command, environment, launched, needs_mpi
from wsph.accuracy.accurate import accurate
from wsph.accuracy.planning.watch import Due
from wsph.accuracy.running.elsewhere import _made, _versions
from wsph.accuracy.running.task import Lost
from wsph.cli import main
from wsph.study.cluster import _passed_on, executor_at
from wsph.study.fitting.curves import computed
from wsph.study.plan import Planned
from wsph.study.rows import make
from wsph.study.runs import run_study
from wsph.study.tables import Study, load_study

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


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of one of Dask, with two workers."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


def workers(scheduler: str) -> list[int]:
    """The processes of its workers, when there are two."""
    from distributed import Client

    with Client(scheduler, set_as_default=False) as client:
        client.wait_for_workers(2)
        return list(client.run(os.getpid).values())


@needs_dask
@pytest.mark.filterwarnings("default")
def test_a_worker_of_dask_is_killed_on_the_way(alone: Path, scheduler: str, tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(TEXT)
    study, scene = load_study(tmp_path / "study.toml")
    left: list[int] = []
    pids = workers(scheduler)

    def keep(place: int, made: object) -> None:
        left.append(place)
        if len(left) == 4:
            os.kill(pids[0], signal.SIGKILL)

    with executor_at(scheduler) as executor:
        outcome = run_study(study, scene, tmp_path, executor, keep=keep)
    assert not outcome.lost
    assert sorted(left) == list(range(32))
    for found, wanted in zip(json.loads(json.dumps(outcome.rows)), rows(alone), strict=True):
        assert {key: value for key, value in found.items() if key in wanted} == {
            key: wanted[key] for key in found if key in wanted
        }


@needs_dask
@pytest.mark.filterwarnings("default")
def test_a_search_goes_on_when_a_worker_of_dask_is_killed(scheduler: str, tmp_path: Path) -> None:
    alone = accurate(vibrating(), tmp_path / "alone", tolerance=0.001)
    pids = workers(scheduler)

    def kill() -> None:
        while len(list(tmp_path.glob("there/.row/tmp*"))) < 2:  # each worker at its first row
            time.sleep(0.005)
        os.kill(pids[0], signal.SIGKILL)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    with executor_at(scheduler) as executor:
        found = accurate(vibrating(), tmp_path / "there", tolerance=0.001, executor=executor)
    killer.join(1.0)
    assert not killer.is_alive()
    assert found.status == alone.status == "met"
    same(tmp_path / "alone", tmp_path / "there")
    (tmp_path / "bar.toml").write_text(TOML + PROBE)
    search = ["run", str(tmp_path / "bar.toml"), "--accuracy", "1%", "--check", "--quiet", "-o"]
    assert main([*search, str(tmp_path / "file"), "--scheduler", scheduler]) == 0
    assert main([*search, str(tmp_path / "one")]) == 0
    same(tmp_path / "one", tmp_path / "file")


def at_work(scheduler: str) -> int:
    """Tasks that its workers are at, whether or not anybody waits for them."""
    from distributed import Client

    with Client(scheduler, set_as_default=False) as client:
        return sum(client.run(lambda dask_worker: len(dask_worker.state.tasks)).values())


def wait_until(scheduler: str, count: int, seconds: float) -> None:
    end = time.monotonic() + seconds
    while (found := at_work(scheduler)) != count:
        assert time.monotonic() < end, f"{found} tasks after {seconds} s, not {count}"
        time.sleep(0.2)


ENDLESS = vibrating().with_(end=1e7)
CALLS = {
    "row": partial(make, Study(schema=1, scene=""), Path(), Planned("one", {}, ENDLESS), threads=1, alone=False),
    "fit": partial(computed, ["p.velocity_x"], np.array([0.0, 1.0]), ENDLESS),
    "search": partial(_made, ENDLESS, Due(), 0.0, None, _versions(ENDLESS)),
}


@needs_dask
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("call", CALLS)
def test_a_worker_of_dask_ends_what_nobody_waits_for(scheduler: str, call: str) -> None:
    workers(scheduler)
    with executor_at(scheduler) as executor:
        assert executor is not None
        future = executor.submit(CALLS[call])
        wait_until(scheduler, 1, 30.0)
        time.sleep(1.0)  # it is at its steps, or before them
        assert at_work(scheduler) == 1
        future.cancel()
        wait_until(scheduler, 0, 20.0)
        assert executor.submit(os.getpid).result(20.0)


@needs_dask
@pytest.mark.filterwarnings("default")
def test_an_interrupted_study_leaves_the_workers_of_dask_free(scheduler: str, tmp_path: Path) -> None:
    import tomli_w

    workers(scheduler)
    (tmp_path / "bar.toml").write_text(tomli_w.dumps(ENDLESS.data()))
    (tmp_path / "study.toml").write_text('schema = 1\nscene = "bar.toml"\n[grid]\n"run.cfl" = [0.3, 0.4, 0.5]\n')
    words = ["-m", "wsph", "study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out"), "--scheduler", scheduler]
    process = subprocess.Popen([sys.executable, *words], stderr=subprocess.PIPE, text=True, env=environment(), cwd=ROOT)
    try:
        wait_until(scheduler, 3, 60.0)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=30.0)[1]
    finally:
        process.kill()
    assert process.returncode == 130, said
    wait_until(scheduler, 0, 20.0)


def test_a_result_that_cannot_be_fetched_is_told_and_not_waited_for() -> None:
    class Gone:
        """A task of Dask whose scheduler is gone when its result is asked for."""

        status = "finished"

        def cancel(self) -> None: ...

        def release(self) -> None: ...

        def exception(self) -> None: ...

        def result(self) -> object:
            raise OSError("the connection was closed")

    future: Future[object] = Future()
    _passed_on(future, Gone())
    with pytest.raises(Lost, match="its result did not come: OSError: the connection was closed"):
        future.result(1.0)


@needs_dask
def test_where_no_scheduler_answers_it_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "study.toml").write_text(TEXT)
    words = ["study", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out"), "--scheduler", "nowhere"]
    assert main(words) == 2
    assert "no scheduler of Dask answers there" in capsys.readouterr().err
    (tmp_path / "bar.toml").write_text(TOML + PROBE)
    search = ["run", str(tmp_path / "bar.toml"), "--accuracy", "1%", "-o", str(tmp_path / "out")]
    assert main([*search, "--scheduler", "nowhere"]) == 2
    assert "no scheduler of Dask answers there" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


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


@needs_mpi
@pytest.mark.slow
def test_a_search_and_a_fit_by_workers_of_mpi(tmp_path: Path) -> None:
    (tmp_path / "bar.toml").write_text(TOML + PROBE)
    search = ["run", str(tmp_path / "bar.toml"), "--accuracy", "1%", "--check", "-o"]
    assert main([*search, str(tmp_path / "one")]) == 0
    futures = ("-m", "mpi4py.futures", "-m", "wsph")
    done = launched(3, *futures, *search, str(tmp_path / "out"), "--scheduler", "mpi", seconds=120.0)
    assert done.returncode == 0, done.stderr[-2000:]
    same(tmp_path / "one", tmp_path / "out")
    refused = launched(3, *futures, *search, str(tmp_path / "none"), seconds=120.0)
    assert refused.returncode == 2, refused.stderr[-2000:]
    assert "the processes of mpi4py.futures make rows and share no scene: give --scheduler mpi" in refused.stderr
    (tmp_path / "data.csv").write_text("time,p.velocity_x\n0.5,-1e-8\n1.0,-7e-7\n2.0,6.9e-7\n")
    free = ["--free", "bodies.0.material.youngs_modulus=0.9..1.1 Pa"]
    fit = ["calibrate", str(tmp_path / "bar.toml"), str(tmp_path / "data.csv"), *free, "-o"]
    assert main([*fit, str(tmp_path / "fit")]) == 0
    done = launched(3, *futures, *fit, str(tmp_path / "fit-there"), "--scheduler", "mpi", seconds=120.0)
    assert done.returncode == 0, done.stderr[-2000:]
    for name in ("calibration.json", "fit.csv"):
        assert (tmp_path / "fit" / name).read_bytes() == (tmp_path / "fit-there" / name).read_bytes()
