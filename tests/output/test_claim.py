"""Claims: one run at a time writes into a folder, and a killed one leaves no lock."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import wsph
from wsph.cli import main
from wsph.errors import OutputError
from wsph.output.claim import Claim
from wsph.output.files import LOCK

SCENE = Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml"
LONG = ["--set", "run.end=1000 s", "--set", "output.every=200", "--set", "checkpoint.every=150"]


def begun(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    """A long run in a process of its own, once it has written a checkpoint."""
    command = [sys.executable, "-m", "wsph.cli", "run", str(SCENE), "-o", str(folder), "--quiet", *arguments]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not list(folder.glob("checkpoints/checkpoint_*")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return process


def test_a_second_run_is_refused_while_the_first_lives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    first = begun(out, *LONG)
    try:
        for how in (["--overwrite"], ["--resume"], []):
            before = time.monotonic()
            assert main(["run", str(SCENE), "-o", str(out), *how]) == 2
            said = capsys.readouterr().err
            if how:
                assert f"error: {out}: is being written by process {first.pid}: wait for its end" in said
            else:
                assert "holds files already" in said
            assert time.monotonic() - before < 5.0
        with pytest.raises(OutputError, match=f"is being written by process {first.pid}"):
            wsph.run(SCENE, out, overwrite=True)
        study = tmp_path / "study.toml"
        study.write_text(f'schema = 1\nscene = "{SCENE}"\n')
        assert main(["study", str(study), "-o", str(out), "--overwrite"]) == 2
        assert "holds no study of wsph" in capsys.readouterr().err
    finally:
        first.send_signal(signal.SIGINT)
    assert first.wait(60) == 130
    assert json.loads((out / "summary.json").read_text())["status"] == "interrupted"
    assert not (out / LOCK).exists()
    assert main(["run", str(SCENE), "-o", str(out), "--overwrite", "--quiet"]) == 0


def test_a_killed_run_leaves_no_lock(tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = begun(out, *LONG)
    process.kill()
    process.wait()
    assert (out / LOCK).read_text().split()[0] == str(process.pid)
    longer = wsph.load(SCENE).with_(end="1000 s", output={"every": 10**6}, checkpoint={"every": 150})
    stop = lambda step, steps, time: signal.raise_signal(signal.SIGINT)  # noqa: E731
    result = wsph.run(longer, out, resume=True, throw=False, progress=stop)
    assert result.status == "interrupted"
    assert not (out / LOCK).exists()


def test_of_runs_that_begin_at_once_one_has_the_folder(tmp_path: Path) -> None:
    """Threads of one process, whose runs follow one another, and which all saw that there was no folder."""
    scene, found = wsph.load(SCENE).with_(end="1 ms"), list[str]()

    def one() -> None:
        try:
            found.append(wsph.run(scene, tmp_path / "out").status)
        except OutputError as error:
            found.append(str(error))

    threads = [threading.Thread(target=one) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found.count("completed") == 1
    assert all("holds files already" in each or "is being written by" in each for each in found if each != "completed")


def test_a_run_within_a_run_is_refused(tmp_path: Path) -> None:
    scene = wsph.load(SCENE)
    said: list[str] = []

    def again(step: int, steps: int, time: float) -> None:
        try:
            wsph.run(scene, tmp_path / "out", overwrite=True)
        except OutputError as error:
            said.append(str(error))

    wsph.run(scene, tmp_path / "out", progress=again)
    assert f"is being written by this process ({os.getpid()}) already" in said[0]


def test_what_holds_a_file_of_that_name_claims_nothing(tmp_path: Path) -> None:
    """A file that a killed process left behind, also an empty one, and a folder that is taken away in the meantime."""
    for content in ("", "1 elsewhere\n", "\0\0\n"):
        (tmp_path / LOCK).write_text(content)
        with Claim(tmp_path, overwrite=False):
            assert (tmp_path / LOCK).read_text().startswith(str(os.getpid()))
        assert not (tmp_path / LOCK).exists()
    folder = tmp_path / "gone"
    folder.mkdir()
    with Claim(folder, overwrite=False):
        (folder / LOCK).unlink()
        folder.rmdir()


def test_a_file_system_without_locks_is_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: int) -> None:
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr("wsph.output.claim.fcntl.flock", refuse)
    with (
        pytest.warns(RuntimeWarning, match=r"has no locks \(Function not implemented\): keep other runs out"),
        Claim(tmp_path, overwrite=False),
    ):
        pass
