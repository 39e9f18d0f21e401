"""Searches whose rows are run by an executor: the answer and the folder of one process, whatever becomes of a worker."""

import json
import multiprocessing
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import wsph
from tests.accuracy.test_search import PROBE, TOML, vibrating
from wsph.accuracy.accurate import accurate
from wsph.accuracy.limits import Limit
from wsph.accuracy.running import elsewhere
from wsph.accuracy.running.elsewhere import Elsewhere
from wsph.accuracy.running.order import Order
from wsph.accuracy.running.task import Lost
from wsph.cli import main


def timeless(data: Any) -> Any:
    """What accuracy.json or summary.json say, without times of this machine."""
    if isinstance(data, dict):
        return {key: timeless(each) for key, each in data.items() if "second" not in key}
    return [timeless(each) for each in data] if isinstance(data, list) else data


def same(one: Path, other: Path) -> None:
    """Whether two folders hold the same files, byte for byte but for seconds."""
    files = sorted(each.relative_to(one) for each in one.rglob("*") if each.is_file())
    assert files == sorted(each.relative_to(other) for each in other.rglob("*") if each.is_file())
    assert {str(each) for each in files} >= {"accuracy.json", "summary.json", "frames/frame_000001.vtu", "probes/p.csv"}
    for each in files:
        if each.suffix == ".json":
            assert timeless(json.loads((one / each).read_text())) == timeless(json.loads((other / each).read_text()))
        else:
            assert (one / each).read_bytes() == (other / each).read_bytes(), each


class Inside(Executor):
    """Runs tasks in this process when their results are asked for: all that wait then, the last first. `before` is told the
    number of the task that is about to run, and may raise for it."""

    def __init__(self, before: Callable[[int], object] = lambda _: None):
        self.before, self.count = before, 0
        self.waiting: list[Asked] = []
        self.together: list[int] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.waiting.append(Asked(self, lambda: fn(*args, **kwargs)))
        return self.waiting[-1]

    def run(self) -> None:
        self.together.append(len(self.waiting))
        while self.waiting:
            future = self.waiting.pop()
            self.count += 1
            if not future.set_running_or_notify_cancel():
                continue
            try:
                self.before(self.count)
                future.set_result(future.call())
            except Exception as error:
                future.set_exception(error)


class Asked(Future[Any]):
    def __init__(self, executor: Inside, call: Callable[[], object]):
        super().__init__()
        self.executor, self.call = executor, call

    def result(self, timeout: float | None = None) -> Any:
        if not self.done():
            self.executor.run()
        return super().result(timeout)


def test_rows_of_other_processes_give_the_answer_of_one(tmp_path: Path) -> None:
    scene = vibrating(output={"every": 1.0})
    alone = accurate(scene, tmp_path / "alone", tolerance=0.001, check=True)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        found = accurate(scene, tmp_path / "there", tolerance=0.001, check=True, executor=pool)
    assert found.status == alone.status == "met"
    assert "agrees within the bars" in found.why
    same(tmp_path / "alone", tmp_path / "there")
    assert not (tmp_path / "there" / ".row").exists()
    assert found.result is not None
    assert alone.result is not None
    for name, values in alone.result.particles.items():
        assert values.tobytes() == found.result.particles[name].tobytes(), name
    assert all(row["wall_seconds"] > 0.0 for row in found.data["rows"])


def test_the_first_rows_and_those_of_another_scheme_are_run_together_in_any_order(tmp_path: Path) -> None:
    alone = accurate(vibrating(), tmp_path / "alone", tolerance=0.01, check=True)
    pool = Inside()
    accurate(vibrating(), tmp_path / "there", tolerance=0.01, check=True, executor=pool)
    assert pool.together == [3, *[1] * (len(alone.data["rows"]) - 3), 3]
    same(tmp_path / "alone", tmp_path / "there")


def test_a_budget_of_work_buys_the_same_rows(tmp_path: Path) -> None:
    alone = accurate(vibrating(), tmp_path / "alone", limit=Limit(None, 1e6))
    pool = Inside()
    accurate(vibrating(), tmp_path / "there", limit=Limit(None, 1e6), executor=pool)
    assert pool.together == [1] * len(alone.data["rows"])  # what each is to be follows from those before
    same(tmp_path / "alone", tmp_path / "there")


def test_rows_that_a_limit_does_not_pay_for_are_not_begun(tmp_path: Path) -> None:
    first, second = (row["work"] for row in accurate(vibrating(), tolerance=0.01).data["rows"][:2])
    pool, limit = Inside(), Limit(None, 1.1 * (first + second))
    alone = accurate(vibrating(), tolerance=0.01, limit=limit)
    found = accurate(vibrating(), tolerance=0.01, limit=limit, executor=pool)
    assert pool.together == [2]
    assert found.status == "out of reach"
    assert timeless(found.data) == timeless(alone.data)


def test_a_row_whose_worker_is_lost_is_run_again(tmp_path: Path) -> None:
    def lose(number: int) -> None:
        if number in (1, 5):  # of the first three the last, and the one after them
            raise BrokenExecutor("its process was killed by signal 9")

    alone = accurate(vibrating(), tmp_path / "alone", tolerance=0.001)
    accurate(vibrating(), tmp_path / "there", tolerance=0.001, executor=Inside(lose))
    same(tmp_path / "alone", tmp_path / "there")
    assert alone.status == "met"


@pytest.mark.parametrize(("error", "tries"), [(BrokenExecutor("killed"), 2), (Lost("killed four times"), 1)])
def test_a_row_that_is_lost_every_time_ends_a_search_with_the_best(error: Exception, tries: int, tmp_path: Path) -> None:  # fmt: skip
    tried: list[int] = []

    def lose(number: int) -> None:
        if number > 3:
            tried.append(number)
            raise error

    found = accurate(vibrating(), tmp_path / "out", tolerance=0.001, executor=Inside(lose))
    assert found.status == "refused"
    assert len(tried) == tries
    assert f"cells is lost: {error}" in found.why
    assert len(found.data["rows"]) == 3
    assert found.data["chosen"] == found.data["rows"][-1]["cells"]
    assert (tmp_path / "out" / "accuracy.json").is_file()


def test_a_worker_that_does_not_see_the_folder_says_so_and_nothing_is_left(tmp_path: Path) -> None:
    def other(number: int) -> None:
        for word in tmp_path.glob("out/.row/*.search"):
            word.unlink()

    with pytest.raises(
        wsph.OutputError, match=r"out: a worker on .* does not see it.*choose with -o a folder that all"
    ):
        accurate(vibrating(), tmp_path / "out", tolerance=0.01, executor=Inside(other))
    assert not (tmp_path / "out").exists()
    assert accurate(vibrating(), tolerance=0.01, executor=Inside(other)).status == "met"


def test_a_worker_of_another_version_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def newer(number: int) -> None:
        monkeypatch.setattr(elsewhere, "plugins_of", lambda scene: {"integrator leapfrog": "somebody's 2.0"})

    with pytest.raises(wsph.Refused, match=r"a worker on .* has integrator leapfrog somebody's 2.0, the search wsph"):
        accurate(vibrating(), tolerance=0.01, executor=Inside(newer))


@pytest.mark.parametrize("options", [{"tolerance": 0.001}, {"limit": Limit(None, 1e7)}])
def test_a_worker_of_another_version_on_the_way_ends_a_search_with_the_best(
    options: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And is not taken for a lattice that is refused, which a budget would call the finest that it pays for."""

    def newer(number: int) -> None:
        if number > 3:
            monkeypatch.setattr(elsewhere, "plugins_of", lambda scene: {"integrator leapfrog": "somebody's 2.0"})

    found = accurate(vibrating(), tmp_path / "out", **options, executor=Inside(newer))
    assert found.status == "refused"
    assert "somebody's 2.0" in found.why
    assert found.data["chosen"] == found.data["rows"][-1]["cells"]
    assert (tmp_path / "out" / "accuracy.json").is_file()


def test_a_worker_that_cannot_run_rows_of_a_check_leaves_the_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = len(accurate(vibrating(), tolerance=0.01).data["rows"])

    def newer(number: int) -> None:
        if number > rows:
            monkeypatch.setattr(elsewhere, "plugins_of", lambda scene: {"integrator leapfrog": "somebody's 2.0"})

    found = accurate(vibrating(), tmp_path / "out", tolerance=0.01, check=True, executor=Inside(newer))
    assert found.status == "met"
    assert "another scheme was asked: a worker on" in json.dumps(found.data)
    assert (tmp_path / "out" / "accuracy.json").is_file()


def test_seconds_end_a_search_that_no_worker_takes_up(monkeypatch: pytest.MonkeyPatch) -> None:
    class Nobody(Executor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            return Future()

    monkeypatch.setattr(elsewhere, "GRACE", 0.1)
    started = time.perf_counter()
    found = accurate(vibrating(), tolerance=0.01, limit=Limit(1.0), executor=Nobody())
    assert time.perf_counter() - started < 5.0
    assert found.status == "refused"
    assert "no worker was done with it in the time that there is" in found.why


def test_rows_that_run_already_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever they are thought to take after the first is known: they end by themselves where they are late."""
    limit = Limit(60.0)

    def cost(self: Limit, rows: Any, plan: Any, *, composed: bool = False) -> float:
        return 100.0 if rows.made and len(rows.made) < 3 else 0.0

    monkeypatch.setattr(Limit, "cost", cost)
    found = accurate(vibrating(), tolerance=0.05, limit=limit, executor=Inside())
    assert found.status == "met"
    assert accurate(vibrating(), tolerance=0.05, limit=limit).status == "out of reach"


def test_a_row_that_is_set_up_when_the_search_has_ended_leaves_nothing(tmp_path: Path) -> None:
    class Later(Inside):
        """Has its tasks done when all is over."""

        def run(self) -> None:
            raise KeyboardInterrupt

    pool = Later()
    found = accurate(vibrating(), tmp_path / "out", tolerance=0.01, executor=pool)
    assert found.status == "interrupted"
    for each in pool.waiting:
        with pytest.raises((BrokenExecutor, wsph.OutputError)):
            each.call()
    assert not (tmp_path / "out").exists()


def test_an_interrupt_keeps_the_best_row_and_drops_what_has_been_sent(tmp_path: Path) -> None:
    """In the middle of the first three, of which the first to be asked for is the coarsest."""

    class Halfway(Inside):
        def run(self) -> None:
            self.before(self.count)
            future = self.waiting.pop(0)
            future.set_running_or_notify_cancel()
            self.count += 1
            future.set_result(future.call())

    def interrupt(number: int) -> None:
        if number == 1:
            raise KeyboardInterrupt

    pool = Halfway(interrupt)
    found = accurate(vibrating(), tmp_path / "out", tolerance=0.01, executor=pool)
    assert found.status == "interrupted"
    assert len(found.data["rows"]) == 1
    assert [each.cancelled() for each in pool.waiting] == [True, True]
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "completed"
    assert not (tmp_path / "out" / ".row").exists()


def test_a_row_that_nobody_waits_for_ends_where_it_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wsph.accuracy.running.wanted.LOOK_SECONDS", 0.05)
    begun, ended = threading.Event(), list[wsph.Result]()

    def started(*arguments: Any, **keys: Any) -> wsph.Result:
        begun.set()
        ended.append(wsph.run(*arguments, **keys))
        return ended[0]

    monkeypatch.setattr(elsewhere, "run", started)
    (tmp_path / ".row").mkdir()
    with ThreadPoolExecutor(1) as pool:
        runner = Elsewhere(pool)
        scene = vibrating().with_(end=1e5)
        runner.ahead([Order(scene, tmp_path / ".row" / "row", Limit(None, 1e9).due, time.perf_counter())])
        assert begun.wait(60.0)
        runner.end()
    assert ended[0].status == "interrupted"


def test_seconds_end_a_row_where_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    # All rows are thought to take no time, so that the search goes for what it cannot pay.
    monkeypatch.setattr(Limit, "cost", lambda self, rows, plan, *, composed=False: 1e-10 * plan.work)
    said: list[str] = []
    with ThreadPoolExecutor(2) as pool:
        found = accurate(vibrating(), limit=Limit(2.0), tell=said.append, executor=pool)
    assert found.result is not None
    assert found.result.status == "completed"
    assert any("was ended" in each for each in said)


class Several:
    rank, size = 0, 2


def test_what_does_not_go_together_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(wsph.Refused, match="a domain or an executor, not both"):
        accurate(vibrating(), tolerance=0.01, domain=Several(), executor=Inside())
    (tmp_path / "bar.toml").write_text(TOML + PROBE)
    asked = ["run", str(tmp_path / "bar.toml"), "-o", str(tmp_path / "out"), "--scheduler", "mpi"]
    assert main(asked) == 2
    assert "--scheduler goes with --accuracy or --budget" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
