"""Patches by name of bodies whose surface is in stairs."""

import numpy as np
import pytest

from tests import scenes
from wsph.geometry.lattice import lattice

PLATE = {"type": "difference", "shapes": [
    {**scenes.box(1.0, 1.0), "name": "plate"}, {"type": "disc", "name": "hole", "center": [0.5, 0.5], "radius": 0.2}]}  # fmt: skip


@pytest.mark.parametrize("turn", [0.0, 90.0, 37.0])
def test_every_face_is_of_one_patch(turn: float) -> None:
    """The hole has its own stairs, the sides theirs, however the shape is turned."""
    body = lattice(scenes.shape(**PLATE, rotate=turn), 0.05)
    patches = body.faces.patches
    assert set(patches) == {"hole", *(f"plate/{side}" for side in ("-x", "+x", "-y", "+y"))}
    assert sorted(np.concatenate(list(patches.values()))) == list(range(len(body.faces.cell)))
    for side in ("-x", "+x", "-y", "+y"):
        assert body.faces.area[patches[f"plate/{side}"]].sum() == pytest.approx(1.0)
        np.testing.assert_array_equal(body.faces.named(side), body.faces.of_patch(f"plate/{side}"))
    middles = body.nodes[body.faces.nodes[patches["hole"]]].mean(1)
    assert np.linalg.norm(middles - 0.5, axis=1).max() < 0.2 + 0.05


def test_a_box_has_its_sides() -> None:
    body = lattice(scenes.shape(**scenes.cube(3)), 0.25)
    assert {name: len(rows) for name, rows in body.faces.patches.items()} == dict.fromkeys(
        ("-x", "+x", "-y", "+y", "-z", "+z"), 16
    )


@pytest.mark.parametrize("angle", [10.0, 30.0, 45.0])
def test_sides_of_a_turned_lattice_have_the_area_of_the_side(angle: float) -> None:
    """To the corner that a step cuts off; the whole outline closes as before."""
    body = lattice(scenes.shape(**scenes.box(1.0, 0.4)), 0.02, lattice_rotate=angle)
    faces = body.sides
    for side, area in (("-x", 0.4), ("+x", 0.4), ("-y", 1.0), ("+y", 1.0)):
        assert faces.area[faces.named(side)].sum() == pytest.approx(area, abs=0.02)
    assert np.abs(faces.vector.sum((0, 1))).max() < 1e-12
    straight = lattice(scenes.shape(**scenes.box(1.0, 0.4)), 0.02)
    assert straight.sides is straight.faces
