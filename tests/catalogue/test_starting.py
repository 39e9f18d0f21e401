"""Starting points run as they are; the test of a package fails, and passes once the change is made that it asks for."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import wsph
from wsph.catalogue import groups
from wsph.catalogue.starting import start
from wsph.cli import main
from wsph.errors import WsphError
from wsph.study.tables import load_study

# E I of the beam of the scene, by which its end comes down: plane stress, a unit depth.
LENGTH, HEIGHT, YOUNG, LOAD = 0.1, 0.01, 210e9, 2e6


def test_a_new_scene_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "scene", "beam"]) == 0
    assert capsys.readouterr().out == "beam.toml\nnext: wsph run beam.toml\n"
    result = wsph.run(wsph.load("beam.toml").with_(**{"bodies.0.spacing": 0.0025}))
    assert result.stable
    static = LOAD * HEIGHT * LENGTH**3 / (3.0 * YOUNG * HEIGHT**3 / 12.0)
    tip = result.probes["tip"]["displacement_y"]
    # The first mode swings to between the static deflection and twice that: the load comes within a fifth of its period.
    assert 1.0 < -tip.min() / static < 2.0
    assert main(["new", "scene", "beam"]) == 2
    assert "beam.toml is there already" in capsys.readouterr().err


def test_a_new_study_can_be_read(tmp_path: Path) -> None:
    written = start("study", "grids", tmp_path)
    study, scene = load_study(written[0])
    assert len(study.variants) == 2
    assert scene.bodies[0].name == "beam"


def test_every_example_is_written_with_what_it_reads(tmp_path: Path) -> None:
    for row in groups.examples():
        folder = tmp_path / row.name
        folder.mkdir()
        written = start("example", row.name, folder)
        assert wsph.load(written[0]).bodies, row.name
        assert len(row.description) > 20, row.name
    assert {path.name for path in (tmp_path / "bracket").iterdir()} == {"bracket.toml", "bracket.stl"}
    with pytest.raises(WsphError, match=r"'shock-bar' is none of .*; did you mean 'shock_bar'\?"):
        start("example", "shock-bar", tmp_path)


def pytest_of(folder: Path) -> "subprocess.CompletedProcess[str]":
    """The tests of a package in a process of their own, which sees it as installed."""
    info = folder / "plugin.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {folder.name}\nVersion: 0.1.0\n")
    points = re.search(r'\[project\.entry-points\."(.*)"\]\n(.*)\n', (folder / "pyproject.toml").read_text())
    assert points is not None
    (info / "entry_points.txt").write_text(f"[{points[1]}]\n{points[2].replace(chr(34), '')}\n")
    path = os.pathsep.join([str(folder), *(each for each in sys.path if each)])
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(folder), str(folder)]
    return subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("kind", "total"), [("material", False), ("material", True), ("integrator", False)])
def test_a_new_package_fails_its_test_until_the_change_is_made(kind: str, total: bool, tmp_path: Path) -> None:
    written = start(kind, "my-own", tmp_path, total=total)
    folder = written[0].parent
    before = pytest_of(folder)
    assert before.returncode == 1, before.stdout + before.stderr
    assert "1 failed" in before.stdout
    path = folder / "wsph_my_own" / f"{kind}.py"
    text = path.read_text()
    asked = re.search(r"            #   (return .*)\n.*\n|        #   (s\.combine.*)\n.*\n", text)
    assert asked is not None
    change = f"            {asked[1]}\n" if asked[1] else f"        {asked[2]}\n"
    path.write_text(text.replace(asked[0], change))
    after = pytest_of(folder)
    assert after.returncode == 0, after.stdout + after.stderr
    run = [sys.executable, "-m", "wsph", "run", "bar.toml", "--quiet"]
    path_of = os.pathsep.join([str(folder), *(each for each in sys.path if each)])
    done = subprocess.run(run, cwd=folder, env={**os.environ, "PYTHONPATH": path_of}, capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (folder / "bar-out" / "probes" / "middle.csv").exists()


@pytest.mark.parametrize(("kind", "name"), [("material", "Mine"), ("integrator", "a b"), ("scene", "../x")])
def test_a_name_that_is_none_is_refused(kind: str, name: str, tmp_path: Path) -> None:
    with pytest.raises(WsphError, match="is no name of a"):
        start(kind, name, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_total_law_is_of_a_material_alone(tmp_path: Path) -> None:
    with pytest.raises(WsphError, match="--total is of a material"):
        start("integrator", "mine", tmp_path, total=True)


def test_what_comes_next_installs_pytest_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "material", "my-rubber", "--total"]) == 0
    assert capsys.readouterr().out.endswith("next: cd wsph-my-rubber && pip install -e . pytest && pytest\n")
