"""Hourglass control and artificial stress on the one-set total-Lagrangian form."""

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose


def block(**body: object) -> wsph.Scene:
    """A free block that spins and stretches."""
    data = {"name": "b", "shape": {"type": "box", "min": [-0.5, -0.5], "max": [0.5, 0.5]}, "spacing": 0.1, "state": "strain",
            "velocity": ["-0.1*y + 0.05*x", "0.1*x"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}, **body}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": 4.0, "cfl": 0.5}
    return wsph.Scene(schema=1, dim=2, run=run, bodies=[data])


@pytest.mark.parametrize("part", [{"hourglass": {"coefficient": 0.1}}, {"artificial_stress": {}}], ids=str)
def test_their_work_is_on_the_ledger(part: dict) -> None:
    result = wsph.run(block(**part))
    energy, history = result.summary["energy"], result.history
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]
    assert np.abs(history["hourglass"]).max() > 0.0
    assert np.abs(history["momentum_x"]).max() < 1e-15


def checkered(**body: object) -> float:
    """Acceleration of a field that alternates from particle to particle, over that of the residual form."""
    composition = compose(block(spacing=0.04, **body))
    system = composition.bodies[0].system
    sign = (-1.0) ** np.rint(system.grid_index).sum(1)
    system.state.write("displacement", 1e-6 * sign[:, None] * [1.0, 0.0])
    out = system.new()
    system.rate(system.state, out, "velocity")
    inside = np.abs(system.position).max(1) < 0.2
    return float(np.abs(out.read("velocity")[inside]).max())


def test_hourglass_control_holds_what_a_gradient_does_not_see() -> None:
    bare = checkered(hourglass=False)
    held = checkered(hourglass={"coefficient": 0.1})
    stiffer = checkered(hourglass={"coefficient": 0.2})
    assert bare < 1e-12
    assert held > 1e-8
    assert stiffer == pytest.approx(2.0 * held, rel=1e-9)


def test_hourglass_takes_the_place_of_the_residual_unless_both_are_named() -> None:
    def terms(**body: object) -> tuple[bool, bool]:
        form = compose(block(**body)).bodies[0].system.form
        return form.residual, form.parts.hourglass

    assert terms() == (True, False)
    assert terms(hourglass={"coefficient": 0.1}) == (False, True)
    assert terms(hourglass=False) == (False, False)
    assert terms(hourglass={"coefficient": 0.1}, residual={"coefficient": 0.5}) == (True, True)


def test_it_keeps_angular_momentum_and_a_linear_field_free_of_force() -> None:
    composition = compose(block(hourglass={"coefficient": 0.1}))
    system = composition.bodies[0].system
    x = system.position / composition.scales.length
    mass = system.volume * system.density

    def spin() -> float:
        at, v = x + system.state.read("displacement"), system.state.read("velocity")
        return float(mass @ (at[:, 0] * v[:, 1] - at[:, 1] * v[:, 0]))

    before = spin()
    composition.program.run(500)
    assert spin() == pytest.approx(before, rel=1e-12)
    system.state.write("displacement", x @ np.array([[0.1, 0.3], [-0.2, 0.2]]))
    system.rate(system.state, system.new(), "velocity")
    assert np.abs(system._hold.numpy()).max() < 1e-14


@pytest.mark.parametrize("kind", ["pair", "approach"])
def test_viscosity_at_points_is_a_stress(kind: str) -> None:
    """What it takes of a linear velocity field in a strained body is the power of the viscous stress in it."""
    part = {"alpha": 0.7, "beta": 0.4, "kind": kind}
    composition = compose(block(viscosity=part).with_(**{"run.formulation": "stress-points"}))
    system, random = composition.bodies[0].system, np.random.default_rng(3)
    x = system.position / composition.scales.length
    H = 0.1 * random.standard_normal((2, 2))
    L = np.array([[-0.3, 0.1], [0.25, 0.1]])
    system.state.write("displacement", x @ H.T)
    system.state.write("velocity", (x + x @ H.T) @ L.T)
    rate = system.new()
    system.rate(system.state, rate, "velocity")
    mass = system.density * system.volume
    drag, v = rate.read("drag"), system.state.read("velocity")
    speed, h, D = float(system.pair.speed), float(system.pair.h), 0.5 * (L + L.T)
    if kind == "pair":
        power = 0.7 * speed * h * (np.trace(L) ** 2 + 2.0 * (D**2).sum()) / 8.0
    else:
        phi = h * np.trace(L)
        power = 0.5 * (0.7 * speed * phi - 0.4 * phi**2) * np.trace(L)
    assert -(mass @ (drag * v).sum(1)) == pytest.approx(power * mass.sum(), rel=1e-10)
    assert np.abs(mass @ drag).max() < 1e-14
    turning = (x + x @ H.T)[:, 0] * drag[:, 1] - (x + x @ H.T)[:, 1] * drag[:, 0]
    assert abs(mass @ turning) < 1e-13 * (mass @ np.abs(turning))


@pytest.mark.parametrize("kind", ["pair", "approach"])
def test_what_viscosity_at_points_takes_is_on_the_ledger(kind: str) -> None:
    part = {"alpha": 1.0, "beta": 1.0, "kind": kind}
    energy = wsph.run(block(viscosity=part).with_(**{"run.formulation": "stress-points", "run.cfl": 0.2})).summary[
        "energy"
    ]
    assert energy["dissipated"] > 1e-3 * energy["external_work"]
    assert abs(energy["residual"]) < 2e-3 * energy["external_work"]


METHODS = ("euler", "rk2", "leapfrog", {"name": "leapfrog", "lagged": True}, "rk4", "kg4-8", "w20-2-8",
           {"name": "rkc", "stages": 2}, {"name": "rkc", "stages": 7})  # fmt: skip


@pytest.mark.parametrize("formulation", ["total-lagrangian", "updated-lagrangian", "stress-points"])
@pytest.mark.parametrize("integrator", METHODS, ids=str)
def test_what_viscosity_takes_is_exact_however_long_the_step(integrator: object, formulation: str) -> None:
    """Where it is all that there is, a body that is hardly elastic loses to it what its motion loses, in every method, from
    the first half step on; the trapezoidal rule would be out by a third."""
    part = {"alpha": 1e5, "beta": 0.0, "kind": "pair"}
    scene = block(viscosity=part, velocity=["sin(9*x + 4*y)", "cos(8*x)"], hourglass=False).with_(
        **{"run.formulation": formulation, "run.integrator": integrator, "guard": "off", "stop": {"energy": 1e30}}
    )
    run = compose(scene).bodies[0]
    rate, scales = run.system.largest(1.0, 1e8) / 1e8, run.system.scales
    energy = wsph.run(scene.with_(dt=0.4 / rate * scales.time, end=2.0 / rate * scales.time)).history
    lost = energy["kinetic"][0] - energy["kinetic"][-1]
    assert lost > 0.25 * energy["kinetic"][0]
    assert energy["dissipated"][-1] == pytest.approx(lost, rel=1e-6)


@pytest.mark.filterwarnings("ignore:.*energy was")
@pytest.mark.parametrize("name", ["leapfrog", "rk4"])
@pytest.mark.parametrize("kind", ["pair", "approach"])
def test_the_limit_with_viscosity_at_points_holds(name: str, kind: str) -> None:
    part = {"alpha": 0.5, "beta": 0.0, "kind": kind}
    scene = block(viscosity=part, velocity=["1e-3*sin(9*x + 4*y)", "1e-3*cos(8*x)"])
    scene = scene.with_(
        **{"run.formulation": "stress-points", "run.integrator": name, "guard": "off", "stop": {"energy": 1e30}}
    )
    limit = compose(scene).bodies[0].limit

    def grows(courant: float) -> bool:
        dt = compose(scene.with_(cfl=courant)).dt
        kinetic = wsph.run(scene.with_(cfl=courant, end=600 * dt), throw=False).history["kinetic"]
        return not kinetic[-1] < 2.0 * kinetic[0]

    assert limit is not None
    assert not grows(limit)
    assert grows(1.3 * limit)


def test_rkc_is_refused_at_points_that_leave_modes_undamped() -> None:
    scene = block(viscosity={"alpha": 2.5, "kind": "pair"}).with_(
        **{"run.formulation": "stress-points", "run.integrator": "rkc"}
    )
    with pytest.raises(wsph.Refused, match=r"limit 0\.000"):
        compose(scene)


def test_artificial_stress_opposes_tension_alone() -> None:
    composition = compose(block(artificial_stress={"epsilon": 0.5, "exponent": 0.0}))
    system = composition.bodies[0].system
    x = system.position / composition.scales.length
    out = system.new()
    inside = np.abs(system.position).max(1) < 0.2
    pulls = []
    for sign in (1.0, -1.0):
        # A stress that grows along x: the force is its gradient, and half of it is opposed where it is tension.
        u = np.zeros_like(x)
        u[:, 0] = sign * 1e-4 * (x[:, 0] + 20.0) ** 2
        system.state.write("displacement", u)
        system.rate(system.state, out, "velocity")
        pulls.append(float(out.read("velocity")[inside, 0].mean()))
    assert pulls[0] / -pulls[1] == pytest.approx(0.5, abs=0.03)


def test_they_are_refused_where_there_are_points() -> None:
    for part, value in (("hourglass", {"coefficient": 0.1}), ("artificial_stress", {})):
        with pytest.raises(wsph.Refused, match=f"{part} is a part of the one-set form total-lagrangian"):
            compose(block(**{part: value}).with_(**{"run.formulation": "stress-points"}))
