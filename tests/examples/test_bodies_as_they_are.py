"""examples/bracket.toml and examples/ring.toml: what a part from a file weighs, what its loads do, and Lame's stress."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.validation import oracles
from wsph.validation.case import EXAMPLES, example

SLANT = 30.0 * np.hypot(8.0, 12.0)
"""Area of the slanted end [mm2]; its normal is (12, 0, 8)/sqrt(208)."""


@pytest.fixture(scope="module")
def bracket() -> Composition:
    # What has not moved yet is not damped by much, and the hole has not heard of the loads: 2 us of 13 mm at 5.9 km/s.
    return compose(wsph.load(EXAMPLES / "bracket.toml").with_(end="2 us"))


def test_the_file_is_what_the_script_draws(tmp_path: Path) -> None:
    drawn = runpy.run_path(str(EXAMPLES / "bracket.py"))
    drawn["write_stl"](tmp_path / "bracket.stl", drawn["bracket"]())
    assert (tmp_path / "bracket.stl").read_bytes() == (EXAMPLES / "bracket.stl").read_bytes()


def test_the_bracket_has_its_volume_and_the_areas_of_its_patches(bracket: Composition) -> None:
    geometry = bracket.bodies[0].system.geometry
    plate = 30.0 * 12.0 * 56.0 - np.pi * 36.0 * 12.0 + np.pi * 49.0 * 10.0
    assert 1e9 * geometry.cell_volume.sum() == pytest.approx(plate, rel=2e-3)
    area = {name: 1e6 * geometry.faces.area[rows].sum() for name, rows in geometry.faces.patches.items()}
    exact = {"patch-2": 672.0, "patch-4": 144.0 * np.pi, "patch-5": 140.0 * np.pi, "patch-6": SLANT, "patch-7": 360.0,
             "patch-8": 49.0 * np.pi}  # fmt: skip
    assert {name: area[name] for name in exact} == pytest.approx(exact, rel=0.015)
    assert area["patch-6"] == pytest.approx(SLANT, rel=1e-9)


def test_the_bracket_takes_up_the_momentum_of_its_loads(bracket: Composition) -> None:
    """P = F (1 - exp(-r t))/r: pressure on the slanted end, and the pull at the boss."""
    bracket.program.run(bracket.steps)
    system, scales = bracket.bodies[0].system, bracket.scales
    mass = 7850.0 * system.volume * scales.length**3
    momentum = mass @ system.state.read("velocity") * scales.velocity
    taken = -np.expm1(-3e4 * bracket.steps * bracket.dt) / 3e4
    push = -30e6 * 1e-6 * SLANT / np.sqrt(208.0)
    assert momentum[0] == pytest.approx(12.0 * push * taken, rel=1e-3)
    assert momentum[2] == pytest.approx(8.0 * push * taken, rel=1e-3)
    assert momentum[1] == pytest.approx(20e6 * 49e-6 * np.pi * taken, rel=0.015)


def test_the_ring_has_lames_stress() -> None:
    result = wsph.run(example("ring"))
    place = result.particles["position"][:, :2] / 0.1
    radius = np.hypot(*place.T)
    outward = (result.particles["displacement"][:, :2] * place).sum(1) / radius
    bore = radius < 0.5 * (1.0 + 1e-9)
    # In units of the outer radius and of Young's modulus.
    exact = oracles.ring_displacement(radius[bore], 1e6 / 210e9) * 0.1
    assert outward[bore].mean() == pytest.approx(exact.mean(), rel=2e-3)
    middle = (radius > 0.7) & (radius < 0.8)
    stress = oracles.ring_stress(place, 1e6)
    assert np.abs(result.field("stress_xx") - stress[:, 0])[middle].max() < 0.01 * np.abs(stress).max()
