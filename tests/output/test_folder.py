"""Folders of runs: never clobbered, refused before anything is composed, tables that read back exactly."""

import csv
from pathlib import Path

import pytest

import wsph
from wsph.errors import OutputError


def test_an_existing_run_is_never_clobbered(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    out = tmp_path / "out"
    scene = shock_bar.with_(end="0.5 ms")
    wsph.run(scene, out)
    before = (out / "summary.json").read_bytes()
    with pytest.raises(OutputError, match="holds files already.*--overwrite"):
        wsph.run(scene, out)
    assert (out / "summary.json").read_bytes() == before
    wsph.run(scene.with_(end="1 ms"), out, overwrite=True)
    assert (out / "summary.json").read_bytes() != before
    foreign = tmp_path / "photos"
    foreign.mkdir()
    (foreign / "cat.jpg").touch()
    with pytest.raises(OutputError, match="holds no run of wsph"):
        wsph.run(scene, foreign, overwrite=True)


@pytest.mark.parametrize("where", ["/dev/null/out", "/proc/out", "a\0b"])
def test_a_folder_that_cannot_be_written_is_refused_before_anything(
    shock_bar: wsph.Scene, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "wsph.simulation.run.compose", lambda scene: pytest.fail("composed before the folder was checked")
    )
    with pytest.raises(OutputError):
        wsph.run(shock_bar, where)


def test_a_folder_that_is_a_link_is_refused(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there")
    with pytest.raises(OutputError, match="is a symbolic link"):
        wsph.run(shock_bar, tmp_path / "link", overwrite=True)
    assert not list((tmp_path / "there").iterdir())


def test_tables_read_back_exactly(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    result = wsph.run(shock_bar.with_(cfl=0.7), tmp_path / "out")
    with open(tmp_path / "out" / "probes" / "fixed-end.csv") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time", "stress_xx", "velocity_x"]
    assert [float(row["stress_xx"]) for row in rows] == result.probes["fixed-end"]["stress_xx"].tolist()
    with open(tmp_path / "out" / "history.csv") as file:
        history = list(csv.DictReader(file))
    assert [float(row["residual"]) for row in history] == result.history["residual"].tolist()


def test_overwriting_touches_only_what_a_run_wrote(shock_bar: wsph.Scene, tmp_path: Path) -> None:
    film = tmp_path / "video" / "frames"
    film.mkdir(parents=True)
    (film / "film.mov").touch()
    with pytest.raises(OutputError, match="holds no run of wsph"):
        wsph.run(shock_bar.with_(end="0.1 ms"), film.parent, overwrite=True)
    out = tmp_path / "out"
    wsph.run(shock_bar.with_(end="0.1 ms"), out)
    (out / "frames" / "notes.txt").touch()
    wsph.run(shock_bar.with_(end="0.1 ms"), out, overwrite=True)
    assert (out / "frames" / "notes.txt").exists()
