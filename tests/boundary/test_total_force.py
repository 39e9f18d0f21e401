"""Total forces: spread evenly over faces, with a resultant that is what was asked for, in stairs too."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import body, box, held, scene
from wsph.boundary.selections import selections
from wsph.errors import SceneError
from wsph.simulation.compose import compose

FORMS: list[dict[str, Any]] = [
    {"formulation": "stress-points"},
    {"formulation": "total-lagrangian"},
    {"formulation": "total-lagrangian", "support": 2.6},
    {"formulation": "updated-lagrangian"},
]
DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 1.0}


def impulse(made: wsph.Scene) -> np.ndarray:
    result = wsph.run(made)
    return np.array(result.summary["momentum"]) / result.time


@pytest.mark.parametrize("run", FORMS, ids=str)
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_the_momentum_of_a_free_block_is_its_impulse(dim: int, run: dict[str, Any]) -> None:
    sides = [1.0, 0.5, 0.25][:dim]
    given = {axis: 1e-3 * (k + 1) for k, axis in enumerate("xyz"[:dim])}
    block = body(box(*sides), 0.125 if dim == 2 else 0.0625 if dim == 1 else 0.125)
    made = scene(block, run={**run, "cfl": 0.2, "end": 0.1}, boundary=[{"body": "b", "face": "+x", "force": given}])
    np.testing.assert_allclose(impulse(made), list(given.values()), rtol=1e-9)


TURNED: list[dict[str, Any]] = [
    {"spacing": [0.1, 0.13], "shape": box(1.0, 1.3) | {"rotate": 25.0}, "state": "stress"},
    {
        "spacing": 0.045,
        "shape": {
            "type": "difference",
            "shapes": [box(1.0, 2.0) | {"rotate": 20.0}, DISC | {"center": [0.5, 1.0], "radius": 0.3}],
        },
        "state": "stress",
    },
    {"spacing": [0.1, 0.13, 0.16], "shape": box(0.5, 0.65, 0.8) | {"rotate": [[1.0, 2.0, 3.0], 35.0]}},
    {"spacing": 0.1, "shape": {"type": "sphere", "center": [0.0] * 3, "radius": 0.4}},
]
"""Turned, fitted and round bodies of unequal cells, in plane stress and in space."""


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("run", FORMS[:2], ids=str)
@pytest.mark.parametrize(
    "keys", TURNED, ids=lambda keys: f"{keys['shape']['type']}-{len(np.atleast_1d(keys['spacing']))}"
)
def test_the_momentum_of_turned_and_round_bodies_is_their_impulse(
    keys: dict[str, Any], run: dict[str, Any], precision: str
) -> None:
    dim = 2 if "state" in keys else 3
    given = {axis: 1e-3 * (k + 1) for k, axis in enumerate("xyz"[:dim])}
    free = body(keys["shape"], **{key: value for key, value in keys.items() if key != "shape"})
    entry = {"body": "b", "where": "x > 0.2", "force": given}
    made = scene(free, run={**run, "precision": precision, "cfl": 0.2, "end": 0.1}, boundary=[entry])
    within = 1e-9 if precision == "f64" else 1e-4
    np.testing.assert_allclose(impulse(made), list(given.values()), rtol=within)


@pytest.mark.parametrize("run", FORMS[:3], ids=str)
def test_its_resultant_is_exact_in_stairs_where_that_of_a_traction_is_not(run: dict[str, Any]) -> None:
    """Of an arc of 120 degrees of a circle of radius 1, 2 pi/3 long."""
    disc = body(DISC, 0.125, surface="stairs")
    keys = {"run": {**run, "cfl": 0.2, "end": 0.05}}
    entry = {"body": "b", "where": "x > 0.5"}
    whole = impulse(scene(disc, boundary=[{**entry, "force": {"y": -1e-3}}], **keys))
    np.testing.assert_allclose(whole, [0.0, -1e-3], atol=1e-12)
    spread = impulse(scene(disc, boundary=[{**entry, "traction": {"y": -1e-3 / (2.0 * np.pi / 3.0)}}], **keys))
    assert spread[1] < -1.15e-3


def test_it_is_a_traction_of_its_part_of_the_area() -> None:
    """The same motion as by the traction, to rounding."""
    end = {"body": "b", "face": "+x"}
    made = [scene(body(box(1.0, 0.25), 0.125), run={"end": 0.5}, boundary=[held("-x", 2), {**end, **load}])
            for load in ({"force": {"y": 1e-3}}, {"traction": {"y": 4e-3}})]  # fmt: skip
    one, other = (wsph.run(each).particles["velocity"] for each in made)
    assert np.abs(one).max() > 0.0
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * np.abs(one).max())


def test_units_tables_and_steps_in_time() -> None:
    table = {"t": [0.0, "1 s"], "value": ["0 kN", "-2 kN"]}
    entry = {"name": "load", "body": "b", "face": "+x", "force": {"y": "push"}}
    made = scene(body(box(1.0, 1.0, 1.0), 0.5), run={"end": 1.0}, functions={"push": table}, boundary=[entry])
    system = compose(made).bodies[0].system
    (selected,) = selections(made, "b", system.geometry, system.position, made.end)
    np.testing.assert_allclose(selected.resultant, [0.0, -2000.0, 0.0])
    assert "resultant (0, -2000, 0) N at t = 1 s" in str(selected)
    flat = scene(body(box(1.0, 0.25), 0.125), boundary=[{"body": "b", "face": "+x", "force": {"y": "2 N/mm"}}])
    system = compose(flat).bodies[0].system
    (selected,) = selections(flat, "b", system.geometry, system.position, flat.end)
    assert "resultant (0, 2000) N/m" in str(selected)


@pytest.mark.parametrize(("dim", "entry", "message"), [
    (3, {"face": "+x", "force": {"y": 1.0}, "traction": {"z": 1.0}}, r"boundary.0: force is a total one, and traction one per area"),
    (3, {"face": "+x", "force": {"y": "2 MPa"}}, r"boundary.0.force.y: .*'2 MPa' is not in units of N"),
    (2, {"face": "+x", "force": {"y": "2 kN"}}, r"boundary.0.force.y: .*not in units of N/m: in 2D a force is per metre of depth"),
    (2, {"face": "+x", "force": {"z": 1.0}}, r"boundary.0.force.z: is none of x, y"),
    (2, {"face": "+x", "force": {"y": "1e3*y"}}, r"boundary.0.force.y: '1e3\*y' depends on the place; a total force is spread evenly"),
    (2, {"face": "+x", "traction": {"y": "2 kN"}}, r"a force is spread over an area, as in N/mm2; force = \{ ... \} of a boundary takes it whole"),
    (2, {"face": "+x", "force": {"y": 1.0}, "fixed": ["y"]}, r"boundary.0.force.y: the velocity y is prescribed too"),
    (2, {"where": "(x > 0.4) and (x < 0.6) and (y > 0.4) and (y < 0.6)", "force": {"y": 1.0}}, r"boundary.0.force.y: acts on no face selected here; inside of a body write \[bodies.body_force\]"),
])  # fmt: skip
def test_what_is_no_total_force_is_refused(dim: int, entry: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        compose(scene(body(box(*[1.0] * dim), 0.125), boundary=[{"body": "b", **entry}]))


@pytest.mark.parametrize("integrator", ["tsph", "ul-tsph"])
def test_two_sets_refuse_it_with_what_they_take(integrator: str) -> None:
    made = scene(
        body(box(1.0, 1.0), 0.125),
        run={"integrator": integrator, "cfl": 0.5},
        boundary=[{"body": "b", "face": "+x", "force": {"y": 1.0}}],
    )
    with pytest.raises(
        SceneError, match=r"boundary.0.force: two-set bodies prescribe stress on their faces: write stress"
    ):
        compose(made)
