"""The wheel with other versions of Python and of what it stands on: the quick part of the tests, and what came of it.

    python tests/packaging/tried.py                              this Python, the newest versions
    python tests/packaging/tried.py --python 3.13 --lowest       another, with the lowest that pyproject.toml allows

It takes `uv` (from PyPI) to resolve the lowest versions. The wheel is built, installed in an environment of its own with all
extras that tests use, and tested in a folder that has the tests and no source beside them. docs/tried.json keeps what ran;
`python docs/make.py --only tried` shows it.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RECORD = ROOT / "docs" / "tried.json"

EXTRAS = ("test", "video", "vtkhdf", "notebook")
LEFT = ("dev", "docs")

QUICK = (
    "catalogue",
    "cli",
    "geometry",
    "materials",
    "mistakes",
    "output",
    "plugin",
    "plugins",
    "scene",
    "study",
    "testing",
)
"""The folders of tests that touch other packages, and those that end soon."""

ONE_RUN = (
    "simulation/test_run.py",
    "simulation/test_result.py",
    "simulation/test_stepping.py",
    "backend/test_graph.py",
)


def environment(folder: Path, python: str, low: bool) -> Path:
    """An environment with the wheel and all that its tests need; its Python."""
    made = folder / "environment" / "bin" / "python"
    wanted, resolution = folder / "requirements.txt", "lowest-direct" if low else "highest"
    uv("venv", "--python", python, str(made.parents[1]))
    version = said(str(made), "-c", "import platform; print(platform.python_version())")
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    resolved = ("--resolution", resolution, "--python-version", version, "--output-file", str(wanted))
    uv("pip", "compile", *extras, *resolved, str(ROOT / "pyproject.toml"))
    uv("pip", "install", "--python", str(made), "--requirement", str(wanted))
    uv("build", "--out-dir", str(folder / "dist"), str(ROOT))
    wheels = [str(path) for path in (folder / "dist").glob("*.whl")]
    uv("pip", "install", "--python", str(made), "--no-deps", *wheels, str(ROOT / "tests" / "plugin"))
    return made


def tested(folder: Path, python: Path) -> dict[str, int]:
    """The counts of the quick tests, in a folder without the source."""
    place = folder / "tests-alone"
    place.mkdir()
    for name in ("tests", "docs", "examples"):
        shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__", "made", "gallery"))
    for name in ("pyproject.toml", "README.md", "CONTRIBUTING.md"):
        shutil.copy(ROOT / name, place / name)
    paths = [f"tests/{name}" for name in (*QUICK, *ONE_RUN)]
    # What other packages say of each other's age is not for this to judge.
    command = [str(python), "-m", "pytest", "-q", "-n", "1", "-W", "ignore::DeprecationWarning", *paths]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    print(done.stdout[-6000:], done.stderr[-2000:])
    counts = {
        word: int(number) for number, word in re.findall(r"(\d+) (passed|failed|skipped|errors?)\b", done.stdout[-300:])
    }
    return counts if counts else {"errors": 1}


def uv(*words: str) -> None:
    """Run uv; its own output where it fails."""
    subprocess.run([shutil.which("uv") or "uv", *words, "--quiet"], check=True)


def said(*words: str) -> str:
    """What a command prints."""
    return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()


def versions(python: Path) -> dict[str, str]:
    """The versions of what pyproject.toml names, as they are installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [each for name, listed in project["optional-dependencies"].items() if name not in LEFT for each in listed]
    names = sorted({re.split(r"[\[<>=]", each)[0] for each in (*project["dependencies"], *extras)} - {"wsph"})
    ask = f"import json; from importlib.metadata import version; print(json.dumps({{n: version(n) for n in {names}}}))"
    return json.loads(said(str(python), "-c", ask))


def main() -> int:
    """Try one Python, and note it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", default=sys.executable, help="a version, or the path of one (default: this)")
    parser.add_argument("--lowest", action="store_true", help="the lowest versions that pyproject.toml allows")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        python = environment(Path(folder), options.python, options.lowest)
        begun = time.perf_counter()
        counts = tested(Path(folder), python)
        version = said(str(python), "-c", "import platform; print(platform.python_version())")
        row = {
            "python": version,
            "lowest": options.lowest,
            "date": time.strftime("%Y-%m-%d"),
            "seconds": round(time.perf_counter() - begun),
            "counts": counts,
            "versions": versions(python),
        }
    rows = json.loads(RECORD.read_text()) if RECORD.exists() else []
    kept = [each for each in rows if (each["python"], each["lowest"]) != (version, options.lowest)]
    kept = sorted([*kept, row], key=lambda each: (not each["lowest"], each["python"]))
    RECORD.write_text(json.dumps(kept, indent=1) + "\n")
    print({key: value for key, value in row.items() if key != "versions"})
    return 1 if counts.keys() - {"passed", "skipped"} else 0


if __name__ == "__main__":
    sys.exit(main())
