"""examples/shear_band.toml: where the band starts, its angle and width, and what depends on the spacing."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.composition import compose

COLUMNS = (0.1, 0.4)
"""The band is measured in the columns of particles between these x [m], away from the symmetry axis and the free edge."""


def band(scene: wsph.Scene) -> dict[str, float | np.ndarray]:
    """Angle [degrees], full width at half maximum across the band [m], peak strain and where it is, from the particles."""
    composition = compose(scene)
    composition.program.run(composition.steps)
    system = composition.bodies[0].system
    # The particles' own values: a frame's average over a cell would widen the band by a third of a spacing.
    strain, (x, y) = system.state.read("internals")[:, 0], system.position.T
    columns = np.unique(np.round(x, 9))
    columns = columns[(columns > COLUMNS[0] - 1e-9) & (columns < COLUMNS[1] + 1e-9)]
    crest, widths = [], []
    for column in columns:
        on = np.abs(x - column) < 1e-9
        order = np.argsort(y[on])
        height, value = y[on][order], strain[on][order]
        k, spacing = int(np.argmax(value)), height[1] - height[0]
        if not 0 < k < len(value) - 1:
            continue
        # The vertex of the parabola through the three highest particles.
        before, top, after = value[k - 1 : k + 2]
        shift = 0.5 * (before - after) / (before - 2 * top + after)
        crest.append((column, height[k] + shift * spacing))
        half = 0.5 * (top - 0.25 * (before - after) * shift)
        edges = np.flatnonzero(np.diff(np.sign(value - half)))
        cuts = height[edges] + spacing * (half - value[edges]) / (value[edges + 1] - value[edges])
        if (cuts < height[k]).any() and (cuts > height[k]).any():
            widths.append(cuts[cuts > height[k]].min() - cuts[cuts < height[k]].max())
    slope = np.arctan(abs(np.polyfit(*np.transpose(crest), 1)[0]))
    peak = int(np.argmax(strain))
    return {
        "angle": float(np.degrees(slope)),
        "width": float(np.mean(widths) * np.cos(slope)) if widths else np.nan,
        "peak": float(strain[peak]),
        "where": system.position[peak],
    }


def test_the_band_is_that_of_the_paper_and_its_peak_depends_on_the_spacing(scene: wsph.Scene) -> None:
    coarse, fine = (band(scene.with_(dt=dt, **{"bodies.0.spacing": 0.5 / n})) for n, dt in ((20, 9.5e-6), (40, 8e-6)))
    for measured in (coarse, fine):
        assert 41.0 <= measured["angle"] <= 45.0
        assert 0.12 <= measured["width"] <= 0.14
        assert measured["where"].tolist() == [0.5, 0.0]  # the free edge meets the fixed base
    assert fine["peak"] > 1.5 * coarse["peak"]


@pytest.mark.slow
def test_eighty_columns(scene: wsph.Scene) -> None:
    measured = band(scene.with_(**{"bodies.0.spacing": 0.5 / 80}))
    assert 41.0 <= measured["angle"] <= 45.0
    assert measured["width"] == pytest.approx(0.141, abs=0.002)


def test_plane_stress_gives_a_flatter_band(scene: wsph.Scene) -> None:
    measured = band(scene.with_(**{"bodies.0.spacing": 0.5 / 40, "bodies.0.state": "stress"}))
    assert measured["angle"] < 40.0


def test_it_yields_first_when_the_plane_strain_wave_is_reflected(scene: wsph.Scene) -> None:
    """1 m at 232 m/s: 4.3 ms. The front is some cells wide, so a trace of strain comes a little earlier."""
    probe = {"name": "first", "where": "y >= 0", "reduce": "max", "fields": ["plastic_strain"], "every": 1}
    first = wsph.run(scene.with_(probes=[probe], end="5 ms")).probes["first"]
    assert first["time"][first["plastic_strain"] > 1e-4][0] == pytest.approx(4.3e-3, rel=0.05)


@pytest.fixture(scope="module")
def scene() -> wsph.Scene:
    """The shipped scene."""
    return wsph.load(Path(__file__).resolve().parents[2] / "examples" / "shear_band.toml")
