"""examples/ground_blow.toml and examples/rotating_disc.toml: waves that leave through quiet faces, and a disc in its own
frame against its closed form."""

import numpy as np
import pytest

import wsph
from wsph.validation.case import EXAMPLES


def test_what_the_footing_does_leaves_through_quiet_faces() -> None:
    history = wsph.run(wsph.load(EXAMPLES / "ground_blow.toml")).history
    work = history["external_work"][-1]
    left = history["kinetic"][-1] + history["strain"][-1]
    assert history["dissipated"][-1] > 0.9 * work
    assert left < 0.1 * work
    assert abs(history["residual"][-1]) < 0.05 * work


def test_the_disc_has_its_stress_and_its_rim_its_way() -> None:
    result = wsph.run(wsph.load(EXAMPLES / "rotating_disc.toml"))
    pull, a, nu, modulus = 7800.0 * 1047.2**2, 0.2, 0.3, 210e9
    probe = result.probes["middle"]
    mean = 0.5 * (probe["stress_xx"][-1] + probe["stress_yy"][-1])
    assert mean == pytest.approx((3.0 + nu) / 8.0 * pull * a**2, rel=1e-2)
    place, moved = result.particles["position"][:, :2], result.particles["displacement"][:, :2]
    rim = np.linalg.norm(place, axis=1) > a - 1e-4
    out = (moved[rim] * place[rim]).sum(1) / a
    assert out == pytest.approx((1.0 - nu) / 4.0 * pull * a**3 / modulus, rel=1e-2)
