"""The sign of the spin: uniaxial stress turned by 45 degrees."""

import numpy as np
import pytest
from wsph_materials.jaumann import Jaumann

from wsph.testing import LawSampler


def test_the_spin_has_the_sign_of_a_rotation() -> None:
    """d(R s R^T)/dt of a body that turns anticlockwise: shear +omega s_xx at the start, and s_xy = +1/2 at 45 degrees."""
    law = LawSampler(Jaumann(1.0, 1.0, 0.3))
    W = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]])
    stress = np.zeros((1, 3, 3))
    stress[0, 0, 0] = 1.0
    rate, _ = law(stress, W)
    assert rate[0, 0, 1] == pytest.approx(1.0)
    steps, turned = 2000, stress
    dt = np.pi / 4 / steps
    for _ in range(steps):
        middle = turned + 0.5 * dt * law(turned, W)[0]
        turned = turned + dt * law(middle, W)[0]
    expected = np.array([[0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(turned[0], expected, atol=1e-6)
