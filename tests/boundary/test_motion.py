"""Prescribed displacements and accelerations: faces are where they are said to be, to rounding, with every integrator and in
every form; rates of expressions are their derivatives; what cannot be is refused by name."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests.scenes import bar, body, box, held, scene
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.rates import rate_of
from wsph.expressions import compile_expression
from wsph.simulation.compose import compose

KNOTS, VALUES = [0.0, 0.33, 1.0, 2.0], [0.0, 0.02, -0.01, 0.0]
TABLE = {"t": KNOTS, "value": VALUES}
METHODS = [
    ("leapfrog", "stress-points"), ("leapfrog", "total-lagrangian"), ({"name": "leapfrog", "lagged": True}, "stress-points"),
    ("rk4", "stress-points"), ("kg4-8", "total-lagrangian"), ("blanes-moan4", "stress-points"), ("tsph", "small-strain"),
    ("ul-tsph", "updated-lagrangian"),
]  # fmt: skip


def integrals(value: str, end: float) -> tuple[float, float]:
    """The integral of an acceleration up to a time, and that of the integral."""
    if value != "f":
        return 0.06 * np.sin(5.0 * end), 0.012 * (1.0 - np.cos(5.0 * end))
    inner = [knot for knot in KNOTS if 0.0 < knot < end]
    roots, weights = np.polynomial.legendre.leggauss(3)
    gain = way = 0.0
    for low, high in zip([0.0, *inner], [*inner, end], strict=True):
        t = 0.5 * (low + high) + 0.5 * (high - low) * roots
        a = 0.5 * (high - low) * weights * np.interp(t, KNOTS, VALUES)
        gain, way = gain + a.sum(), way + (a * (end - t)).sum()
    return gain, way


def asked(key: str, value: str, t: float) -> tuple[float, float]:
    """Velocity and displacement of what a scene prescribes."""
    if key == "acceleration":
        return integrals(value, t)
    if value == "f":
        k = int(np.searchsorted(KNOTS, t)) - 1
        return (VALUES[k + 1] - VALUES[k]) / (KNOTS[k + 1] - KNOTS[k]), float(np.interp(t, KNOTS, VALUES))
    return 0.06 * np.sin(3.0 * t) * np.cos(3.0 * t), 0.01 * np.sin(3.0 * t) ** 2


CASES = [("displacement", "f"), ("acceleration", "f"), ("displacement", "0.01*sin(3*t)^2"), ("acceleration", "0.3*cos(5*t)")]  # fmt: skip


def moved(integrator: Any, formulation: str, key: str, value: str, **run: Any) -> wsph.Scene:
    """A block held on the left whose right face moves along x."""
    entries = [{"body": "b", "face": "+x", key: {"x": value}, "fixed": ["y"]}, held("-x", 2)]
    keys = {"integrator": integrator, "formulation": formulation, "end": 1.3, **run}
    block = body(box((-0.5, 0.5), (-0.2, 0.2)), 0.1)
    output = {"fields": ["displacement", "velocity"]}
    return scene(block, run=keys, functions={"f": TABLE}, boundary=entries, output=output)


@pytest.mark.parametrize(("key", "value"), CASES)
@pytest.mark.parametrize(("integrator", "formulation"), METHODS)
@pytest.mark.parametrize("precision", ["f64", "f32"])
# A face that jumps to a velocity in one step does work that few cells do not resolve; two-set forms lose energy.
@pytest.mark.filterwarnings("ignore:.*energy was")
def test_a_face_is_where_it_is_said_to_be(
    integrator: Any, formulation: str, key: str, value: str, precision: str
) -> None:
    result = wsph.run(moved(integrator, formulation, key, value, precision=precision))
    on = result.particles["position"][:, 0] > 0.49
    velocity, displacement = asked(key, value, float(result.history["time"][-1]))
    assert on.sum() == 5
    rounding = 1e-15 if precision == "f64" else 3e-7
    assert result.particles["displacement"][on, 0] == pytest.approx(displacement, rel=rounding, abs=1e-2 * rounding)
    assert result.particles["velocity"][on, 0] == pytest.approx(velocity, rel=10.0 * rounding, abs=1e-1 * rounding)


@pytest.mark.parametrize(("key", "value"), CASES)
@pytest.mark.parametrize("integrator", ["leapfrog", "rk4"])
def test_a_wall_is_where_it_is_said_to_be(integrator: str, key: str, value: str) -> None:
    made = compose(moved(integrator, "updated-lagrangian", key, value))
    system = made.bodies[0].system
    for _ in range(40):
        made.program.step()
    velocity, displacement = asked(key, value, 40.0 * made.dt)
    way, speed = system.state.read("wall")[0, 0], system.state.read("wall_velocity")[0, 0]
    assert way * system.scales.length == pytest.approx(displacement, rel=1e-15, abs=1e-17)
    assert speed * system.scales.velocity == pytest.approx(velocity, rel=1e-14, abs=1e-16)


@pytest.mark.parametrize("formulation", ["stress-points", "total-lagrangian", "updated-lagrangian"])
def test_the_work_of_a_moved_face_is_the_energy_that_comes_in(formulation: str) -> None:
    result = wsph.run(moved("leapfrog", formulation, "displacement", "0.01*sin(3*t)^2", cfl=0.05))
    history = result.history
    assert np.abs(history["residual"]).max() < 1e-3 * history["external_work"].max()


def test_an_accelerated_face_goes_on_from_the_velocity_of_the_body() -> None:
    """A free body that is pulled along as fast as it flies anyway stays at rest in its own frame."""
    flying = bar(10, velocity=["0.2"], tables={"boundary": [{"body": "b", "face": "-x", "acceleration": {"x": 0.0}}]})
    result = wsph.run(flying)
    assert result.particles["velocity"][:, 0] == pytest.approx(0.2, rel=1e-14)
    assert abs(result.history["external_work"][-1] - result.history["external_work"][0]) < 1e-16


@pytest.mark.parametrize("formulation", ["stress-points", "updated-lagrangian"])
def test_resumed_motions_have_the_same_bits(formulation: str, tmp_path: Path) -> None:
    given = moved("leapfrog", formulation, "acceleration", "f")
    whole = wsph.run(given)
    kept = given.with_(**{"checkpoint": {"every": 20}, "run.end": 0.7})
    wsph.run(kept, tmp_path / "cut")
    again = wsph.run(given.with_(**{"checkpoint": {"every": 20}}), tmp_path / "cut", resume=True)
    assert np.array_equal(again.particles["displacement"], whole.particles["displacement"])
    assert again.history["external_work"][-1] == whole.history["external_work"][-1]


SMOOTH = ["sin(t*x)", "cos(2*t)", "tan(t)", "asin(t/3)", "acos(t/3)", "atan(t)", "sinh(t)", "cosh(t)", "tanh(t)", "exp(-t*x)", "log(1+t)",
          "log10(2+t)", "sqrt(1+t)", "abs(t-2)", "t^2", "t^x", "x^t", "(1+t)^(t*x)", "t/(1+x*t)", "x/t", "t*t*x", "x*(t-1)", "(t-1)-x*t", "2*t+x",
          "-t", "min(t, 0.5)", "max(t, 0.5*x)", "min(0.9, t*t)", "atan2(t, 1+t)", "(t < 2)*t", "floor(t) + t", "x"]  # fmt: skip


@pytest.mark.parametrize("text", SMOOTH)
def test_the_rate_of_an_expression_is_its_derivative(text: str) -> None:
    value, at, h = compile_expression(text), np.array([[0.7]]), 1e-5
    for t in (0.3, 0.8):
        slope = (value(at, t + h) - value(at, t - h))[0] / (2.0 * h)
        assert rate_of(value)(at, t)[0] == pytest.approx(slope, rel=1e-8, abs=1e-10)


def test_the_rate_of_a_table_is_its_slope_between_entries_and_none_beyond() -> None:
    rate = Motion("displacement", Function(t=KNOTS[1:], value=VALUES[1:])).rate
    assert isinstance(rate, Function)
    assert [rate.at(t) for t in (0.0, 0.33, 0.34, 1.0, 1.5, 2.5)] == pytest.approx([0, 0, -0.03 / 0.67, -0.03 / 0.67, 0.01, 0])  # fmt: skip


@pytest.mark.parametrize(
    ("entry", "integrator", "message"),
    [
        ({"displacement": {"x": 0.001}}, "leapfrog", r"boundary.0.displacement.x: is 0.001 m at t = 0"),
        ({"displacement": {"x": 0.001}}, "tsph", r"boundary.0.displacement.x: is 0.001 m at t = 0"),
        ({"displacement": {"x": "f"}}, "leapfrog", r"boundary.0.displacement.x: a displacement cannot jump"),
        ({"displacement": {"x": "1 m/s"}}, "leapfrog", r"boundary.0.displacement.x"),
        ({"acceleration": {"z": "1"}}, "leapfrog", r"boundary.0.acceleration.z: is none of x, y"),
        ({"displacement": {"x": "t"}, "velocity": {"x": "1"}}, "leapfrog", "'x' is prescribed twice: give one of"),
        ({"displacement": {"x": "t"}, "fixed": ["x"]}, "leapfrog", "'x' is prescribed twice: by fixed"),
        ({"displacement": {"x": "t"}, "normal": 0.0}, "leapfrog", "boundary.0.normal: goes with no other velocity"),
        ({"displacement": {"x": "t*t"}}, "lf4", "velocities held at zero"),
    ],
)
def test_what_cannot_be_is_refused_by_name(entry: dict[str, Any], integrator: str, message: str) -> None:
    step = {"f": {"t": [0.0, 1.0], "value": [0.0, 1.0], "interp": "step"}}
    with pytest.raises(wsph.SceneError, match=message):
        compose(
            scene(
                body(box((-0.5, 0.5), (-0.2, 0.2)), 0.1),
                run={"integrator": integrator},
                functions=step,
                boundary=[{"body": "b", "face": "+x", **entry}],
            )
        )


def test_a_wall_of_a_body_that_flies_is_not_accelerated() -> None:
    given = moved("leapfrog", "updated-lagrangian", "acceleration", "1").with_(**{"bodies.0.velocity": [0.1, 0.0]})
    with pytest.raises(wsph.errors.Refused, match="begins at rest"):
        compose(given)


def test_displacements_and_normals_meet_at_no_particle() -> None:
    entries = [{"body": "b", "face": "+y", "normal": 0.0}, {"body": "b", "face": "+x", "displacement": {"x": "t*t"}}]
    with pytest.raises(wsph.SceneError, match=r"boundary.0.normal: a displacement is prescribed beside it"):
        compose(scene(body(box((-0.5, 0.5), (-0.2, 0.2)), 0.1), boundary=entries))
