"""The contracts that the import linter checks name all that they mean."""

import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from house_rules import FOR_PLUGINS
from syntax import PACKAGES, ROOT

PLUGINS = "plugins use the public names alone"


def contract(name: str) -> dict[str, Any]:
    """A contract of pyproject.toml."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    return next(each for each in settings["contracts"] if each["name"] == name)


def others(folder: Path, name: str, public: tuple[str, ...]) -> Iterator[str]:
    """The modules and packages of a package that hold nothing public, the largest of them."""
    for entry in sorted(folder.iterdir()):
        module = f"{name}.{entry.stem}"
        if entry.name.startswith("_") or not (entry.suffix == ".py" or any(entry.glob("**/*.py"))):
            continue
        if any(each.startswith(f"{module}.") for each in public):
            yield from others(entry, module, public)
        elif module not in public:
            yield module


def test_all_but_the_public_names_is_forbidden_to_plugins() -> None:
    assert contract(PLUGINS)["forbidden_modules"] == list(others(PACKAGES["wsph"], "wsph", FOR_PLUGINS))


def test_what_is_public_is_there() -> None:
    for name in FOR_PLUGINS:
        path = PACKAGES["wsph"].parent.joinpath(*name.split("."))
        assert path.with_suffix(".py").is_file() or (path / "__init__.py").is_file(), name


def test_the_contract_is_about_every_plugin_package_of_the_project() -> None:
    assert set(contract(PLUGINS)["source_modules"]) == set(PACKAGES) - {"wsph"}


@pytest.mark.parametrize("new", ["heat.py", "heat/__init__.py", "stability/rates.py", "stability/rates/__init__.py"])
def test_a_new_room_is_noticed(tmp_path: Path, new: str) -> None:
    for file in ("__init__.py", "protocols.py", "stability/__init__.py", "stability/regions.py", "testing/__init__.py", new):  # fmt: skip
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).touch()
    found = new.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    assert list(others(tmp_path, "wsph", FOR_PLUGINS)) == [f"wsph.{found}"]
