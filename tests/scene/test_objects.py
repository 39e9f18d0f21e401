"""Tables of a scene that Python gives as objects."""

import subprocess
import sys
from typing import Any

import pytest

import wsph

SHAPES: list[tuple[Any, dict[str, Any], str]] = [
    (wsph.Box, {"min": (0.0, 0.0), "max": (1.0, "1 m")}, "box"),
    (wsph.Ball, {"center": (0.0, 0.0), "radius": 1.0}, "disc"),
    (wsph.Ball, {"center": (0.0, 0.0, 0.0), "radius": 1.0}, "sphere"),
    (wsph.Ring, {"center": (0.0, 0.0), "inner": 0.5, "outer": 1.0}, "ring"),
    (wsph.Polygon, {"points": ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))}, "polygon"),
]


@pytest.mark.parametrize(("table", "keys", "name"), SHAPES)
def test_the_class_of_a_shape_says_its_type(table: Any, keys: dict[str, Any], name: str) -> None:
    shape = table(**keys)
    assert shape.type == name
    assert shape == table(type=name, **keys)
    material = {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}
    dim, state = shape.dim, {} if shape.dim == 3 else {"state": "strain"}
    body = wsph.Body(name="b", shape=shape, spacing=0.1, material=material, **state)  # type: ignore[arg-type]
    scene = wsph.Scene(schema=1, dim=dim, run={"integrator": "leapfrog", "end": 1.0, "cfl": 0.5}, bodies=[body])
    assert scene.data()["bodies"][0]["shape"]["type"] == name  # type: ignore[index]
    assert scene.with_(end=2.0).bodies[0].shape == shape


def test_what_its_class_leaves_open_has_to_be_said() -> None:
    box = wsph.Box(min=(0.0,), max=(1.0,))
    with pytest.raises(wsph.SceneError, match=r"^Combined: type: is missing$"):
        wsph.Combined(shapes=(box, box))  # type: ignore[call-arg]
    assert wsph.Combined(type="union", shapes=(box, box)).type == "union"


def test_a_file_still_has_to_say_it() -> None:
    run, material = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.5}, {"model": "elastic", "density": 1.0}
    body = {"name": "b", "shape": {"min": [0.0], "max": [1.0]}, "spacing": 0.1, "material": material}
    with pytest.raises(wsph.SceneError, match=r"bodies\.0\.shape\.type: is missing"):
        wsph.Scene(schema=1, dim=1, run=run, bodies=[body])


FAULTS: list[tuple[Any, dict[str, Any], str]] = [
    (wsph.Box, {"mini": (0.0,), "max": (1.0,)}, "Box: mini: unknown key; did you mean 'min'?"),
    (wsph.Box, {"min": (0.0,), "max": (1.0,), "type": "disc"}, "Box: type: 'disc' is none of 'box'"),
    (wsph.Box, {"min": (0.0,), "max": ("1 kg",)}, "Box: max.0: '1 kg' is not in units of m"),
    (wsph.Run, {"end": 1.0, "cfl": 0.5}, "Run: integrator: is missing"),
    (wsph.Probe, {"name": "p", "fields": ("velocity",), "every": 0}, "Probe: every: 0 steps: from 1 to 2^53"),
    (wsph.Boundary, {"body": "b", "face": "+x", "tractoin": {"x": 1.0}}, "Boundary: tractoin: unknown key; did you mean 'traction'?"),
]  # fmt: skip


@pytest.mark.parametrize(("table", "keys", "words"), FAULTS)
def test_faults_of_objects_are_said_in_the_words_of_scenes(table: Any, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(wsph.SceneError) as found:
        table(**keys)
    assert words in str(found.value)
    assert "pydantic" not in str(found.value)
    assert found.value.__cause__ is None


def test_so_they_are_where_nothing_else_was_imported() -> None:
    table, keys, words = FAULTS[0]
    code = f"import wsph; wsph.{table.__name__}(**{keys})"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stderr
    assert words in said
    assert "pydantic.dev" not in said
