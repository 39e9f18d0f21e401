"""The examples of docs/reference/states.md: what a run begins with."""

from pathlib import Path

import numpy as np
import pytest

import wsph

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_a_taut_strip_rings_like_a_stiff_string() -> None:
    result = wsph.run(wsph.load(EXAMPLES / "taut_strip.toml"))
    t, u = result.probes["middle"]["time"], result.probes["middle"]["displacement_y"]
    after = int(np.flatnonzero((u[1:] < 0.0) & (u[:-1] >= 0.0))[0])
    half = t[after] + u[after] * (t[after + 1] - t[after]) / (u[after] - u[after + 1])
    # A clamped string of small bending stiffness (Fletcher 1964): f = sqrt(s/rho)/(2 L) (1 + 2 e + (4 + pi^2/2) e^2), e =
    # h/L sqrt(E/(12 s)); shear, of order (h/L)^2 E/G, is left out.
    stiff = 0.02 * np.sqrt(1e9 / 12e7)
    string = 50.0 * (1.0 + 2.0 * stiff + (4.0 + np.pi**2 / 2.0) * stiff**2)
    assert 0.5 / half == pytest.approx(string, rel=0.01)
    assert np.abs(result.history["residual"]).max() < 1e-9 * result.history["strain"][0]


def test_a_preloaded_bar_is_struck() -> None:
    result = wsph.run(wsph.load(EXAMPLES / "preload_impact.toml"))
    t, stress = result.probes["root"]["time"], result.probes["root"]["stress_xx"]
    waits = t < 1e-4 + 1.0 / np.sqrt(210e9 / 7850.0) - 1e-5
    # At rest under 20 MPa until the blow has come through the bar; there it is doubled.
    assert stress[waits] == pytest.approx(20e6, rel=1e-3)
    assert stress.min() == pytest.approx(20e6 - 2.0 * 50e6, rel=0.01)
    assert result.summary["relaxation"]["preload"]["status"] == "at rest"


def test_cooks_membrane_rises_as_it_should() -> None:
    result = wsph.run(wsph.load(EXAMPLES / "cook.toml"), end="1 ms")
    rise = result.probes["corner"]["displacement_y"][0]
    # E b/F u = 23.96 of fine meshes (Simo & Rifai 1990).
    assert rise * 1e9 / 16e3 == pytest.approx(23.96, rel=0.005)
    assert result.summary["relaxation"]["status"] == "at rest"
