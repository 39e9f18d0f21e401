"""examples/viscoplastic_bar.toml beside its published figures (test_published_cases)."""

import numpy as np
import pytest

import wsph
from wsph.validation.oracles import DURATION


def test_the_plastic_strain_is_the_fluidity_times_the_pulse(viscoplastic_bar: wsph.Scene) -> None:
    probe = wsph.run(viscoplastic_bar).probes["fixed-end"]
    assert probe["plastic_strain"].max() == pytest.approx(DURATION, rel=0.05)  # gamma = 1/s for 2.5 ms


def test_below_yield_it_is_the_elastic_bar(viscoplastic_bar: wsph.Scene, shock_bar: wsph.Scene) -> None:
    strong = wsph.run(viscoplastic_bar.with_(cfl=0.8, **{"bodies.0.material.yield_stress": "9 MPa"})).particles[
        "stress"
    ]
    elastic = wsph.run(shock_bar.with_(cfl=0.8)).particles["stress"]
    assert np.abs(strong - elastic).max() <= 1e-12 * np.abs(elastic).max()
