"""The JSON schema of scenes: every scene that there is holds to it, and what a scene refuses of types it refuses too."""

import copy
import json
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

sys.path.insert(0, str(Path(__file__).parent))
from validator import faults

from wsph.catalogue.entries import find, names
from wsph.catalogue.examples import example_of
from wsph.catalogue.keys import keys_of
from wsph.catalogue.schema import plugin_schemas, scene_schema, schema_of
from wsph.catalogue.tables import places
from wsph.cli import main
from wsph.errors import WsphError
from wsph.geometry.shapes.shape import BaseShape
from wsph.plugins.declared import material_schema
from wsph.plugins.options import build
from wsph.quantities import Model
from wsph.scene.scene import Scene
from wsph.study.tables import Study

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted((ROOT / "examples").glob("*.toml"))
BAR = tomllib.loads((ROOT / "examples" / "shock_bar.toml").read_text())


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return scene_schema()


def test_every_example_holds_to_the_schema(schema: dict[str, Any]) -> None:
    assert len(SCENES) > 20
    for path in SCENES:
        assert list(faults(tomllib.loads(path.read_text()), schema, schema)) == [], path.name
    study = schema_of(Study)
    for path in (ROOT / "examples" / "fronts").glob("*.toml"):
        assert list(faults(tomllib.loads(path.read_text()), study, study)) == [], path.name


WRONG: list[tuple[list[str | int], object]] = [
    (["dim"], 4),
    (["run", "end"], "soon"),
    (["run", "dt"], -1.0),
    (["run", "kernel"], "gauss"),
    (["run", "device"], 0),
    (["run", "spacing"], 1),
    (["bodies", 0, "spcing"], 1),
    (["bodies", 0, "spacing"], {"cell": 3}),
    (["bodies", 0, "shape", "type"], "blob"),
    (["bodies", 0, "material", "density"], -1.0),
    (["bodies", 0, "material", "model"], "elastc"),
    (["bodies", 0, "residual"], True),
    (["output"], {"formats": ["stl"]}),
]


@pytest.mark.parametrize(("path", "value"), WRONG)
def test_what_a_scene_refuses_the_schema_refuses(path: list[str | int], value: object, schema: dict[str, Any]) -> None:
    data: Any = copy.deepcopy(BAR)
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert list(faults(data, schema, schema))
    with pytest.raises(WsphError):
        Scene(**data)


def models(base: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for each in base.__subclasses__():
        yield each
        yield from models(each)


def test_every_declared_example_is_one() -> None:
    """Of the models of wsph, each by itself."""
    found = [model for base in (Model, BaseShape) for model in models(base) if model.__module__.startswith("wsph.")]
    shown = [model for model in found if "examples" in model.model_json_schema(by_alias=True)]
    assert len(shown) > 30
    for model in shown:
        for example in model.model_json_schema(by_alias=True)["examples"]:
            if example.get("type") != "stl":  # the file is not there
                model.model_validate(example)


def test_the_example_of_a_material_is_one() -> None:
    for name, schema in plugin_schemas("materials").items():
        example = example_of(schema, schema)
        assert example["model"] == name
        options = {key: value for key, value in example.items() if key != "model"}
        assert build("materials", name, options, "", "model")[1] == [], name


def test_every_table_has_an_example_that_holds_to_its_schema(schema: dict[str, Any]) -> None:
    for path, table in places():
        example = example_of(table, schema)
        assert list(faults(example, table, schema)) == [], path


def test_a_name_is_described_with_keys_units_defaults_ranges_source_and_example(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["list", "mises"]) == 0
    text = capsys.readouterr().out
    for words in ("Wilkins 1964", "wsph_materials.mises:Mises", '[bodies.material]\nmodel = "mises"'):
        assert words in text
    row = next(line for line in text.splitlines() if line.startswith("hardening_modulus"))
    assert row.split() == ["hardening_modulus", "Pa", "0.0", "number"]
    row = next(line for line in text.splitlines() if line.startswith("poisson_ratio "))
    assert row.split() == ["poisson_ratio", "needed", ">", "-1,", "<", "0.5", "number"]
    assert main(["list", "viscosity", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert [key["name"] for key in found["keys"]] == ["alpha", "beta", "kind", "correction"]
    assert "taken by total-lagrangian (1 set)" in found["words"][0]


WORDS = {
    "run": ("support", "radius of the kernel in spacings"),
    "bodies": ("viscosity", "Artificial viscosity"),
    "functions": ("t", "times, increasing"),
    "boundary": ("traction", "force per reference area, by component"),
    "contact": ("self", "a body that touches itself"),
    "sections": ("body", "that it cuts"),
    "tools": ("shape", "a plane, ball"),
    "probes": ("at", "material points"),
    "accuracy": ("free", "what it may choose"),
    "output": ("every", "between frames"),
    "checkpoint": ("keep", "how many stay"),
    "stop": ("energy", "created"),
    "steps": ("duration", "how long"),
}


@pytest.mark.parametrize("name", WORDS)
def test_every_key_of_the_tables_that_a_scene_is_made_of_is_described(name: str) -> None:
    (found,) = (each for each in find(name) if each.group == "tables")
    assert [key.name for key in found.keys if not key.said] == []
    key, said = WORDS[name]
    assert {key.name: key.said for key in found.keys}[key].startswith(said)


@dataclass(frozen=True)
class Rubber:
    """A law whose fields say what they are."""

    bulk_modulus: float = field(metadata={"unit": "Pa", "example": "50 MPa", "help": "at small strain"})
    name: float = field(metadata={"unit": "", "example": 0.25})


def test_examples_and_helps_of_a_materials_fields_are_shown() -> None:
    made = material_schema(Rubber, "rubber")
    assert example_of(made, made) == {"model": "rubber", "bulk_modulus": "50 MPa", "name": 0.25}
    assert [(key.name, key.said) for key in keys_of(made)] == [
        ("model", ""),
        ("bulk_modulus", "at small strain"),
        ("name", ""),
    ]


def test_all_names_are_described() -> None:
    for name in names():
        for each in find(name):
            assert each.source, name
            assert each.description, name


def test_a_name_that_nothing_has_is_refused_with_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "viscosty"]) == 2
    assert "nothing that a scene can have is named 'viscosty'; did you mean 'viscosity'" in capsys.readouterr().err


def test_the_schema_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out)["properties"]["bodies"]["type"] == "array"
    assert main(["schema", "study"]) == 0
    assert "variants" in json.loads(capsys.readouterr().out)["properties"]
