"""How processes that share a scene end: together, soon, with one message, whatever has met one of them."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.ranks.launch import ROOT, command, environment, launched, needs_mpi
from tests.ranks.shared_cases import scene

SOON = 10.0
"""Time in which all have to have ended [s]."""


def written(tmp_path: Path, dim: int = 1, **changes: object) -> Path:
    import tomli_w

    path = tmp_path / "bar.toml"
    data = scene(dim, **{"probes": [], **changes}).data()
    path.write_text(tomli_w.dumps(data))
    return path


def errors(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("error:")]


@needs_mpi
def test_what_cannot_be_shared_is_refused_by_name_before_anything_is_written(tmp_path: Path) -> None:
    path = written(tmp_path, form="total-lagrangian", run={"correction": "paper"})
    done = launched(2, "-m", "wsph", "run", str(path), "-o", str(tmp_path / "out"))
    assert done.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert "run.correction: the correction of the paper is for one process" in done.stderr
    assert not (tmp_path / "out").exists()


PART = {
    "periodic": (
        {"boundary": [{"body": "b", "face": "-x", "periodic": "+x"}]},
        "boundary.2.periodic: the velocity x is prescribed at one side of it and not alike at the other",
    ),
}


@needs_mpi
@pytest.mark.parametrize("name", PART)
def test_what_cannot_be_had_in_parts_is_refused_by_name(tmp_path: Path, name: str) -> None:
    changes, said = PART[name]
    done = launched(2, "-m", "wsph", "run", str(written(tmp_path, **changes)), "-o", str(tmp_path / "out"))  # type: ignore[arg-type]
    assert done.returncode == 2, done.stderr
    assert len(errors(done.stderr)) == 1
    assert said in done.stderr
    assert not (tmp_path / "out").exists()


@needs_mpi
@pytest.mark.parametrize(("of", "field"), [("root", "torque"), ("rot", "force")])
def test_numbers_that_are_not_there_are_refused_as_in_one_process(tmp_path: Path, of: str, field: str) -> None:
    probes = f'probes=[{{name = "p", of = "{of}", fields = ["{field}"], every = 4}}]'
    command = ("-m", "wsph", "run", str(written(tmp_path)), "-o", str(tmp_path / "out"), "--set", probes)
    alone, done = (launched(count, *command) for count in (1, 2))
    assert done.returncode == alone.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert errors(done.stderr) == errors(alone.stderr)


@needs_mpi
def test_a_state_that_is_not_finite_ends_all_with_one_message(tmp_path: Path) -> None:
    path = written(tmp_path, run={"dt": 4.0, "end": 4000.0, "guard": "off"}, stop={"energy": 1e300})
    began = time.monotonic()
    done = launched(3, "-m", "wsph", "run", str(path), "-o", str(tmp_path / "out"))
    assert done.returncode == 3
    assert len(errors(done.stderr)) == 1
    assert "found unstable" in done.stderr
    alone = launched(1, "-m", "wsph", "run", str(path), "-o", str(tmp_path / "alone"))
    assert errors(alone.stderr) == errors(done.stderr)
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "unstable"
    assert time.monotonic() - began < 200.0


def started(path: Path, out: Path) -> subprocess.Popen[str]:
    arguments = command(3, "-m", "wsph", "run", str(path), "-o", str(out))
    return subprocess.Popen(
        arguments, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment(), cwd=ROOT
    )


def wait_for(pattern: str, folder: Path, seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not list(folder.glob(pattern)):
        assert time.monotonic() < end, f"no {pattern} in {seconds} s"
        time.sleep(0.05)


def ranks_of(process: subprocess.Popen[str]) -> list[int]:
    """The processes that mpiexec has started, in their order."""
    found: list[tuple[int, int]] = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            variables = (entry / "environ").read_bytes().split(b"\0")
            parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError, ValueError):
            continue
        rank = [each for each in variables if each.startswith(b"OMPI_COMM_WORLD_RANK=")]
        if rank and parent == process.pid:
            found.append((int(rank[0].partition(b"=")[2]), int(entry.name)))
    return [pid for _, pid in sorted(found)]


ENDLESS = {"run": {"end": 1e6}, "checkpoint": {"every": 20, "final": True}}


@needs_mpi
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds processes in /proc")
@pytest.mark.parametrize(
    ("number", "rank", "code"), [(signal.SIGKILL, 1, None), (signal.SIGTERM, 1, 130), (signal.SIGUSR1, None, 130)]
)
def test_a_process_that_is_killed_or_asked_to_end_ends_all(
    tmp_path: Path, number: int, rank: int | None, code: int | None
) -> None:
    out = tmp_path / "out"
    process = started(written(tmp_path, **ENDLESS), out)
    try:
        wait_for("checkpoints/checkpoint_????????????.npz", out)
        ranks = ranks_of(process)
        assert len(ranks) == 3
        os.kill(process.pid if rank is None else ranks[rank], number)
        said = process.communicate(timeout=SOON)[1]
    finally:
        process.kill()
    assert process.returncode != 0
    if code is not None:
        assert process.returncode == code, said
    again = written(tmp_path, run={"end": 1e6}, checkpoint={"every": 20, "final": True})
    last = max(int(path.stem.partition("_")[2]) for path in (out / "checkpoints").glob("checkpoint_????????????.npz"))
    end = str(0.2 * (last + 5))
    done = launched(2, "-m", "wsph", "run", str(again), "-o", str(out), "--resume", "--set", f"run.end={end}")
    assert done.returncode == 0, done.stderr
    assert json.loads((out / "summary.json").read_text())["steps"] >= last + 5


ELSEWHERE = """
import os, sys
from wsph.cli import main
from wsph.ranks import world
if world.domain().rank == 1:
    os.chdir("tests/ranks")
sys.exit(main(sys.argv[1:]))
"""


@needs_mpi
def test_a_scene_that_one_process_cannot_read_ends_all(tmp_path: Path) -> None:
    near = os.path.relpath(written(tmp_path), ROOT)
    done = launched(2, "-c", ELSEWHERE, "run", near, "-o", str(tmp_path / "out"), seconds=60.0)
    assert done.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert f"error: {near}: no such file" in done.stderr
    assert not (tmp_path / "out").exists()


FULL = """
import resource, signal, sys
from wsph.cli import main
from wsph.ranks import world
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
if world.domain().rank == 1:
    resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))
sys.exit(main(sys.argv[1:]))
"""


@needs_mpi
def test_a_process_without_disk_ends_all(tmp_path: Path) -> None:
    out, path = tmp_path / "out", written(tmp_path, **ENDLESS)
    done = launched(3, "-c", FULL, "run", str(path), "-o", str(out))
    assert done.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert "cannot be written: File too large" in done.stderr
