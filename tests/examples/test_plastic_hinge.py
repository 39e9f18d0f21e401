"""examples/plastic_hinge.toml: stiffness, limit load and root moment of a beam, read off its boundaries and a section."""

import numpy as np
import pytest

import wsph
from wsph.validation.case import example


def test_the_load_displacement_curve_is_that_of_a_beam_with_a_plastic_hinge() -> None:
    result = wsph.run(example("plastic_hinge").with_(end=12e-3))
    load, way = -result.probes["push"]["force_y"], -result.probes["end"]["displacement_y"]
    elastic = (way > 0.5e-3) & (way < 1.5e-3)
    stiffness = np.polyfit(way[elastic], load[elastic], 1)[0]
    inertia, area = 0.02**3 / 12.0, 0.02
    shear = 0.2 / (5.0 / 6.0 * area * 210e9 / 2.6)
    assert stiffness == pytest.approx(1.0 / (0.2**3 / (3.0 * 210e9 * inertia) + shear), rel=0.03)
    # Between that of a free and that of a clamped root, and what inertia holds.
    assert 125e3 < load[way > 5e-3].mean() < 125e3 * 2.0 / np.sqrt(3.0)
    moment = -result.history["section_root_moment"][-1]
    assert 25e3 < moment < 25e3 * 2.0 / np.sqrt(3.0)
    work = result.history["work_push"]
    assert work == pytest.approx(result.history["external_work"], rel=1e-9, abs=1e-9 * work.max())
    assert result.probes["push"]["work"][-1] == pytest.approx(np.trapezoid(load, way), rel=0.01)
