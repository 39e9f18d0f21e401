"""Bodies in steps of a cell: what of their shapes is lost, or has another size, is said before a run."""

import warnings
from pathlib import Path
from typing import Any

import pytest

import wsph
from examples.bracket import write_stl
from tests import scenes
from tests.geometry.test_stl import cube_triangles
from tests.scenes import body, box, held, scene


def said(made: wsph.Scene) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wsph.compose(made)
    skipped = ("spurious modes", "nothing moves")
    return [text for each in caught if not any(skip in (text := str(each.message)) for skip in skipped)]


def plate(radius: float, **keys: Any) -> dict[str, Any]:
    shapes = [box(1.0, 1.0), {"type": "disc", "name": "hole", "center": [0.5, 0.5], "radius": radius}]
    return body({"type": "difference", "shapes": shapes}, 0.1, surface="stairs", **keys)


@pytest.mark.parametrize(("radius", "part"), [(0.1, "1.14"), (0.15, "0.759")])
def test_a_hole_of_few_cells_is_said_with_the_part_of_its_area(radius: float, part: str) -> None:
    (found,) = said(scene(plate(radius)))
    assert found.startswith(f"unlikely: bodies.0.spacing: in steps of a cell 'hole' has {part} of its area: choose")
    assert said(scene(plate(0.25))) == []


@pytest.mark.parametrize("formulation", ["total-lagrangian", "stress-points", "updated-lagrangian"])
def test_a_hole_of_a_cell_is_gone(formulation: str) -> None:
    run = {"formulation": formulation, "cfl": 0.2}
    found = said(scene(plate(0.045), run=run))
    assert any(
        "bodies.0.spacing: 'hole' of body 'b' is gone: no cell side stands for it in steps of 0.1 m" in each
        for each in found
    )
    with pytest.raises(
        wsph.SceneError, match=r"boundary.0.patch: 'b' has no patch 'hole': it has .*; no side of a cell stands for"
    ):
        wsph.compose(scene(plate(0.045), run=run, boundary=[{"body": "b", "patch": "hole", "fixed": ["x"]}]))


def test_a_ball_of_six_cells_has_another_volume_than_one_of_twenty() -> None:
    ball = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 0.5}
    found = said(scene(body(ball, 1.0 / 6.0, surface="stairs")))
    assert any("body 'b' has 1.2 of its volume: choose a smaller spacing" in each for each in found)
    assert said(scene(body(ball, 0.05, surface="stairs"))) == []


@pytest.mark.parametrize(
    ("load", "key"), [({"traction": {"y": 1e-3}}, "traction"), ({"spring": {"stiffness": 1e-3}}, "spring")]
)
def test_a_load_per_area_on_stairs_is_said_to_be_too_large(load: dict[str, Any], key: str) -> None:
    """The sides of the stairs of an arc of 120 degrees are 1.3 times as long as the arc."""
    entry = {"body": "b", "where": "x > 0.5", **load}
    made = scene(
        body({"type": "disc", "center": [0.0, 0.0], "radius": 1.0}, 1.0 / 16.0, surface="stairs"), boundary=[entry]
    )
    (found,) = said(made)
    assert "unlikely: boundary.0." + key in found
    assert "have 1.31 times the area of the surface of body 'b' that they follow" in found
    assert ("force = { ... } gives a resultant that is exact" in found) == (key == "traction")


def test_a_pressure_on_stairs_and_a_load_on_a_flat_face_of_them_are_not() -> None:
    hole = {"body": "b", "patch": "hole", "pressure": 1e-3}
    assert said(scene(plate(0.25), boundary=[held("-x", 2), hole])) == []
    assert (
        said(scene(plate(0.25), boundary=[held("-x", 2), {"body": "b", "face": "+x", "traction": {"y": 1e-3}}])) == []
    )


def test_a_probe_on_a_face_of_a_part_in_stairs_is_of_the_part(tmp_path: Path) -> None:
    write_stl(tmp_path / "part.stl", cube_triangles())
    shape = {"type": "stl", "file": str(tmp_path / "part.stl")}
    made = {"name": "b", "shape": shape, "spacing": 0.25, "surface": "stairs", "material": scenes.material()}
    run = {"integrator": "leapfrog", "end": 1.0, "cfl": 0.3}
    for place in ([1.0, 0.5, 0.5], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]):
        probes = [{"name": "end", "at": [place], "fields": ["displacement"]}]
        wsph.compose(wsph.Scene(schema=1, dim=3, run=run, bodies=[made], probes=probes))


def test_a_probe_outside_is_told_what_cells_and_shape_reach() -> None:
    disc = body({"type": "disc", "center": [0.0, 0.0], "radius": 1.03}, 0.25, surface="stairs")
    words = r"'b' reaches from \[-1.*\] to \[1.*\] m with its cells, and its shape from \[-1.03, -1.03\] to \[1.03, 1.03\] m"
    with pytest.raises(wsph.SceneError, match=words):
        wsph.compose(scene(disc, probes=[{"name": "out", "at": [[1.4, 0.0]], "fields": ["displacement"]}]))
