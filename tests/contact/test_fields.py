"""Pressure and gap of contact in frames and results: what presses, what is near, and nothing elsewhere."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes

PRESSURE = 1e-3


def pressed(form: str, dim: int, **body: Any) -> wsph.Result:
    """A block on a fixed plane under a pressure on its top, damped until it rests."""
    top = "+y" if dim == 2 else "+z"
    normal = [0.0] * (dim - 1) + [1.0]
    block = scenes.body(scenes.cube(dim), 0.125, damping={"rate": 2.0}, **body)
    floor = {"name": "floor", "shape": {"type": "plane", "point": [0.0] * dim, "normal": normal}, "against": ["b"]}
    load = {"body": "b", "face": top, "traction": {top[1]: -PRESSURE}}
    return wsph.run(
        scenes.scene(
            block,
            run={"formulation": form, "end": 20.0, "cfl": "auto"},
            tools=[floor],
            boundary=[load],
            output={"fields": ["contact_pressure", "contact_gap"]},
        )
    )


@pytest.mark.parametrize(
    ("form", "dim", "body"),
    [("stress-points", 2, {}), ("stress-points", 3, {}), ("total-lagrangian", 2, {}), ("updated-lagrangian", 2, {"material": scenes.material("jaumann")})],
)  # fmt: skip
def test_the_pressure_is_that_of_the_load_where_it_presses(form: str, dim: int, body: dict[str, Any]) -> None:
    found = pressed(form, dim, **body).particles
    height = found["position"][:, dim - 1]
    sides = np.abs(found["position"][:, : dim - 1] - 0.5).max(1)
    low = height < 0.1
    within = low & (sides < 0.3)
    assert found["contact_pressure"][within] == pytest.approx(PRESSURE, rel=0.08)
    # Of cells the corners' forces reach further in.
    assert found["contact_pressure"][low].mean() == pytest.approx(
        PRESSURE, rel=0.12 if form == "updated-lagrangian" else 0.05
    )
    assert np.abs(found["contact_pressure"][height > 0.5]).max() < 1e-12
    assert (found["contact_gap"][within] < 0.0).all()
    assert np.isnan(found["contact_gap"][height > 0.9]).all()


def test_gaps_are_seen_before_bodies_touch() -> None:
    one, two = (scenes.body(scenes.box((x, x + 1.0), 1.0), 0.125, name) for name, x in (("a", 0.0), ("b", 1.03)))
    result = wsph.run(
        scenes.scene(one, two, run={"end": 0.02}, contact=[{"between": ["a", "b"]}], output={"fields": ["contact_gap", "contact_pressure"]})
    )  # fmt: skip
    x = result.particles["position"][:, 0]
    facing = (np.abs(x - 1.0) < 1e-9) | (np.abs(x - 1.03) < 1e-9)
    assert result.particles["contact_gap"][facing] == pytest.approx(0.03, abs=1e-12)
    assert np.isnan(result.particles["contact_gap"][x < 0.5]).all()
    assert (result.particles["contact_pressure"] == 0.0).all()


def test_scenes_without_surfaces_that_meet_have_none() -> None:
    with pytest.raises(
        wsph.SceneError, match="'contact_gap' is of bodies with contact between surfaces, ties or tools"
    ):
        scenes.block(tables={"output": {"fields": ["contact_gap"]}})
