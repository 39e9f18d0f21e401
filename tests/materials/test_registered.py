"""Our own materials under the conformance kit."""

import numpy as np
import pytest
import warp as wp
from wsph_materials.elastic import Elastic
from wsph_materials.jaumann import Jaumann
from wsph_materials.mises import Mises
from wsph_materials.neo_hookean import NeoHookean
from wsph_materials.perzyna import Perzyna

from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.stress_state import STRESS_STATES
from wsph.plugins import registry
from wsph.testing import check_material
from wsph.units import Scales

# (a material, the size of the stresses tried [Pa]): Perzyna far above yield, and below it
OURS = {
    "elastic": [
        (Elastic(2000.0, 8e7, 0.3), None),
        (Elastic(7800.0, 2e11, -0.5), None),
        (Elastic(1000.0, 1e6, 0.4999), None),
    ],
    "jaumann": [(Jaumann(2000.0, 8e7, 0.3), None)],
    "neo-hookean": [(NeoHookean(2000.0, 8e7, 0.3), None), (NeoHookean(1000.0, 1e6, 0.49), None)],
    "mises": [(Mises(2000.0, 8e7, 0.3, 5e5, 8e6), 1e6)],
    "perzyna": [
        (Perzyna(2000.0, 8e7, 0.3, 5e5, -8e6, 25.0, exponent), level)
        for exponent in (0.0, 1.0, 2.0)
        for level in (1e5, 1e7)
    ],
}


@pytest.mark.parametrize(("material", "level"), [case for cases in OURS.values() for case in cases], ids=repr)
def test_conformance(material: object, level: float | None) -> None:
    check_material(material, stress_level=level)


TOTAL = {"elastic": Elastic(2000.0, 8e7, 0.3), "neo-hookean": NeoHookean(2000.0, 8e7, 0.3)}


def test_every_material_of_ours_is_tried() -> None:
    assert set(OURS) | set(TOTAL) == {
        entry.name for entry in registry.entries("materials") if entry.distribution == "wsph"
    }


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", list(TOTAL))
def test_total_laws_are_objective_and_their_energy_is_their_stress(name: str, dim: int) -> None:
    """P is the derivative of the energy by F, a rotation before or after changes nothing else, the answer is linear
    elasticity at small strain; in plane stress too."""
    space = Space(dim)
    state = STRESS_STATES[dim, "stress" if dim == 2 else None]
    law = Constitutive(space, TOTAL[name], state, Scales(1.0, 1.0 / 200.0, 2000.0), name)

    @wp.kernel
    def sample(
        p: law.laws.Params,
        H: wp.array(dtype=space.mat),
        P_out: wp.array(dtype=space.mat),
        energy_out: wp.array(dtype=wp.float64),
    ):
        i = wp.tid()
        _, P = law.laws.total(p, H[i])
        P_out[i] = P
        energy_out[i] = law.laws.total_energy(p, H[i])

    def at(H: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        P, energy = wp.zeros(len(H), dtype=space.mat), wp.zeros(len(H), dtype=wp.float64)
        wp.launch(sample, len(H), inputs=[law.params, wp.array(H, dtype=space.mat)], outputs=[P, energy])
        return P.numpy(), energy.numpy()

    random = np.random.default_rng(0)
    H = 0.15 * random.standard_normal((50, dim, dim))
    P, energy = at(H)
    step = 1e-6
    for i in range(dim):
        for j in range(dim):
            moved = np.zeros((dim, dim))
            moved[i, j] = step
            slope = (at(H + moved)[1] - at(H - moved)[1]) / (2 * step)
            np.testing.assert_allclose(P[:, i, j], slope, atol=2e-9)
    Q, _ = np.linalg.qr(random.standard_normal((50, dim, dim)))
    Q[:, :, 0] *= np.linalg.det(Q)[:, None]
    one = np.eye(dim)
    turned, same = at(Q @ (one + H) - one)
    np.testing.assert_allclose(same, energy, atol=1e-14)
    np.testing.assert_allclose(turned, Q @ P, atol=1e-13)
    tiny = 1e-9 * (H + np.swapaxes(H, 1, 2))
    bulk, shear = (
        (m / law.state.wave_speed(1.0, 0.0, 1.0) / 8e7 for m in TOTAL[name].moduli()) if dim == 3 else (0.0, 0.0)
    )
    if dim == 3:
        trace = np.einsum("nii->n", tiny)[:, None, None] * one / 3.0
        np.testing.assert_allclose(
            at(tiny)[0], 3.0 * bulk * trace + 2.0 * shear * (tiny - trace), rtol=1e-6, atol=1e-16
        )
