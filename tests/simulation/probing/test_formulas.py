"""Fields by expression: what they are made of, in frames, results and probes."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from test_reduced import HEIGHT, INSIDE, LENGTH, SHEAR, STRETCH, block

import wsph
from wsph.errors import SceneError
from wsph.expressions import compile_expression, names_in
from wsph.output.view.recorded import frames, read

FIELDS = {
    "speed": {"expression": "sqrt(velocity_x^2 + velocity_y^2)", "unit": "m/s"},
    "radial": "(x*velocity_x + y*velocity_y)/sqrt(x^2 + y^2 + 1e-30)",
    "used": {"expression": "von_mises/350e6", "unit": "%"},
}


def with_fields(form: str, *probes: dict[str, Any], steps: int = 2, **more: Any) -> wsph.Scene:
    named = [{"name": f"p{k}", **probe} for k, probe in enumerate(probes)]
    return wsph.Scene(**{**block(form, steps=steps).data(), "fields": FIELDS, "probes": named, **more})


@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian", "small-strain"])
def test_frames_and_results_have_them(form: str, tmp_path: Path) -> None:
    output = {"fields": ["velocity", "stress", "von_mises", "speed", "radial", "used"], "every": 1, "formats": ["vtu"]}
    result = wsph.run(with_fields(form, output=output), tmp_path / "out")
    at, v = result.particles["position"], result.particles["velocity"]
    assert np.allclose(result.particles["speed"], np.hypot(*v.T), rtol=1e-14)
    assert np.allclose(result.particles["radial"], (at * v).sum(1) / (np.hypot(*at.T) + 1e-30), rtol=1e-12, atol=1e-9)
    assert np.allclose(result.field("used"), result.field("von_mises") / 350e6, rtol=1e-12)
    shot = read(*frames(tmp_path / "out")[-1])
    assert np.allclose(np.asarray(shot.grid.point_data["speed"]), np.hypot(*v.T), rtol=1e-12)
    assert shot.units["speed"] == "m/s"


def test_probes_have_them_at_points_and_reduced() -> None:
    probes = (
        {"at": [[0.5, 0.2], [0.25, 0.1]], "fields": ["speed", "radial", "used", "von_mises"]},
        {"where": "x > -1", "reduce": "integral", "fields": ["speed"]},
        {"where": INSIDE, "reduce": "max", "fields": ["used", "von_mises"]},
    )
    result = wsph.run(with_fields("stress-points", *probes))
    start = [STRETCH * 0.5 + SHEAR * 0.2, STRETCH * 0.25 + SHEAR * 0.1]
    found = result.probes["p0"]
    assert [found[f"speed[{k}]"][0] for k in range(2)] == pytest.approx(start, rel=1e-9)
    assert found["radial[0]"][0] == pytest.approx(start[0] * 0.5 / np.hypot(0.5, 0.2), rel=1e-9)
    assert found["used[1]"] == pytest.approx(found["von_mises[1]"] / 350e6, rel=1e-12)
    middle = STRETCH * 0.5 * LENGTH + SHEAR * 0.5 * HEIGHT
    assert result.probes["p1"]["speed"][0] == pytest.approx(LENGTH * HEIGHT * middle, rel=1e-12)
    assert result.probes["p2"]["used"] == pytest.approx(result.probes["p2"]["von_mises"] / 350e6, rel=1e-12)
    units = result.summary["units"]["probes"]
    assert (units["p0"]["speed[0]"], units["p1"]["speed"], units["p2"]["used"]) == ("m/s", "m/s m2", "%")


def test_names_of_an_expression_are_those_that_it_does_not_have_itself() -> None:
    assert names_in("sqrt(velocity_x^2) + pi*x - min(stress_xx, t)") == ("stress_xx", "velocity_x")
    made = compile_expression("2*a + b*x", ("a", "b"))
    assert made(np.array([[3.0], [4.0]]), values=[np.array([1.0, 2.0]), np.array([10.0, 20.0])]).tolist() == [
        32.0,
        84.0,
    ]


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"speed": "sqrt(velocity_x^2 + velocty_y^2)"}, "fields.speed: no scalar field is named 'velocty_y'; did you mean 'velocity_y'"),
    ({"speed": "2*x"}, "fields.speed: '2\\*x' names no field; there is"),
    ({"von_mises": "2*pressure"}, "'von_mises' is the name of a field or of an expression already"),
    ({"later": "t*velocity_x"}, "uses t: a field is of the state alone"),
    ({"speed": {"expression": "velocity_x", "unit": "knots"}}, "unknown unit 'knots'"),
    ({"speed": "velocity"}, "no scalar field is named 'velocity'; did you mean 'velocity_"),
    ({"deep": "velocity_x*z"}, "uses z, which a scene of dim = 2 does not have"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "message"), WRONG)
def test_what_is_no_formula_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        wsph.Scene(**{**block("stress-points").data(), "fields": given})


def test_fields_of_different_places_are_not_reduced_together() -> None:
    fields = {"power": {"expression": "velocity_x*stress_xx", "unit": "W/m2"}}
    probe = {"name": "p", "where": "x > -1", "reduce": "max", "fields": ["power"]}
    data = {**block("stress-points").data(), "fields": fields, "probes": [probe]}
    with pytest.raises(SceneError, match="stand at particles and inside of cells: name points with `at`"):
        wsph.compose(wsph.Scene(**data))
