"""A return to the yield surface with given normal stresses, by what it must do whatever finds it."""

import numpy as np
import pytest
import warp as wp
from wsph_materials.mises import Mises

from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.stress_state import STRESS_STATES
from wsph.units import Scales

NU, YIELD, HARDENING = 0.3, 2e-3, 5e-2
SHEAR, BULK = 1.0 / (2.0 * (1.0 + NU)), 1.0 / (3.0 * (1.0 - 2.0 * NU))


def brought_back(dim: int, name: str | None, packed: np.ndarray, mask: int) -> tuple[np.ndarray, np.ndarray]:
    """Packed stresses (n, components) and internals (n, internals) after the return."""
    space = Space(dim)
    law = Mises(density=1.0, youngs_modulus=1.0, poisson_ratio=NU, yield_stress=YIELD, hardening_modulus=HARDENING)
    made = Constitutive(space, law, STRESS_STATES[dim, name], Scales(1.0, 1.0, 1.0), "mises", evolves=True)
    laws = made.laws
    Params, project, vec, internal = laws.Params, laws.project_face, laws.stress, laws.internal

    @wp.kernel(module="unique", enable_backward=False)
    def run(p: Params, mask: int, stress_out: wp.array(dtype=vec), internal_out: wp.array(dtype=internal)):
        i = wp.tid()
        stress, q = project(p, stress_out[i], internal_out[i], mask)
        stress_out[i] = stress
        internal_out[i] = q

    stress = wp.array(packed, dtype=vec, device="cpu")
    internals = wp.zeros(len(packed), dtype=internal, device="cpu")
    wp.launch(run, len(packed), inputs=[made.params, mask], outputs=[stress, internals], device="cpu")
    return stress.numpy(), internals.numpy()


def unpacked(dim: int, name: str | None, packed: np.ndarray) -> np.ndarray:
    full = np.zeros((len(packed), 3, 3))
    for c, (i, j) in enumerate(STRESS_STATES[dim, name].components):
        full[:, i, j] = full[:, j, i] = packed[:, c]
    return full


@pytest.mark.parametrize(
    ("dim", "name", "mask"), [(2, "strain", 1), (2, "strain", 3), (2, "stress", 2), (3, None, 4), (3, None, 5)]
)
def test_given_normals_stay_and_only_they_strain(dim: int, name: str | None, mask: int) -> None:
    """What is given stays; the stress is on the yield surface; the strain that the return needs, elastic and by the flow
    rule plastic, is along the given normals and those that the state leaves free."""
    state = STRESS_STATES[dim, name]
    free = [k for k in range(3) if mask >> k & 1 or k in state.free]
    # Given normals that no other stress can bring within the yield surface have no answer.
    largest = np.array([0.4 if i == j and i in free else 2.0 for i, j in state.components]) * YIELD
    packed = np.random.default_rng(3).uniform(-largest, largest, (40, len(state.components)))
    found, q = brought_back(dim, name, packed, mask)
    before, after = unpacked(dim, name, packed), unpacked(dim, name, found)
    for k in free:
        assert after[:, k, k] == pytest.approx(before[:, k, k], abs=1e-10)
    one = np.eye(3)
    change, s = after - before, after - np.trace(after, axis1=1, axis2=2)[:, None, None] / 3.0 * one
    size = np.sqrt(1.5 * (s**2).sum((1, 2)))
    plastic = q[:, 0]
    yields = plastic > 0.0
    assert yields.any()
    assert (size <= YIELD + HARDENING * plastic + 1e-12).all()
    assert size[yields] == pytest.approx((YIELD + HARDENING * plastic)[yields], abs=1e-12)
    mean = np.trace(change, axis1=1, axis2=2)[:, None, None] / 3.0
    strain = (change - mean * one) / (2.0 * SHEAR) + mean / (3.0 * BULK) * one
    strain += 1.5 * (plastic / np.where(yields, size, 1.0))[:, None, None] * s
    strain[:, free, free] = 0.0
    assert np.abs(strain).max() < 1e-9
    assert (q[:, -1] >= 0.0).all()
    assert q[yields, -1] == pytest.approx((size * plastic)[yields], rel=1e-6)
