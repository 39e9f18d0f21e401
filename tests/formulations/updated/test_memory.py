"""What particles remember of the motion that gradients do not see: energy, momentum, turns, and the modes that it holds."""

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.formulations.one_set import OneSetSystem
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

DIMENSIONS = [(dim, precision) for dim in (1, 2, 3) for precision in ("f64", "f32")]


def block(dim: int, precision: str = "f64", *, run: dict | None = None, **keys: object) -> wsph.Scene:
    """A free cube with a law whose stress is a field of the state."""
    keys = {"model": "jaumann", **keys}
    own = {"formulation": "updated-lagrangian", "precision": precision, **(run or {})}
    return scenes.block(dim, 8 if dim < 3 else 4, centred=True, run=own, **keys)


def disturbed(composition: Composition, size: float = 0.05) -> OneSetSystem:
    """The body with random velocities, deformations, places and deviations."""
    system, random = composition.bodies[0].system, np.random.default_rng(0)
    for name in ("velocity", "displacement", "deformation", "deviation"):
        width = system.state.widths[name]
        system.state.write(name, size * random.standard_normal((system.count, width)))
    system.follow()
    return system


@pytest.mark.parametrize(("dim", "precision"), DIMENSIONS)
def test_forces_do_the_work_of_the_energy_and_keep_momenta(dim: int, precision: str) -> None:
    """Without stress the power of all forces is minus the rate of the energy that is remembered, at any disturbed state."""
    system = disturbed(compose(block(dim, precision)))
    state, rate, eps = system.state, system.new(), 1e-14 if precision == "f64" else 3e-6
    system.rate(state, rate)
    mass = system.density * system.volume[:, None]
    force = mass * rate.read("velocity")
    F, dF = (s.read("deformation").reshape(-1, dim, dim) for s in (state, rate))
    F = F + np.eye(dim)
    D, dD = state.read("deviation")[..., None], rate.read("deviation")[..., None]
    stiffness = system.rates.form.remembers * float(system.rates._points.stabilisation) * system.volume
    power = (stiffness * ((F @ D) * (dF @ D + F @ dD)).sum((1, 2))).sum()
    size = np.abs(force).sum()
    assert abs((force * state.read("velocity")).sum() + power) < 10 * eps * size
    assert np.abs(force.sum(0)).max() < eps * size
    place = system.position / system.scales.length + state.read("displacement")
    torque = np.einsum("na,nb->ab", place, force)
    assert np.abs(torque - torque.T).max() < 10 * eps * size
    assert system.held_energy() == pytest.approx(0.5 * (stiffness * ((F @ D) ** 2).sum((1, 2))).sum(), rel=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turn_changes_nothing_that_is_remembered(dim: int) -> None:
    """A disturbed body is told to turn by 50 degrees a step; forces turn with it."""
    composition = compose(block(dim, run={"guard": "off"}))
    system = disturbed(composition)
    state, rate = system.state, system.new()
    turn, angle = np.eye(dim), np.radians(50.0)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    x, kept, energy = system.position / composition.scales.length, state.read("deviation"), system.held_energy()
    state.write("velocity", np.zeros((system.count, dim)))
    system.rate(state, rate, "velocity")
    force = rate.read("velocity")
    for _ in range(9):
        now = x + state.read("displacement")
        state.write("velocity", (now @ turn.T - now) / composition.clock.dt)
        system.follow()
        system.rate(state, rate, "rest", ahead=0.5)
        system.combine(state, plain=[(1.0, state)], timed=[(1.0, rate)], part="rest")
    np.testing.assert_allclose(state.read("deviation"), kept, atol=1e-13)
    assert system.held_energy() == pytest.approx(energy, rel=1e-12)
    system.follow()
    system.rate(state, rate, "velocity")
    np.testing.assert_allclose(rate.read("velocity"), force @ np.linalg.matrix_power(turn, 9).T, atol=1e-10)


FREE_BEAM = 3150.365 / np.sqrt(200e9 / 7850.0) * 0.1
"""Frequency of a free beam, E = rho = height = 1, length 10, nu = .3 in plane stress, by quadratic elements."""


def frequency(rows: int, **keys: object) -> float:
    """The frequency of the first bending mode of a free beam over the right one, from half of its period."""
    body = scenes.body(scenes.box((-5.0, 5.0), (-0.5, 0.5)), 1.0 / rows, state="stress", **keys)
    composition = compose(scenes.scene(body, run={"formulation": "updated-lagrangian", "cfl": 0.8, "end": 99.0}))
    system, integrator = composition.bodies[0].system, composition.bodies[0].integrator
    x, y, b, s = system.position[:, 0] / 10.0 + 0.5, system.position[:, 1], 4.730041, 0.982502
    mode = np.cosh(b * x) + np.cos(b * x) - s * (np.sinh(b * x) + np.sin(b * x))
    mode -= mode.mean()
    slope = b / 10.0 * (np.sinh(b * x) - np.sin(b * x) - s * (np.cosh(b * x) + np.cos(b * x)))
    system.state.write("velocity", 1e-4 * np.stack([-y * slope, mode], 1) / composition.scales.velocity)
    integrator.begin()
    before, time, dt = 0.0, 0.0, composition.time_step.dt
    while True:
        composition.program.run(1)
        time += dt
        now = float(mode @ system.state.read("displacement")[:, 1])
        if now < 0.0:
            return np.pi / (time - dt * now / (now - before)) / FREE_BEAM
        before = now


@pytest.mark.parametrize(("rows", "placement", "error"), [(4, "cells", 0.01), (8, "cells", 0.01), (4, "nodes", 0.02)])
def test_a_free_beam_has_its_frequency(rows: int, placement: str, error: float) -> None:
    assert frequency(rows, placement=placement) == pytest.approx(1.0, abs=error)


def test_a_free_beam_without_memory_is_too_soft() -> None:
    assert frequency(4, residual=False) < 0.85


def spun(formulation: str = "updated-lagrangian", **keys: object) -> tuple[float, float, wsph.Result]:
    """A free bar that turns half round: its least-squares stretch - 1, the rms of the rest [spacings], the run."""
    body = scenes.body(scenes.box((-5.0, 5.0), (-0.5, 0.5)), 0.25, state="stress",
                       velocity=["-0.01*y", "0.01*x"], material=scenes.material("jaumann", poisson_ratio=0.0), **keys)  # fmt: skip
    run = {"formulation": formulation, "cfl": 0.8, "end": 314.0}
    result = wsph.run(scenes.scene(body, run=run, output={"fields": ["displacement"]}))
    x = result.particles["position"]
    y = x + result.particles["displacement"]
    map_, *_ = np.linalg.lstsq(x, y - y.mean(0), rcond=None)
    rest = y - y.mean(0) - x @ map_
    return float(np.linalg.svd(map_)[1][0] - 1.0), float(np.sqrt((rest**2).sum(1).mean()) / 0.25), result


def test_a_spinning_bar_stretches_as_in_the_lagrangian_forms() -> None:
    stretch, rest, result = spun()
    reference, smooth, _ = spun("stress-points")
    assert stretch == pytest.approx(reference, rel=0.06)
    assert rest < 1.2 * smooth
    energy, history = result.summary["energy"], result.history
    assert abs(energy["residual"]) < 1e-5 * energy["external_work"]
    assert 0.0 < energy["hourglass"] < 0.01 * energy["strain"]
    assert max(np.ptp(history[f"momentum_{axis}"]) for axis in "xy") < 1e-12
    assert spun(residual=False)[0] > 1.1 * reference
