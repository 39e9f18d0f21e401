"""Rigid bodies by themselves, under integrators of one set."""

from typing import Any

import numpy as np
import pytest

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.prescribed import Prescribed
from wsph.contact.tools.rigid import Inertia, Motion, RigidBody, Start, rotation_matrix
from wsph.expressions import compile_expression, constant_program
from wsph.plugins import registry
from wsph.units import Scales

ZERO = np.zeros(3)
GRAVITY = np.array([0.0, -1.0, 0.0])


class Alone:
    """A rigid body as the only member of a system."""

    damped = moved = viscous = projects = False

    def __init__(self, body: RigidBody):
        self.body, self.state, self.clock = body, body.state, body.clock

    def __getattr__(self, name: str) -> Any:
        return getattr(self.body, name)


def go(body: RigidBody, method: str, steps: int) -> None:
    integrator: Any = registry.load("integrators", method)(Alone(body))
    if hasattr(integrator, "begin"):
        integrator.begin()
    for _ in range(steps):
        integrator.step()
        body.clock.advance()


def top(steps: int, time: float = 2.0) -> RigidBody:
    """A body with three different moments of inertia, near the unstable axis, that falls while it turns."""
    inertia = Inertia(2.0, np.diag([1.0, 2.0, 3.0]), GRAVITY)
    start = Start(ZERO, np.array([1.0, 0.0, 0.0]), np.array([0.3, 2.0, 0.2]))
    return RigidBody("top", inertia, start, Space(3), Scales(1.0, 1.0, 1.0), Clock(time / steps, "cpu"))


@pytest.mark.parametrize(("method", "order"), [("leapfrog", 2), ("rk4", 4)])
def test_a_free_top_keeps_angular_momentum_and_energy_in_the_order_of_the_method(method: str, order: int):
    right = top(1600)
    go(right, "rk4", 1600)
    errors: list[tuple[float, float]] = []
    for steps in (50, 100):
        body = top(steps)
        momentum, energy = body.state.read("spin")[0], body.kinetic(body.state)
        go(body, method, steps)
        np.testing.assert_array_equal(body.state.read("spin")[0], momentum)  # nothing turns it
        np.testing.assert_allclose(body.state.read("place")[0], [2.0, -2.0, 0.0], atol=1e-13)
        assert np.linalg.norm(body.state.read("turn")) == pytest.approx(1.0, abs=1e-15)
        drift = abs(body.kinetic(body.state) - body.lifted - energy) / energy
        errors.append((np.abs(body.state.read("turn") - right.state.read("turn")).max(), drift))
    assert np.log2(errors[0][0] / errors[1][0]) == pytest.approx(order, abs=0.1)
    assert errors[1][1] < {2: 2e-6, 4: 2e-10}[order]


def test_leapfrog_runs_backwards_as_it_ran_forwards():
    body = top(100)
    turn, place = body.state.read("turn"), body.state.read("place")
    for c in (1.0,) * 50 + (-1.0,) * 50:
        body.drift(body.state, body.state, c)
    np.testing.assert_allclose(body.state.read("turn"), turn, atol=1e-14)
    np.testing.assert_allclose(body.state.read("place"), place, atol=1e-14)


def test_the_intermediate_axis_is_unstable_and_the_energy_stays():
    """Dzhanibekov: a body that spins about its middle axis turns over, and turns back."""
    inertia = Inertia(1.0, np.diag([1.0, 2.0, 3.0]), ZERO)
    start = Start(ZERO, ZERO, np.array([1e-3, 2.0, 0.0]))
    body = RigidBody("nut", inertia, start, Space(3), Scales(1.0, 1.0, 1.0), Clock(0.02, "cpu"))
    energy, over = body.kinetic(body.state), []
    for _ in range(1500):
        body.drift(body.state, body.state, 1.0)
        over.append(rotation_matrix(body.state.read("turn")[0])[1, 1])
    assert min(over) < -0.99
    assert max(over[-600:]) > 0.9
    assert body.kinetic(body.state) == pytest.approx(energy, rel=1e-3)


def test_a_disc_turns_in_its_plane():
    inertia = Inertia(1.0, np.diag([0.0, 0.0, 0.5]), ZERO)
    start = Start(ZERO, ZERO, np.array([0.0, 0.0, 3.0]))
    body = RigidBody("disc", inertia, start, Space(2), Scales(1.0, 1.0, 1.0), Clock(0.01, "cpu"))
    go(body, "leapfrog", 100)
    c, s = np.cos(3.0), np.sin(3.0)
    np.testing.assert_allclose(rotation_matrix(body.state.read("turn")[0])[:2, :2], [[c, -s], [s, c]], atol=1e-13)
    assert body.kinetic(body.state) == pytest.approx(0.5 * 0.5 * 9.0)


def prescribed(velocity: Prescribed, rate: Prescribed, dt: float, scales: Scales | None = None) -> RigidBody:
    zero = constant_program(0.0)
    motion = Motion([velocity, zero, zero], rate, np.array([0.0, 0.0, 1.0]))
    return RigidBody(
        "tool", motion, Start(ZERO, ZERO, ZERO), Space(3), scales or Scales(1.0, 1.0, 1.0), Clock(dt, "cpu")
    )


@pytest.mark.parametrize(("method", "bound"), [("leapfrog", 3e-4), ("rk4", 1e-8)])
def test_a_prescribed_tool_goes_and_turns_as_it_is_told(method: str, bound: float):
    """In SI units through the scales: length 2 m, time .5 s."""
    body = prescribed(compile_expression("cos(t)"), compile_expression("2*t"), 0.04, Scales(2.0, 0.5, 1.0))
    go(body, method, 50)
    assert body.state.read("place")[0, 0] * 2.0 == pytest.approx(np.sin(1.0), abs=bound)
    turn = rotation_matrix(body.state.read("turn")[0])
    assert np.arctan2(turn[1, 0], turn[0, 0]) == pytest.approx(1.0, abs=bound)


def test_a_table_moves_a_tool_as_it_moves_a_driven_face():
    """The rule of places is the integrator's own, the same for both: leapfrog takes the middle of the step."""
    table = Function(t=(0.0, 0.25, 1.0), value=(0.0, 1.0, 0.5))
    body = prescribed(table, constant_program(0.0), 0.1)
    go(body, "leapfrog", 10)
    middle = 0.1 * sum(table.at(0.1 * (k + 0.5)) for k in range(10))
    assert body.state.read("place")[0, 0] == pytest.approx(middle, abs=1e-14)
    assert body.state.read("velocity")[0, 0] == pytest.approx(0.5, abs=1e-14)


def test_a_body_that_stands_still_costs_no_launches():
    body = prescribed(constant_program(0.0), constant_program(0.0), 0.1)
    integrator: Any = registry.load("integrators", "leapfrog")(Alone(body))
    assert body.clock.launches(integrator.step) == []
