"""examples/viscoplastic_bar.toml: the closed form for N = 0, converged values for N = 2."""

import numpy as np
import pytest
from oracles import AMPLITUDE, ARRIVAL, CONVERGED, DURATION, viscoplastic

import wsph


@pytest.mark.parametrize(("n", "percent"), [(50, 0.26), (100, 0.13), (200, 0.065), (400, 0.033)])
def test_constant_source_against_the_closed_form(viscoplastic_bar: wsph.Scene, n: int, percent: float) -> None:
    probe = wsph.run(viscoplastic_bar.with_(**{"bodies.0.spacing": 1.0 / (n - 1)})).probes["fixed-end"]
    time, stress = probe["time"], -probe["stress_xx"]
    margin = 3.0 / (n - 1) / 200.0
    on = (time > ARRIVAL + margin) & (time < ARRIVAL + DURATION - margin)
    assert 100.0 * np.abs(stress - viscoplastic(time))[on].max() / AMPLITUDE <= percent
    assert probe["plastic_strain"].max() == pytest.approx(DURATION, rel=0.05)  # gamma = 1/s for 2.5 ms


@pytest.mark.parametrize(("n", "percent"), [(50, 0.3), (200, 0.04)])
def test_quadratic_source_against_converged_values(viscoplastic_bar: wsph.Scene, n: int, percent: float) -> None:
    change = {"bodies.0.spacing": 1.0 / (n - 1), "bodies.0.material.exponent": 2.0, "bodies.0.material.fluidity": 2.0}
    probe = wsph.run(viscoplastic_bar.with_(**change)).probes["fixed-end"]
    for time, value in CONVERGED.items():
        computed = np.interp(time, probe["time"], -probe["stress_xx"])
        assert 100.0 * abs(computed / value - 1.0) <= percent


def test_below_yield_it_is_the_elastic_bar(viscoplastic_bar: wsph.Scene, shock_bar: wsph.Scene) -> None:
    strong = wsph.run(viscoplastic_bar.with_(cfl=0.8, **{"bodies.0.material.yield_stress": "9 MPa"})).particles[
        "stress"
    ]
    elastic = wsph.run(shock_bar.with_(cfl=0.8)).particles["stress"]
    assert np.abs(strong - elastic).max() <= 1e-12 * np.abs(elastic).max()
