"""What other ways of installing say is what pyproject.toml says: names, bounds, commands; and what was tried is told."""

# pyright: strict

import json
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
TABLE = PROJECT["project"]
RECIPE = (ROOT / "packaging" / "recipe.yaml").read_text(encoding="utf-8")
EXTRAS: dict[str, list[str]] = TABLE["optional-dependencies"]

CONDA = {"matplotlib": "matplotlib-base"}
"""Names of packages on conda-forge that are not those on PyPI."""


def listed(key: str) -> list[str]:
    """The list of a key of the recipe's requirements."""
    found = re.search(rf"^  {key}:\n((?:    - .*\n)+)", RECIPE, re.MULTILINE)
    assert found is not None
    return [line.removeprefix("    - ").replace("${{ python_min }}", "3.11") for line in found[1].splitlines()]


def as_conda(requirement: str) -> str:
    """`numpy>=1.26` as conda writes it."""
    name, bounds = re.match(r"([\w-]+)(?:\[.*\])?(.*)", requirement.strip()).groups()  # type: ignore[union-attr]
    return f"{CONDA.get(name, name)} {bounds}"


def test_the_conda_recipe_has_the_bounds_of_the_project() -> None:
    assert listed("run") == [f"python {TABLE['requires-python']}", *map(as_conda, TABLE["dependencies"])]
    optional = [each for extra in ("view", "xdmf", "calibrate") for each in EXTRAS[extra]]
    assert listed("run_constraints") == list(map(as_conda, optional))
    built = [as_conda(each) for each in PROJECT["build-system"]["requires"]]
    assert listed("host") == ["python 3.11.*", "pip", *built]
    said = {key: re.search(rf"^ +{key}: (.*)$", RECIPE, re.MULTILINE) for key in ("version", "name", "license")}
    assert {key: found and found[1].strip('"') for key, found in said.items()} == {key: TABLE[key] for key in said}
    assert all(f"- {name} = {target}" in RECIPE for name, target in TABLE["scripts"].items())


def test_the_conda_recipe_renders() -> None:
    """With rattler-build's own reading (`py-rattler-build` on PyPI), where it is installed."""
    rattler_build = pytest.importorskip("rattler_build")
    (made,) = rattler_build.Stage0Recipe.from_file(str(ROOT / "packaging" / "recipe.yaml")).render(
        rattler_build.VariantConfig()
    )
    assert made.recipe.to_dict()["build"]["noarch"] == "python"


def test_pixi_names_extras_that_there_are() -> None:
    """Bounds are not said twice: pixi reads those of the project."""
    pixi = PROJECT["tool"]["pixi"]
    assert {name for names in pixi["environments"].values() for name in names} <= EXTRAS.keys()
    assert pixi["pypi-dependencies"] == {"wsph": {"path": ".", "editable": True}}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert pixi["feature"]["dev"]["tasks"]["test"]["cmd"] in readme


def test_the_container_copies_all_that_a_wheel_is_made_of() -> None:
    text = (ROOT / "packaging" / "Dockerfile").read_text(encoding="utf-8")
    copied = {word for words in re.findall(r"^COPY (?!--)(.*) \S+$", text, re.MULTILINE) for word in words.split()}
    hatch = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = {path.split("/")[0] for path in (*hatch["packages"], *hatch["force-include"])}
    assert copied == needed | {"pyproject.toml", TABLE["readme"], *TABLE["license-files"]}
    installed = re.search(r'"\.\[(.*)\]"', text)
    assert installed is not None
    assert set(installed[1].split(",")) <= EXTRAS.keys()


def test_python_is_promised_where_it_was_tried() -> None:
    promised = {each.rsplit(" ", 1)[1] for each in TABLE["classifiers"] if re.search(r":: 3\.\d+$", each)}
    rows = json.loads((ROOT / "docs" / "tried.json").read_text(encoding="utf-8"))
    assert promised == {row["python"].rpartition(".")[0] for row in rows}
    assert all(row["counts"].keys() <= {"passed", "skipped"} for row in rows)


def test_the_lowest_versions_are_those_that_were_tried() -> None:
    """A bound that is changed is to be tried again: `python tests/packaging/tried.py --python 3.11 --lowest`."""
    rows = json.loads((ROOT / "docs" / "tried.json").read_text(encoding="utf-8"))
    (lowest,) = [row["versions"] for row in rows if row["lowest"]]
    for requirement in (
        *TABLE["dependencies"],
        *(each for extra in ("view", "xdmf", "calibrate") for each in EXTRAS[extra]),
    ):
        name, bound = re.match(r"([\w-]+)>=([\d.]+)", requirement).groups()  # type: ignore[union-attr]
        assert f"{lowest[name]}.".startswith(f"{bound}."), (requirement, lowest[name])
