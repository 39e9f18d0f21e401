"""Viscosity: at points the stress that pairs make on average, its loss exact on the ledger, its limit that of runs."""

import numpy as np
import pytest

import wsph
from tests.scenes import spinning
from wsph.simulation.compose import compose


@pytest.mark.parametrize("kind", ["pair", "approach"])
def test_viscosity_at_points_is_a_stress(kind: str) -> None:
    """What it takes of a linear velocity field in a strained body is the power of the viscous stress in it."""
    part = {"alpha": 0.7, "beta": 0.4, "kind": kind}
    composition = compose(spinning(viscosity=part).with_(**{"run.formulation": "stress-points"}))
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
    youngs, h, D = 1.3 * 0.4 / 0.7, 1.0, 0.5 * (L + L.T)  # in units of rho c^2 = lambda + 2 mu, and in spacings
    speed = np.sqrt(youngs)
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
    energy = wsph.run(spinning(viscosity=part).with_(**{"run.formulation": "stress-points", "run.cfl": 0.2})).summary[
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
    scene = spinning(viscosity=part, velocity=["sin(9*x + 4*y)", "cos(8*x)"], hourglass=False).with_(
        **{"run.formulation": formulation, "run.integrator": integrator, "guard": "off", "stop": {"energy": 1e30}}
    )
    run = compose(scene).bodies[0]
    rate, scales = run.system.largest(1.0, 1e8) / 1e8, run.system.scales
    energy = wsph.run(scene.with_(dt=0.4 / rate * scales.time, end=2.0 / rate * scales.time)).history
    lost = energy["kinetic"][0] - energy["kinetic"][-1]
    assert lost > 0.25 * energy["kinetic"][0]
    assert energy["dissipated"][-1] == pytest.approx(lost, rel=1e-6)


@pytest.mark.filterwarnings("ignore:.*energy was", "ignore:.*spurious modes")
@pytest.mark.parametrize("name", ["leapfrog", "rk4"])
@pytest.mark.parametrize("kind", ["pair", "approach"])
def test_the_limit_with_viscosity_at_points_holds(name: str, kind: str) -> None:
    part = {"alpha": 0.5, "beta": 0.0, "kind": kind}
    scene = spinning(viscosity=part, velocity=["1e-3*sin(9*x + 4*y)", "1e-3*cos(8*x)"])
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
    scene = spinning(viscosity={"alpha": 2.5, "kind": "pair"}).with_(
        **{"run.formulation": "stress-points", "run.integrator": "rkc"}
    )
    with pytest.raises(wsph.Refused, match=r"limit 0\.000"):
        compose(scene)
