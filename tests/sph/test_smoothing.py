"""Smoothing functions: normalised, and the slope is the derivative."""

import numpy as np
import pytest
import warp as wp

from wsph.backend.space import Space
from wsph.sph.smoothing import SMOOTHING, SUPPORT


def sample(name: str, space: Space, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """W h^dim and W'/xi at `xi`."""
    value, slope = SMOOTHING[name](space)
    real = space.scalar

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(xi: wp.array(dtype=real), value_out: wp.array(dtype=real), slope_out: wp.array(dtype=real)):
        i = wp.tid()
        value_out[i] = value(xi[i])
        slope_out[i] = slope(xi[i])

    arrays = [wp.array(xi, dtype=real, device="cpu"), *(wp.zeros(len(xi), dtype=real, device="cpu") for _ in range(2))]
    wp.launch(evaluate, len(xi), inputs=arrays[:1], outputs=arrays[1:], device="cpu")
    return arrays[1].numpy(), arrays[2].numpy()


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("name", list(SMOOTHING))
def test_unit_integral_and_consistent_slope(name: str, dim: int) -> None:
    xi = np.linspace(0.0, SUPPORT, 20_001)
    w, slope = sample(name, Space(dim), xi)
    shell = {1: 2.0 + 0.0 * xi, 2: 2.0 * np.pi * xi, 3: 4.0 * np.pi * xi**2}[dim]
    assert np.trapezoid(w * shell, xi) == pytest.approx(1.0, abs=1e-7)
    np.testing.assert_allclose(np.gradient(w, xi)[1:-1], (slope * xi)[1:-1], atol=1e-6)
    assert w[-1] == pytest.approx(0.0, abs=1e-15)
    assert np.isfinite(slope[0])
    assert (w[:-1] > 0.0).all()
