"""What a user without the checkout has: the wheel, installed from itself and the package index into an empty environment, in
an empty folder, and each of the first commands that the docs name."""

# pyright: strict

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

PACKED = {"wsph": "wsph", "integrators/wsph_integrators": "wsph_integrators", "materials/wsph_materials": "wsph_materials",
          "examples": "wsph/examples"}  # fmt: skip
"""Folders of the checkout, and where they are in the wheel."""

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Installed:
    """An environment with the wheel, and the folder in which its commands run."""

    scripts: Path
    folder: Path

    def __call__(self, command: str, *words: str, code: int = 0, at: str = ".") -> str:
        """Run a command of the environment; what it printed."""
        return _ran([str(self.scripts / command), *words], self.folder / at, code)


def _ran(command: Sequence[str], folder: Path, code: int = 0) -> str:
    kept = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PYTEST", "VIRTUAL"))}
    done = subprocess.run(command, cwd=folder, env=kept, capture_output=True, text=True, check=False)
    assert done.returncode == code, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout + done.stderr


def _environment(folder: Path) -> Path:
    """An empty environment; its scripts."""
    _ran([sys.executable, "-m", "venv", str(folder)], folder.parent)
    return folder / "bin"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist, and the wheel that is made of it."""
    folder = tmp_path_factory.mktemp("dist")
    scripts = _environment(folder / "builder")
    _ran([str(scripts / "pip"), "install", "--quiet", "hatchling>=1.25"], folder)
    _ran([str(scripts / "python"), "-m", "hatchling", "build", "-t", "sdist", "-d", str(folder)], ROOT)
    (sdist,) = folder.glob("*.tar.gz")
    _ran([str(scripts / "pip"), "wheel", "--quiet", "--no-deps", "-w", str(folder), str(sdist)], folder)
    return folder


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel, with pytest for the packages of materials, and nothing else."""
    folder = tmp_path_factory.mktemp("user")
    scripts = _environment(folder.parent / f"{folder.name}-environment")
    (wheel,) = built.glob("*.whl")
    _ran([str(scripts / "pip"), "install", "--quiet", str(wheel)], folder)
    return Installed(scripts, folder)


def test_nothing_is_missing_from_the_wheel(built: Path) -> None:
    """It is made of the sdist, so that has it too. And the sdist has what its own tests read."""
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for folder, there in PACKED.items():
        files = [path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts]
        assert files
        missing = [path for path in files if f"{there}/{path.relative_to(ROOT / folder).as_posix()}" not in names]
        assert not missing
    assert {f"{name}/py.typed" for name in ("wsph", "wsph_integrators", "wsph_materials")} <= names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not [name for name in names if name.startswith(("tests", "docs"))]
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        tops = {name.split("/")[1] for name in archive.getnames() if "/" in name}
    assert {"tests", "examples", "docs", "README.md", "CITATION.cff", "LICENSE", "CHANGELOG.md"} <= tops


def test_it_says_what_it_is(installed: Installed) -> None:
    assert re.match(r"wsph \d+\.\d+", installed("wsph", "--version"))
    said = installed("wsph", "info")
    assert str(installed.scripts.parent) in said
    assert "none but wsph's own" in said
    listed = installed("wsph", "list")
    assert all(word in listed for word in ("leapfrog", "tsph", "elastic", "mises"))
    assert "broken" not in listed


def test_a_new_scene_runs(installed: Installed) -> None:
    installed("wsph", "new", "scene", "beam")
    installed("wsph", "check", "beam.toml")
    installed("wsph", "run", "beam.toml", "-o", "out", "--quiet", "--set", "bodies.0.spacing=0.0025")
    assert (installed.folder / "out" / "frames.pvd").is_file()
    assert "completed" in (installed.folder / "out" / "summary.json").read_text()
    assert 'pip install "wsph[view]"' in installed("wsph", "view", "out", "--save", "a.png", code=2)


def test_an_example_runs(installed: Installed) -> None:
    installed("wsph", "new", "example", "bracket")
    installed("wsph", "new", "example", "shock_bar")
    installed("wsph", "check", "bracket.toml")
    installed("wsph", "run", "shock_bar.toml", "-o", "bar-out", "--quiet")
    assert (installed.folder / "bar-out" / "summary.json").is_file()
    assert "meets" in installed("wsph", "validate", "shock-bar")


def test_a_material_of_ones_own_is_installed_and_tested(installed: Installed) -> None:
    """As its README says: one test asks for the change that makes the law."""
    installed("wsph", "new", "material", "my-own")
    installed("pip", "install", "--quiet", "-e", ".[test]", at="wsph-my-own")
    assert "1 failed" in installed("python", "-m", "pytest", "-q", code=1, at="wsph-my-own")
    path = installed.folder / "wsph-my-own" / "wsph_my_own" / "material.py"
    text = path.read_text()
    asked = re.search(r"            #   (return .*)\n.*\n", text)
    assert asked is not None
    path.write_text(text.replace(asked[0], f"            {asked[1]}\n"))
    installed("python", "-m", "pytest", "-q", at="wsph-my-own")
    assert "relaxation_time" in installed("wsph", "list", "my-own")
    installed("wsph", "run", "bar.toml", "--quiet", at="wsph-my-own")


def test_its_types_are_seen(installed: Installed) -> None:
    """A package with py.typed: what is imported has its signature, and the plugins that ship are found by their names."""
    code = (
        "import inspect, wsph, importlib.resources as r; assert (r.files('wsph') / 'py.typed').is_file();"
        "assert 'throw' in inspect.signature(wsph.run).parameters; wsph.material('elastic', density=1.0, youngs_modulus=1.0,"
        "poisson_ratio=0.3); assert wsph.load"
    )
    installed("python", "-c", code)
