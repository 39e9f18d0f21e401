"""examples/shock_bar.toml against its closed form, with the published particle numbers and time steps."""

import warnings

import numpy as np
import pytest

import wsph
from wsph.errors import Unstable
from wsph.validation.oracles import AMPLITUDE, ARRIVAL, DURATION


def compression(result: wsph.Result) -> tuple[np.ndarray, np.ndarray]:
    """Time and compression at the fixed end."""
    probe = result.probes["fixed-end"]
    return probe["time"], -probe["stress_xx"]


def with_particles(scene: wsph.Scene, n: int, **overrides: object) -> wsph.Scene:
    """The bar with n real particles."""
    return scene.with_(**{"bodies.0.spacing": 1.0 / (n - 1)}, **overrides)


@pytest.mark.parametrize(("precision", "percent"), [("f64", 1e-10), ("f32", 1e-4)])
@pytest.mark.parametrize("n", [2 + 10, 50, 100, 101, 400])
def test_courant_one_is_exact(shock_bar: wsph.Scene, n: int, precision: str, percent: float) -> None:
    """Every sample but the ones on the jumps, no margin: the front is one cell."""
    time, stress = compression(wsph.run(with_particles(shock_bar, n, precision=precision)))
    cell = 1.0 / (n - 1) / 200.0
    away = (np.abs(time - ARRIVAL) > 1.01 * cell) & (np.abs(time - ARRIVAL - DURATION) > 1.01 * cell)
    exact = np.where((time > ARRIVAL) & (time < ARRIVAL + DURATION), AMPLITUDE, 0.0)
    assert 100.0 * np.abs(stress - exact)[away].max() / AMPLITUDE <= percent


def test_beyond_the_limit_it_grows_as_the_amplification_says(shock_bar: wsph.Scene) -> None:
    """Largest stress after 400 steps over that at C = 1, 101 particles: 1.1 at C = 1.001, 35 at 1.005, 1e4 at 1.01."""

    def largest(courant: float) -> float:
        scene = shock_bar.with_(
            cfl=courant, guard="off", end=400 * courant / 100 / 200, stop={"energy": 1e30}, output={"history": 400}
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the energy that is created on purpose
            return float(np.abs(wsph.run(scene).probes["fixed-end"]["stress_xx"]).max())

    exact = largest(1.0)
    assert largest(1.001) / exact == pytest.approx(1.1, rel=0.05)
    assert largest(1.005) / exact == pytest.approx(35.0, rel=0.05)
    assert largest(1.01) / exact == pytest.approx(1e4, rel=0.2)
    with pytest.raises(Unstable, match="energy was created"), pytest.warns(RuntimeWarning, match="energy was created"):
        wsph.run(shock_bar.with_(cfl=1.01, guard="off", end="0.1 s"))


def test_the_velocity_in_the_middle_is_the_pulse(shock_bar: wsph.Scene) -> None:
    probe = wsph.run(shock_bar).probes["middle"]
    time, v = probe["time"], probe["velocity_x"]
    # The probe reads the average to the virtual particles: one cell wider at each jump.
    for value, start, end in ((1.0, 2.5e-3, 5e-3), (-1.0, 7.5e-3, 10e-3), (0.0, 5e-3, 7.5e-3)):
        inside = (time > start + 1.5e-4) & (time < end - 1.5e-4)
        assert np.abs(v[inside] - value).max() < 1e-12
