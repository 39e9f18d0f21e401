"""Functions that are tables in time and place: what they are, and loads and motions by them."""

from typing import Any

import numpy as np
import pytest

import wsph
from wsph.boundary.programs.functions import Function
from wsph.errors import SceneError

T, Y = (0.0, 1e-3, 4e-3), (0.0, 0.1, 0.4)
ROWS = ((0.0, 0.0, 0.0), (1.0, 3.0, -2.0), (5.0, 1.0, 0.5))


def bilinear(y: np.ndarray, t: float) -> np.ndarray:
    """Linear between times and places, constant beyond."""
    row = np.array([np.interp(t, T, column) for column in zip(*ROWS, strict=True)])
    return np.interp(y, Y, row)


def test_a_table_in_time_and_place_is_bilinear_and_constant_beyond() -> None:
    made = Function(t=T, y=Y, value=ROWS).program
    assert made is not None
    y = np.linspace(-0.1, 0.6, 57)
    position = np.stack([np.zeros_like(y), y], 1)
    for t in (-1.0, 0.0, 2e-4, 1e-3, 2.7e-3, 4e-3, 1.0):
        assert np.allclose(made(position, t), bilinear(y, t), rtol=1e-13, atol=1e-13)


def scene(boundary: dict[str, Any], function: dict[str, Any]) -> wsph.Scene:
    body = {
        "name": "block",
        "shape": {"type": "box", "min": [0.0, 0.0], "max": [0.4, 0.4]},
        "spacing": 0.05,
        "state": "strain",
        "material": {"model": "elastic", "density": 1000.0, "youngs_modulus": 1e7, "poisson_ratio": 0.25},
    }
    run = {"integrator": "leapfrog", "end": 2.5e-3, "cfl": 0.5}
    entry = {"body": "block", "face": "-x", **boundary}
    return wsph.Scene(schema=1, dim=2, run=run, bodies=[body], functions={"f": function}, boundary=[entry])


TABLE = {"t": list(T), "y": list(Y), "value": [list(row) for row in ROWS]}


def test_particles_move_by_it() -> None:
    result = wsph.run(scene({"velocity": {"x": "f"}}, TABLE))
    held = result.particles["position"][:, 0] == 0.0
    y = result.particles["position"][held, 1]
    assert np.allclose(result.particles["velocity"][held, 0], bilinear(y, result.time), rtol=1e-9)


def test_a_traction_by_it_is_the_traction_of_the_same_expression() -> None:
    """A table that is linear in both is an expression: the motion is the same to rounding."""
    linear = {"t": [0.0, 1e-2], "y": [0.0, 0.4], "value": [[0.0, 0.0], [0.0, 4e6]]}
    ours = wsph.run(scene({"traction": {"x": "f"}}, linear)).particles["velocity"]
    theirs = wsph.run(scene({"traction": {"x": "f"}}, {"expression": "1e9*t*y"})).particles["velocity"]
    assert np.abs(ours).max() > 0.1
    assert np.allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"t": [0.0, 1.0], "y": [0.0, 1.0], "value": [0.0, 1.0]}, "value has a row for every t, each with a number for every entry of y: 2"),
    ({"t": [0.0, 1.0], "y": [0.0, 1.0], "value": [[0.0], [1.0]]}, "value has a row for every t"),
    ({"t": [0.0, 1.0], "value": [[0.0], [1.0]]}, "value has rows: name the places of their columns"),
    ({"t": [0.0, 1.0], "y": [1.0, 0.0], "value": [[0.0, 1.0], [1.0, 1.0]]}, "y must increase from entry to entry"),
    ({"t": [0.0, 1.0], "x": [0.0, 1.0], "y": [0.0, 1.0], "value": [[0.0, 1.0]] * 2}, "of the time and of one of x, y and z"),
    ({"t": [0.0, 1.0], "y": [0.0, 1.0], "interp": "step", "value": [[0.0, 1.0]] * 2}, "is of a table of the time alone"),
    ({"t": list(range(30)), "y": list(range(20)), "value": [[0.0] * 20] * 30}, "has 600 values; at most 400"),
    ({"expression": "t", "y": [0.0, 1.0]}, "y goes with a table"),
    ({"t": [0.0, 1.0], "z": [0.0, 1.0], "value": [[0.0, 1.0]] * 2}, "uses z, which a scene of dim = 2 does not have"),
]  # fmt: skip


@pytest.mark.parametrize(("function", "message"), WRONG)
def test_what_is_no_such_table_is_refused(function: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene({"velocity": {"x": "f"}}, function)


def test_values_with_units_are_those_in_si() -> None:
    plain = Function(t=[0.0, 1.0], value=[0.0, -5e6])
    given = Function(t=[0.0, "1 s"], value=["0 MPa", "-5 MPa"])
    assert given.column == plain.column == given.within("Pa").column == (0.0, -5e6)
    assert given.at(0.5) == -2.5e6
    rows = Function(t=[0.0, 1.0], x=[0.0, "1 m"], value=[[0.0, "1 MPa"], ["2 bar", 3.0]])
    assert rows.rows == rows.within("Pa").rows == ((0.0, 1e6), (2e5, 3.0))
    with pytest.raises(ValueError, match="'-5 MPa' is not in units of m"):
        Function(t=[0.0, 1.0], value=[0.0, "-5 MPa"]).within("m")


@pytest.mark.parametrize("key", ["traction", "velocity", "displacement", "acceleration", "stress"])
def test_every_key_takes_tables_with_units(key: str) -> None:
    unit, component = {"velocity": ("m/s", "y"), "displacement": ("m", "y"), "acceleration": ("m/s2", "y"),
                       "traction": ("Pa", "y"), "stress": ("Pa", "xx")}[key]  # fmt: skip
    made = scene({key: {component: "f"}}, {"t": [0.0, 1e-5], "value": [f"0 {unit}", f"-2 {unit}"]})
    assert made.value("f", unit) == Function(t=[0.0, 1e-5], value=[0.0, -2.0])
