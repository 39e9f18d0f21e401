"""A format of frames is one file, `csv_frames.py`, and one line of `wsph.output.formats.FORMATS`."""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import wsph
from tests.extensions.csv_frames import Csv
from tests.extensions.untouched import knowing
from tests.scenes import block
from wsph.errors import SceneError
from wsph.output.formats import FORMATS


@pytest.fixture
def line() -> Iterator[None]:
    """The line of the table, for one test."""
    added = Csv()
    FORMATS.append(added)
    yield
    FORMATS.remove(added)


def spun(**output: object) -> wsph.Scene:
    """A block of few cells that turns."""
    tables = {"output": {"every": 2, "fields": ["velocity", "stress", "von_mises"], **output}}
    return block(2, 2, velocity=["-0.1*y", "0.1*x"], run={"dt": 0.05, "end": 0.2}, tables=tables)


def read(path: Path) -> tuple[list[str], list[list[str]]]:
    """The names of the columns, and the lines."""
    with open(path, encoding="utf-8", newline="") as file:
        names, *lines = csv.reader(file)
    return names, lines


@pytest.mark.usefixtures("line")
def test_frames_are_there_whole_and_read_back_exactly(tmp_path: Path) -> None:
    out = tmp_path / "out"
    wsph.run(spun(formats=["csv", "npz"]), out)
    names, lines = read(out / "frames.csv")
    assert names == ["time", "file"]
    assert [float(time) for time, _ in lines] == pytest.approx([0.0, 0.1, 0.2])
    assert sorted(out.rglob("*.csv")) == [
        *sorted(out / file for _, file in lines),
        out / "frames.csv",
        out / "history.csv",
    ]
    components = ["xx", "yy", "zz", "xy", "yz", "xz"]
    wanted = [
        "x",
        "y",
        "z",
        *(f"velocity_{a}" for a in "xyz"),
        *(f"stress_{c}" for c in components),
        "von_mises",
        "id",
        "body",
    ]
    for _, file in lines:
        names, rows = read(out / file)
        assert names == wanted
        archive = np.load((out / file).with_suffix(".npz"))
        there = [archive[name] for name in ("position", "velocity", "stress", "von_mises", "id", "body")]
        assert np.array_equal(np.array(rows, float), np.column_stack(there))


@pytest.mark.usefixtures("line")
def test_a_run_in_its_place_takes_its_frames_away(tmp_path: Path) -> None:
    wsph.run(spun(formats=["csv"], every=1), tmp_path / "out")
    wsph.run(spun(formats=["npz"]), tmp_path / "out", overwrite=True)
    assert [path.name for path in tmp_path.rglob("*.csv")] == ["history.csv"]


@pytest.mark.usefixtures("line")
def test_another_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(SceneError, match=r"output.formats.0: 'cvs' is none of .* or 'csv'; did you mean 'csv'\?"):
        spun(formats=["cvs"])


def test_without_its_line_nothing_knows_it() -> None:
    with pytest.raises(SceneError, match="'csv' is none of"):
        spun(formats=["csv"])
    assert not knowing("csv_frames")
