"""Parts from files in millimetres that were read as metres: their size is said, with the way out."""

import re
import warnings
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import wsph
from examples.bracket import write_stl
from tests import scenes
from tests.geometry.test_stl import cube_triangles

QUESTION = "m large; is its file in millimetres? Write scale = 0.001"
RUN = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3}


def from_stl(folder: Path, **keys: Any) -> dict[str, Any]:
    write_stl(folder / "part.stl", 80.0 * cube_triangles())
    return {
        "shape": {"type": "stl", "file": str(folder / "part.stl"), **keys},
        "spacing": {"cells": 8},
        "surface": "stairs",
    }


def with_a_hole(folder: Path, **keys: Any) -> dict[str, Any]:
    ball = {"type": "sphere", "center": [40.0, 40.0, 40.0], "radius": 20.0}
    body = from_stl(folder, **keys)
    return {**body, "shape": {"type": "difference", "shapes": [body["shape"], ball]}}


def from_mesh(folder: Path, **keys: Any) -> dict[str, Any]:
    places = np.stack(np.meshgrid(*[[0.0, 40.0, 80.0]] * 3, indexing="ij"), -1).reshape(-1, 3)
    corners = [0, 9, 12, 3, 1, 10, 13, 4]
    cells = [[n + i + 3 * j + 9 * k for n in corners] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    meshio.Mesh(places, [("hexahedron", cells)]).write(folder / "part.vtk")
    return {"mesh": {"file": str(folder / "part.vtk"), **keys}}


def from_points(folder: Path, **keys: Any) -> dict[str, Any]:
    places = 10.0 * np.stack(np.meshgrid(*[np.arange(8) + 0.5] * 3, indexing="ij"), -1).reshape(-1, 3)
    rows = [",".join(map(str, (*place, 1000.0))) for place in places.tolist()]
    (folder / "part.csv").write_text("x,y,z,volume\n" + "\n".join(rows))
    return {"shape": {"type": "points", "file": str(folder / "part.csv"), **keys}}


def said(body: dict[str, Any], **keys: Any) -> list[str]:
    form = "total-lagrangian" if body.get("shape", {}).get("type") == "points" else "stress-points"
    data = {"name": "part", "material": scenes.material(), **body}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wsph.compose(wsph.Scene(schema=1, dim=3, run={**RUN, "formulation": form}, bodies=[data], **keys))
    return [str(each.message) for each in caught if "millimetres" in str(each.message)]


@pytest.mark.parametrize("made", [from_stl, with_a_hole, from_mesh, from_points])
def test_a_part_of_eighty_metres_without_a_scale_is_asked_about(tmp_path: Path, made: Any) -> None:
    (found,) = said(made(tmp_path))
    key = "mesh" if made is from_mesh else "points" if made is from_points else "shape"
    assert re.match(rf"unlikely: bodies.0.{key}: 'part' is (\d+) x \1 x \1 m", found)
    assert QUESTION in found
    assert said(made(tmp_path, scale=0.001)) == []
    assert said(made(tmp_path, scale=1.0)) == []


def test_a_spacing_in_millimetres_of_such_a_part_is_refused_with_its_size(tmp_path: Path) -> None:
    body = {"name": "part", "material": scenes.material(), **from_stl(tmp_path), "spacing": "1.25 mm"}
    with pytest.raises(
        wsph.SceneError, match=r"bodies.0.spacing: gives 2.62e\+14 particles.*'part' is 80 x 80 x 80 "
    ) as error:
        wsph.Scene(schema=1, dim=3, run=RUN, bodies=[body])
    assert QUESTION in str(error.value)


def test_the_size_of_a_part_with_a_scale_is_said_without_the_question() -> None:
    body = {"name": "part", "material": scenes.material(), "shape": scenes.box(80.0, 80.0, 80.0), "spacing": 1e-3}
    with pytest.raises(wsph.SceneError, match=r"'part' is 80 x 80 x 80 m large$"):
        wsph.Scene(schema=1, dim=3, run=RUN, bodies=[body])


def test_a_tool_from_such_a_file_is_asked_about(tmp_path: Path) -> None:
    body = {"shape": scenes.box(1.0, 1.0, (-1.0, 0.0)), "spacing": 0.25}
    shape = from_stl(tmp_path)["shape"]
    tool = {"name": "punch", "shape": shape, "against": ["part"], "velocity": {"z": -0.01}}
    (found,) = said(body, tools=[tool])
    assert re.match(r"unlikely: tools.0.shape: 'punch' is 80 x 80 x 80 m large", found)
    assert said(body, tools=[{**tool, "shape": {**shape, "scale": 0.001}}]) == []
