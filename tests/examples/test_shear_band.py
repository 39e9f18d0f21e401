"""examples/shear_band.toml beside its published figures (test_published_cases)."""

import pytest

import wsph
from wsph.validation.case import example
from wsph.validation.measures import band


def test_the_peak_depends_on_the_spacing() -> None:
    scene = example("shear_band")
    coarse, fine = (band(scene.with_(dt=dt, **{"bodies.0.spacing": 0.5 / n})) for n, dt in ((20, 9.5e-6), (40, 8e-6)))
    assert fine["peak"] > 1.5 * coarse["peak"]


def test_it_yields_first_when_the_plane_strain_wave_is_reflected() -> None:
    """1 m at 232 m/s: 4.3 ms. The front is some cells wide, so a trace of strain comes a little earlier."""
    probe = {"name": "first", "where": "y >= 0", "reduce": "max", "fields": ["plastic_strain"], "every": 1}
    first = wsph.run(example("shear_band").with_(probes=[probe], end="5 ms")).probes["first"]
    assert first["time"][first["plastic_strain"] > 1e-4][0] == pytest.approx(4.3e-3, rel=0.05)
