"""How far a run is, where there is no terminal; and output that nobody reads."""

import subprocess
import sys
from pathlib import Path

import pytest

import wsph
from wsph.cli import main
from wsph.cli.progress import Heartbeat, duration

SCENE = Path(__file__).resolve().parents[2] / "examples" / "shock_bar.toml"


def test_a_line_now_and_then_says_how_far_it_is_and_when_it_will_be_done(capsys: pytest.CaptureFixture[str]) -> None:
    clock = iter([0.0, 10.0, 40.0, 50.0, 100.0])
    beat = Heartbeat(30.0, lambda: next(clock))
    for step in (100, 400, 500, 1000):
        beat(step, 4000, 1e-6 * step)
    # From step 100 at 10 s to step 400 at 40 s: 10 steps a second, 3600 left; to step 1000 at 100 s the same.
    assert capsys.readouterr().err.splitlines() == [
        "step 400 of 4000 (10 %), t = 0.0004 s, 6 min 0 s left",
        "step 1000 of 4000 (25 %), t = 0.001 s, 5 min 0 s left",
    ]


def test_a_run_that_is_resumed_is_paced_by_its_own_steps(capsys: pytest.CaptureFixture[str]) -> None:
    clock = iter([0.0, 0.0, 60.0])
    beat = Heartbeat(30.0, lambda: next(clock))
    beat(3000, 4000, 3.0)
    beat(3500, 4000, 3.5)
    assert capsys.readouterr().err == "step 3500 of 4000 (88 %), t = 3.5 s, 1 min 0 s left\n"


@pytest.mark.parametrize(
    ("seconds", "words"), [(0.2, "0 s"), (59.6, "1 min 0 s"), (4805.0, "1 h 20 min"), (90000.0, "1 d 1 h")]
)
def test_durations_have_two_units(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_a_closed_pipe_is_no_error() -> None:
    command = f"{sys.executable} -m wsph schema | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (141, "{\n", "")


def test_a_run_goes_on_where_nobody_reads_its_warnings(tmp_path: Path) -> None:
    """Beyond the limit with guard = "warn": a warning before the run, on a closed standard error."""
    command = f"{sys.executable} -m wsph run {SCENE} -o {tmp_path}/out --set cfl=1.001 --set run.guard=warn 2>&-"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "completed" in done.stdout


def test_a_folder_that_can_be_gone_on_with_is_refused_with_the_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    wsph.run(wsph.load(SCENE), out)
    assert main(["run", str(SCENE), "-o", str(out)]) == 2
    assert "holds files already; choose another folder with -o, or give --overwrite" in capsys.readouterr().err
    wsph.run(wsph.load(SCENE).with_(**{"checkpoint.final": True}), out, overwrite=True)
    assert main(["run", str(SCENE), "-o", str(out)]) == 2
    assert "go on from what it holds with --resume, choose another" in capsys.readouterr().err


def test_cuda_is_the_first_gpu_or_refused_with_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    import warp as wp

    if wp.is_cuda_available():
        pytest.skip("has a GPU")
    assert main(["check", str(SCENE), "--set", "run.device=cuda"]) == 2
    assert "there is no 'cuda' on this machine; there is cpu; \"auto\" takes a GPU" in capsys.readouterr().err
