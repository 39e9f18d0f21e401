"""The command line: exit codes, messages without traceback, nothing compiled or written for bad input."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wsph.cli import main

ROOT = Path(__file__).resolve().parents[1]
SCENE = ROOT / "examples" / "shock_bar.toml"


def wsph(
    *arguments: str | Path, cwd: Path | None = None, cache: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    environment = {**os.environ, **({"WARP_CACHE_PATH": str(cache)} if cache else {})}
    return subprocess.run(
        [sys.executable, "-m", "wsph.cli", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        env=environment,
    )


def test_run_check_and_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(SCENE), "-o", str(tmp_path / "out"), "--set", "cfl=0.5"]) == 0
    assert "completed: 400 steps" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["scene"]["run"]["cfl"] == 0.5
    assert main(["run", str(SCENE), "-o", str(tmp_path / "quiet"), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert main(["check", str(SCENE)]) == 0
    text = capsys.readouterr().out
    for words in (
        "elastic (wsph ",
        "101, 400 pairs",
        "Courant number 1, limit 1.000",
        "tsph (wsph ",
        "5e-05 s, 200 steps",
        "half_step, impose, rate",
        "bytes per particle",
    ):
        assert words in text, words
    assert main(["list", "materials", "--json"]) == 0
    assert {"elastic", "perzyna"} <= {row["name"] for row in json.loads(capsys.readouterr().out)}


def test_an_unstable_run_exits_3_and_keeps_its_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "run",
        str(SCENE),
        "-o",
        str(tmp_path / "out"),
        "--set",
        "cfl=1.2",
        "--set",
        "run.guard=off",
        "--set",
        "run.end=50 ms",
    ]
    assert main(arguments) == 3
    assert "error: found unstable at step" in capsys.readouterr().err
    assert (tmp_path / "out" / "frames.pvd").exists()


BAD = {
    "unknown model": (["--set", "bodies.0.material.model=elastc"], "bodies.0.material.model: no entry named 'elastc'"),
    "misspelt key": (["--set", "bodies.0.spcing=0.01"], "bodies.0.spcing: unknown key; did you mean 'spacing'?"),
    "negative density": (
        ["--set", "bodies.0.material.density=-1"],
        "bodies.0.material.density: -1 must be above 0 kg/m3",
    ),
    "beyond the limit": (["--set", "cfl=1.01"], "limit 1.000"),
    "bad override": (["--set", "cfl"], "--set cfl: write it as KEY=VALUE"),
}


@pytest.mark.parametrize("case", list(BAD))
def test_bad_input_exits_2_with_one_message_and_writes_nothing(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, message = BAD[case]
    assert main(["run", str(SCENE), "-o", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_bad_input_compiles_no_kernel(tmp_path: Path) -> None:
    both = tmp_path / "both.toml"
    line = SCENE.read_text().splitlines().index("[run]") + 1
    both.write_text(SCENE.read_text().replace("cfl = 1.0", 'cfl = 1.0\ndt = "1 us"'))
    cases = [
        (["run", both], f"line {line}: run: exactly one of cfl and dt is needed: both are given"),
        (["run", SCENE, "--set", "bodies.0.material.model=elastc"], "no entry named 'elastc'"),
        (["run", tmp_path / "missing.toml"], "no such file"),
        (["run", SCENE, "-o", "/dev/null/out"], "/dev/null/out"),
        (["check", SCENE, "--set", "bodies.0.material.density=-1"], "must be above 0"),
    ]
    for arguments, message in cases:
        done = wsph(*arguments, cwd=tmp_path, cache=tmp_path / "cache")
        assert done.returncode == 2, done.stderr
        assert message in done.stderr
        assert "Traceback" not in done.stderr
        assert not list((tmp_path / "cache").rglob("*.o"))
        assert sorted(p.name for p in tmp_path.iterdir() if p.name != "cache") == ["both.toml"]


def test_the_output_is_quiet_in_a_log(tmp_path: Path) -> None:
    done = wsph("run", SCENE, "-o", tmp_path / "out")
    assert done.returncode == 0
    assert done.stdout.count("\n") == 1
    assert "\x1b" not in done.stdout + done.stderr
    assert done.stderr == ""
