"""The share of rows that follow from the lattice, as `wsph check` tells it, and the steps of what it tells of."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lattice.test_rows import CELL, FITTED
from wsph.checking import described
from wsph.simulation.compose import compose

BODIES: dict[str, tuple[dict[str, Any], float, dict[str, Any], tuple[float, float]]] = {
    # Beside a fitted surface up to six layers of cells are no boxes: of a sphere of 16 cells at least (10/16)^3 are, of a
    # plate of 40 by 80 cells with a hole and a notch about half.
    "box": (scenes.box(1.0, 0.5, 0.5), 0.1, {}, (100.0, 100.0)),
    "turned box": (scenes.box(1.0, 0.5, 0.5) | {"rotate": [[1.0, 2.0, 3.0], 40.0]}, 0.1, {}, (100.0, 100.0)),
    "turned lattice": (scenes.box(1.0, 2.0), CELL, {"lattice_rotate": 30.0}, (100.0, 100.0)),
    "sphere": (*FITTED["sphere"], {}, (24.0, 80.0)),
    "plate with a hole and a notch": (*FITTED["turned plate with a hole and a notch"], {}, (40.0, 98.0)),
    "jittered": (scenes.box(1.0, 1.0), CELL, {"jitter": 0.2}, (0.0, 0.0)),
}
"""Shapes, spacings, further keys, and between what [%] the share lies."""


def scene_of(name: str) -> wsph.Scene:
    shape, spacing, keys, _ = BODIES[name]
    dim = len(shape["min"]) if shape["type"] == "box" else 3 if "sphere" in name else 2
    keys = keys | {"velocity": ["1e-3*sin(3*y)", "1e-3*x*y", "1e-3*z"][:dim]}
    run = {"formulation": "stress-points", "guard": "off", "cfl": 0.2, "end": 3 * 0.2 * spacing}
    return scenes.scene(scenes.body(shape, spacing, **keys), run=run)


LISTED = {
    "ul-tsph": ("updated-lagrangian", "its gradients follow the motion"),
    "leapfrog": ("updated-lagrangian", "its pairs follow the motion"),
}
"""What integrators have lists for, in their forms."""


@pytest.mark.parametrize("integrator", list(LISTED))
def test_forms_that_have_lists_alone_say_why(integrator: str) -> None:
    formulation, why = LISTED[integrator]
    run = {"integrator": integrator, "formulation": formulation, "guard": "off", "cfl": 0.2, "end": 1.0}
    said = dict(described(scenes.scene(scenes.body(scenes.box(1.0, 1.0), 0.1), run=run), "a scene"))["  rows"]
    assert said == f"0 % follow from the lattice, without lists of pairs: {why}"


TWO_SETS: dict[str, tuple[dict[str, Any], dict[str, Any], int, str]] = {
    "even": ({}, {}, 81, ""),
    "with a crack": ({"cracks": [{"from": [0.0, 0.5], "to": [0.3, 0.5]}]}, {}, 79, ""),
    "a wide support": ({}, {"support": 1.8}, 0, ": its particles see more than the nearest of the other set"),
    "jittered": ({"jitter": 0.1}, {}, 0, ": its cells differ"),
}
"""Keys of a body of two sets, keys of its run, its share of rows [%] and the reason that is said where there are none."""


@pytest.mark.parametrize("name", list(TWO_SETS))
def test_two_sets_say_what_they_have_lists_for(name: str) -> None:
    keys, run, share, why = TWO_SETS[name]
    run = {"integrator": "tsph", "guard": "off", "cfl": 0.2, "end": 1.0, **run}
    said = dict(described(scenes.scene(scenes.body(scenes.box(1.0, 1.0), 0.05, **keys), run=run), "a scene"))["  rows"]
    assert said == f"{share} % follow from the lattice, without lists of pairs{why}"


def test_a_short_bar_of_two_sets_has_lists() -> None:
    run = {"integrator": "tsph", "guard": "off", "cfl": 0.2, "end": 1.0}
    said = dict(described(scenes.bar(40, run=run), "a scene"))["  rows"]
    assert said == "0 % follow from the lattice, without lists of pairs: too small for rows to pay"


@pytest.mark.parametrize(
    "keys", [{"run": {"support": 1.8}}, {"phase_field": {"fracture_energy": 1e-3, "length": 0.25}}]
)
def test_stress_points_say_what_they_have_lists_for(keys: dict[str, Any]) -> None:
    run = {"formulation": "stress-points", "guard": "off", "cfl": 0.2, "end": 1.0, **keys.get("run", {})}
    parts = {name: each for name, each in keys.items() if name != "run"}
    said = dict(described(scenes.scene(scenes.body(scenes.box(1.0, 1.0), 0.1, **parts), run=run), "a scene"))["  rows"]
    why = "phase_field" if parts else "its points see more than their own corners"
    assert said == f"0 % follow from the lattice, without lists of pairs: {why}"


@pytest.mark.parametrize("name", list(BODIES))
def test_the_share_is_told_and_what_is_told_of_is_what_runs(name: str) -> None:
    scene = scene_of(name)
    said = dict(described(scene, "a scene"))["  rows"]
    share = float(said.split()[0])
    print(f"{name}: {said}")
    low, high = BODIES[name][3]
    assert low <= share <= high
    composition = compose(scene)
    system = composition.bodies[0].system
    assert share == round(100.0 * system.regular)
    composition.compile()
    composition.program.run(composition.steps)
    found = wsph.run(scene).particles
    assert np.array_equal(system.filtered("velocity") * system.scales.velocity, found["velocity"])
