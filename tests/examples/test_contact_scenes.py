"""Scenes of contact, shorter than their examples: what a ball leaves, what an indenter needs, what a stack bears."""

from typing import Any

import numpy as np
import pytest

import wsph
from wsph.validation.case import example

WEIGHT = 1200.0 * 9.81 * 0.06 * 0.02
"""Of a block of the stack [N/m]."""


def test_a_ball_dents_a_plate_and_comes_back_slower() -> None:
    result = wsph.run(
        example("ball_on_plate").with_(**{"bodies.1.spacing": "1 mm", "bodies.0.spacing": "1 mm", "output.every": None})
    )
    ball = result.particles["body"] == 0
    assert 0.0 < result.field("velocity_z")[ball].mean() < 6.0
    plate = result.particles["plastic_strain"][~ball]
    assert 0.005 < plate.max() < 0.3
    energy = result.summary["energy"]
    assert energy["dissipated"] > 0.5 * energy["external_work"]
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    # No energy comes from contact.
    assert result.history["contact_numerical"].min() > -5e-3 * energy["external_work"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*spurious modes")  # a tip on few cells
def test_an_indenter_meets_the_hardness_of_copper() -> None:
    """Load over the projected area of a Vickers pyramid is about three times the flow stress (Tabor 1951); coarse cells and
    a fast tool make it more."""
    made = example("indentation").with_(**{"bodies.0.spacing": "0.1 mm", "output.every": None, "run.end": "36 us"})
    result = wsph.run(made)
    history = result.history
    depth, load = 1e-3 * 0.16, abs(history["tool_indenter_z"][-20:].mean())
    area = (2.0 * (0.02e-3 + depth * np.tan(np.deg2rad(68.0)))) ** 2
    assert 2.0 < load / area / 250e6 < 7.0
    assert abs(result.summary["energy"]["residual"]) < 5e-3 * result.summary["energy"]["external_work"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*spurious modes")  # a stack of few cells that settles
def test_a_stack_stands() -> None:
    """Ten blocks settle on each other without the hammer: the ground bears their weight, none goes aside."""
    data: dict[str, Any] = example("stack").data()
    data["tools"] = data["tools"][:1]
    for body in data["bodies"]:
        body |= {"spacing": "10 mm", "damping": {"rate": 60.0}}
    data["run"]["end"] = "0.25 s"
    data["output"] = {"history": 100}
    result = wsph.run(wsph.Scene(**data))
    history = result.history
    late = history["time"] > 0.2
    assert history["tool_ground_y"][late].mean() == pytest.approx(10.0 * WEIGHT, rel=0.01)
    assert np.abs(result.field("velocity_x")).max() < 2e-3
    assert np.abs(history["tool_ground_x"][late]).max() < 1e-3 * WEIGHT
