"""Searches for an accuracy whose rows processes share: the answer, and its folder, are those of one process."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.accuracy.test_search import PROBE, TOML
from tests.ranks.launch import launched, needs_mpi
from tests.ranks.test_endings import errors

SEARCH = """
import sys
from wsph.accuracy.running import together
from wsph.cli import main
together.LEAST, end = 800, together.Together.end
def said(self):
    print("shared", self.shared)
    end(self)
together.Together.end = said
sys.exit(main(sys.argv[1:]))
"""


def answer(folder: Path) -> dict[str, Any]:
    """What accuracy.json says, without times."""
    data = json.loads((folder / "accuracy.json").read_text())
    for each in (data, *data["rows"]):
        for key in [key for key in each if "second" in key]:
            del each[key]
    return data


EVERYWHERE = """
[[probes]]
name = "p"
where = "x > -1"
fields = ["velocity"]
reduce = "mean"
every = 1
"""
"""What no process can read by itself."""


@needs_mpi
@pytest.mark.parametrize(
    ("probe", "rows", "options"),
    [
        (PROBE, 1, ()),
        pytest.param(EVERYWHERE, 0, (), marks=pytest.mark.slow),
        pytest.param(PROBE, 2, ("--check",), marks=pytest.mark.slow),
    ],
)
def test_rows_that_are_shared_give_the_answer_of_one_process(
    probe: str, rows: int, options: tuple[str, ...], tmp_path: Path
) -> None:
    path = tmp_path / "bar.toml"
    path.write_text(TOML.replace("end = 2.5", "end = 0.5") + probe)
    for count, shared in ((1, 0), (2, rows)):
        arguments = ("run", str(path), "-o", str(tmp_path / str(count)), "--budget", "3e7", *options)
        done = launched(count, "-c", SEARCH, *arguments, seconds=120.0)
        assert done.returncode == 0, done.stderr
        assert f"shared {shared}\n" in done.stdout
    alone, parts = tmp_path / "1", tmp_path / "2"
    assert answer(alone) == answer(parts)
    files = [each.relative_to(alone) for each in alone.rglob("*") if each.is_file()]
    assert {str(each) for each in files} >= {"history.csv", "frames.pvd", "frames/frame_000001.vtu", "probes/p.csv"}
    for each in files:
        if each.suffix != ".json":
            assert (alone / each).read_bytes() == (parts / each).read_bytes(), each


@needs_mpi
@pytest.mark.parametrize(
    ("key", "words"),
    [
        ('run.integrator="tsph"', "run.formulation: the small-strain form of two sets is for one process"),
        ("run.dim=7", "run.dim"),
    ],
)
def test_what_cannot_be_shared_is_refused_before_the_first_row(tmp_path: Path, key: str, words: str) -> None:
    path = tmp_path / "bar.toml"
    path.write_text(TOML + PROBE)
    arguments = ("run", str(path), "-o", str(tmp_path / "out"), "--accuracy", "1%", "--set", key)
    done = launched(2, "-m", "wsph", *arguments, seconds=60.0)
    assert done.returncode == 2
    assert len(errors(done.stderr)) == 1
    assert words in done.stderr
    assert not (tmp_path / "out").exists()


ENOUGH = """
import warnings, wsph
from mpi4py import MPI
from tests.ranks.shared_cases import scene
from wsph.ranks.mpi import Ranks
warnings.simplefilter("ignore")
comm, asked = MPI.COMM_WORLD, []
def enough():
    asked.append(0)
    return len(asked) > 5
made = scene(1, probes=[], run={"end": 1e6})
found = wsph.run(made, domain=Ranks(comm), throw=False, enough=enough if comm.rank == 0 else None)
assert found.status == "interrupted" and found.summary["steps"] > 0
assert len(set(comm.allgather(found.summary["steps"]))) == 1
"""


@needs_mpi
def test_one_process_that_has_had_enough_ends_all() -> None:
    done = launched(2, "-c", ENOUGH, seconds=60.0)
    assert done.returncode == 0, done.stderr[-3000:]
