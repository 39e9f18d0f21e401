"""examples/vibrating_bar.toml against its closed form, at the published particle numbers and time step."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.composition import compose

SPEED = np.sqrt(2.0)


@pytest.fixture(scope="module")
def scene() -> wsph.Scene:
    """The shipped scene."""
    return wsph.load(Path(__file__).resolve().parents[2] / "examples" / "vibrating_bar.toml")


def stress_error(scene: wsph.Scene) -> float:
    """L2 error of the particles' stress at the end, in percent: their own values, a frame's are averaged over a cell."""
    composition = compose(scene)
    composition.program.run(composition.steps)
    system, t = composition.bodies[0].system, composition.steps * composition.dt
    stress = system.state.read("stress")[:, 0] * composition.scales.stress
    exact = 50.0 * 0.1 / SPEED * np.cos(np.pi * system.position[:, 0]) * np.sin(np.pi * SPEED * t)
    return float(100.0 * np.linalg.norm(stress - exact) / np.linalg.norm(exact))


@pytest.mark.parametrize(("cells", "percent"), [(50, 2e-3), (100, 4e-4), (200, 1e-6)])
def test_the_published_instant(scene: wsph.Scene, cells: int, percent: float) -> None:
    """Published: 7.52, 4.45 and .96 %."""
    assert stress_error(scene.with_(**{"bodies.0.spacing": 1.0 / cells})) <= percent


@pytest.mark.parametrize(("cells", "percent"), [(50, 5.8), (100, 1.15), (200, 0.0012)])
def test_after_ten_seconds(scene: wsph.Scene, cells: int, percent: float) -> None:
    assert stress_error(scene.with_(end=10.0, **{"bodies.0.spacing": 1.0 / cells})) == pytest.approx(percent, rel=0.02)
