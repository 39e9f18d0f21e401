"""Processes that make rows: each loses its own row at most, and any other executor will do."""

import os
import signal
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from wsph import load
from wsph.cli import main
from wsph.study.energy import EnergyMeter
from wsph.study.runs import run_study
from wsph.study.tables import Study
from wsph.study.workers import WorkerLost, Workers

BAR = Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml"
STUDY = {"schema": 1, "scene": "", "grid": {"bodies.0.spacing": [0.1, 0.05, 0.04, 0.02]}}


def die(number: int) -> int:
    """What the system does to a process where memory ends."""
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def refuse(number: int) -> int:
    """A task that fails by itself."""
    raise ValueError(f"not {number}")


def pid(number: int) -> int:
    """Who does it."""
    return os.getpid()


def hang(seconds: float) -> None:
    """A task that lasts."""
    time.sleep(seconds)


def test_a_process_that_is_killed_takes_its_own_task_along() -> None:
    with Workers(2) as pool:
        futures = [pool.submit(die, k) for k in range(5)]
        with pytest.raises(WorkerLost, match=r"was killed by signal 9, for lack of memory perhaps"):
            futures[1].result()
        assert [futures[k].result() for k in (0, 2, 3, 4)] == [0, 2, 3, 4]


def unlike(number: int) -> object:
    """A result that no process can hand on."""
    return lambda: number


def test_what_a_task_raises_is_its_result_and_its_process_lives() -> None:
    with Workers(1) as pool:
        before = pool.submit(pid, 0).result()
        with pytest.raises(ValueError, match="not 3"):
            pool.submit(refuse, 3).result()
        with pytest.raises(RuntimeError, match="cannot be carried between processes"):
            pool.submit(unlike, 3).result()
        assert pool.submit(pid, 0).result() == before != os.getpid()
    with pytest.raises(RuntimeError, match="sent home"):
        pool.submit(pid, 0)


def test_workers_that_are_ended_end_at_once() -> None:
    pool, started = Workers(1), time.perf_counter()
    first, second = pool.submit(hang, 60.0), pool.submit(hang, 60.0)
    while not first.running():
        time.sleep(0.01)
    time.sleep(0.5)
    pool.shutdown(cancel_futures=True)
    assert time.perf_counter() - started < 30.0
    assert isinstance(first.exception(), WorkerLost)
    assert second.cancelled()


class Losing(Executor):
    """An executor in this process that loses the tasks of some numbers."""

    def __init__(self, *lost: int):
        self.lost, self.count = lost, 0

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.count in self.lost:
            future.set_exception(WorkerLost("its process was killed by signal 9"))
        else:
            future.set_result(fn(*args, **kwargs))
        self.count += 1
        return future


def test_any_executor_makes_the_rows_and_a_lost_one_is_made_again(tmp_path: Path) -> None:
    study, scene = Study.model_validate(STUDY), load(BAR).with_(end="2 ms")
    outcome = run_study(study, scene, tmp_path, Losing(1, 2))
    assert sorted(outcome.made) == [0, 3]
    assert outcome.lost == dict.fromkeys((1, 2), "its process was killed by signal 9")
    assert {row["joules"] for row in outcome.rows} == {None}  # shared with whatever else runs
    made: list[int] = []
    with ThreadPoolExecutor(2) as pool:
        whole = run_study(study, scene, tmp_path, pool, known=outcome.made, keep=lambda place, _: made.append(place))
    assert sorted(made) == [1, 2]
    assert [row["particles"] for row in whole.rows] == [11, 21, 26, 51]
    assert not whole.lost


def test_the_command_says_which_row_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(f'schema = 1\nscene = "{BAR}"\nset = {{ "run.end" = "2 ms" }}\n[grid]\n"bodies.0.spacing" = [0.1, 0.05, 0.04, 0.02]\n')  # fmt: skip
    monkeypatch.setattr("wsph.study.runs.SPREAD_SECONDS", 0.0)
    monkeypatch.setattr("wsph.study.runs.Workers", lambda *_: Losing(1))
    assert main(["study", str(path), "-o", str(out), "--workers", "2"]) == 1
    said = capsys.readouterr()
    assert (
        "error: row 'scene: bodies.0.spacing = 0.04' is lost: its process was killed by signal 9; --resume makes it"
        in said.err
    )
    assert "3 runs; study.csv, study.json" in said.out
    assert main(["study", str(path), "-o", str(out), "--workers", "2", "--resume"]) == 0
    assert "4 runs; study.csv, study.json" in capsys.readouterr().out


def packages(root: Path, *values: int) -> None:
    """What Linux tells of processor packages, and of a part of the first."""
    for name, value in [*((f"intel-rapl:{k}", value) for k, value in enumerate(values)), ("intel-rapl:0:0", 7)]:
        folder = root / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "energy_uj").write_text(f"{value}\n")
        (folder / "max_energy_range_uj").write_text("1000000000\n")


def test_joules_where_the_machine_tells(tmp_path: Path) -> None:
    assert EnergyMeter(tmp_path / "none").joules is None
    packages(tmp_path, 5_000_000, 999_000_000)
    meter = EnergyMeter(tmp_path)
    assert meter.joules == 0.0
    packages(tmp_path, 8_000_000, 2_000_000)  # the second has begun anew
    assert meter.joules == pytest.approx(3.0 + 3.0)
    (tmp_path / "intel-rapl:1" / "energy_uj").write_text("")
    assert meter.joules is None
