"""Every material of ours at single points along paths that have a closed form, to 1e-10 in double precision."""

from typing import Any

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
from wsph.testing import LawSampler
from wsph.units import Scales

E, NU, DENSITY = 8e7, 0.3, 2000.0
SHEAR, LAME = E / (2.0 * (1.0 + NU)), E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU))
STRETCHES = np.array([0.5, 0.9, 1.0 + 1e-9, 1.1, 2.0, 5.0])


def scales(material: Any) -> Scales:
    bulk, shear = material.moduli()
    return Scales(1.0, 1.0 / STRESS_STATES[3, None].wave_speed(bulk, shear, material.density), material.density)


def stresses(material: Any, H: np.ndarray) -> np.ndarray:
    """Cauchy stress [Pa] of a total law at H = F - I, (n, 3, 3)."""
    space, unit = Space(3), scales(material)
    constitutive = Constitutive(space, material, STRESS_STATES[3, None], unit, "ours")
    Params, tensor = constitutive.laws.Params, space.tensor
    law = material.stress(space, Params)

    @wp.kernel(module="unique", enable_backward=False)
    def each(p: Params, H: wp.array(dtype=tensor), stress_out: wp.array(dtype=tensor)):
        i = wp.tid()
        stress_out[i] = law(p, H[i])

    out = wp.zeros(len(H), dtype=tensor, device="cpu")
    wp.launch(
        each, len(H), inputs=[constitutive.params, wp.array(H, dtype=tensor, device="cpu")], outputs=[out], device="cpu"
    )
    return out.numpy() * unit.stress


def uniaxial() -> np.ndarray:
    H = np.zeros((len(STRETCHES), 3, 3))
    H[:, 0, 0] = STRETCHES - 1.0
    return H


def close(found: np.ndarray, exact: np.ndarray) -> None:
    assert np.abs(found - exact).max() <= 1e-10 * np.abs(exact).max()


def test_elastic_is_st_venant_and_kirchhoff_s() -> None:
    """Uniaxial strain: S = (lambda + 2 mu) E, sigma = F S F^T/J; simple shear by the same."""
    found, green = stresses(Elastic(DENSITY, E, NU), uniaxial()), 0.5 * (STRETCHES**2 - 1.0)
    close(found[:, 0, 0], STRETCHES * (LAME + 2.0 * SHEAR) * green)
    close(found[:, 1, 1], LAME * green / STRETCHES)
    shears = np.array([1e-6, 0.1, 1.0, 3.0])
    H = np.zeros((4, 3, 3))
    H[:, 0, 1] = shears
    found = stresses(Elastic(DENSITY, E, NU), H)
    # E12 = g/2, E22 = g^2/2: S11 = S33 = lambda E22, S22 = (lambda + 2 mu) E22, S12 = mu g.
    s11, s22, s12 = 0.5 * LAME * shears**2, 0.5 * (LAME + 2.0 * SHEAR) * shears**2, SHEAR * shears
    close(found[:, 0, 1], s12 + shears * s22)
    close(found[:, 0, 0], s11 + 2.0 * shears * s12 + shears**2 * s22)


def test_neo_hookean() -> None:
    found = stresses(NeoHookean(DENSITY, E, NU), uniaxial())
    close(found[:, 0, 0], (SHEAR * (STRETCHES**2 - 1.0) + LAME * np.log(STRETCHES)) / STRETCHES)
    close(found[:, 1, 1], LAME * np.log(STRETCHES) / STRETCHES)


def test_jaumann_in_simple_shear() -> None:
    """sigma_12 = mu sin g, sigma_11 = -sigma_22 = mu (1 - cos g): the rate along it is its derivative."""
    law, g = LawSampler(Jaumann(DENSITY, E, NU)), np.linspace(0.0, 6.0, 13)
    unit = law.scales.stress
    stress, exact, L = (np.zeros((len(g), 3, 3)) for _ in range(3))
    stress[:, 0, 1] = stress[:, 1, 0] = SHEAR * np.sin(g) / unit
    stress[:, 0, 0], stress[:, 1, 1] = SHEAR * (1.0 - np.cos(g)) / unit, -SHEAR * (1.0 - np.cos(g)) / unit
    L[:, 0, 1] = 1.0
    exact[:, 0, 1] = exact[:, 1, 0] = SHEAR * np.cos(g) / unit
    exact[:, 0, 0], exact[:, 1, 1] = SHEAR * np.sin(g) / unit, -SHEAR * np.sin(g) / unit
    close(law(stress, L)[0], exact)


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_perzyna_in_uniaxial_stress(exponent: float) -> None:
    """At rest it relaxes by -2 G times the plastic rate, fluidity ((sigma - sigma_y)/sigma_y)^N along 3 s/(2 q)."""
    yields, hardening, fluidity = 5e5, -8e6, 25.0
    material = Perzyna(DENSITY, E, NU, yields, hardening, fluidity, exponent)
    law = LawSampler(material)
    sigma, strain = np.array([2e5, 6e5, 1e6, -2e6]), 0.01
    stress, q = np.zeros((4, 3, 3)), np.full((4, 1), strain)
    stress[:, 0, 0] = sigma / law.scales.stress
    rate, change = law(stress, np.zeros((4, 3, 3)), q)
    limit = yields + hardening * strain
    over = np.maximum(np.abs(sigma) - limit, 0.0) / limit
    flow = fluidity * over**exponent * (over > 0.0) * law.scales.time
    close(change[:, 0], flow)
    exact = np.zeros((4, 3, 3))
    exact[:, 0, 0] = -2.0 * SHEAR * flow * np.sign(sigma) / law.scales.stress
    exact[:, 1, 1] = exact[:, 2, 2] = -0.5 * exact[:, 0, 0]
    close(rate, exact)


@pytest.mark.parametrize("hardening", [0.0, 8e6, -4e6])
def test_mises_is_brought_back_to_its_yield_surface(hardening: float) -> None:
    """Radial return: the pressure stays, the deviator shrinks to sigma_y(q), dq = (q_trial - sigma_y)/(3 G + H)."""
    yields, strain = 5e5, 0.02
    material = Mises(DENSITY, E, NU, yields, hardening)
    space, unit = Space(3), scales(material)
    constitutive = Constitutive(space, material, STRESS_STATES[3, None], unit, "ours")
    Params, tensor, internals = constitutive.laws.Params, space.tensor, space.vector(1)
    law = material.project(space, Params)

    @wp.kernel(module="unique", enable_backward=False)
    def each(
        p: Params,
        stress: wp.array(dtype=tensor),
        q: internals,
        stress_out: wp.array(dtype=tensor),
        q_out: wp.array(dtype=internals),
    ):
        i = wp.tid()
        back, grown = law(p, stress[i], q)
        stress_out[i] = back
        q_out[i] = grown

    trial = np.random.default_rng(3).standard_normal((200, 3, 3))
    trial = 4e5 * (trial + trial.transpose(0, 2, 1)) / unit.stress
    out, grown = wp.zeros(200, dtype=tensor, device="cpu"), wp.zeros(200, dtype=internals, device="cpu")
    inputs = [constitutive.params, wp.array(trial, dtype=tensor, device="cpu"), internals(strain)]
    wp.launch(each, 200, inputs=inputs, outputs=[out, grown], device="cpu")

    def parts(stress: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        mean = np.einsum("nii->n", stress) / 3.0
        deviator = stress - mean[:, None, None] * np.eye(3)
        return mean, deviator, np.sqrt(1.5 * np.einsum("nij,nij->n", deviator, deviator))

    (mean, s, size), (mean_back, s_back, size_back) = parts(trial * unit.stress), parts(out.numpy() * unit.stress)
    limit = yields + hardening * strain
    more = np.maximum(size - limit, 0.0) / (3.0 * SHEAR + hardening)
    assert 20 < (more > 0.0).sum() < 200
    close(grown.numpy().reshape(-1), strain + more)
    close(mean_back, mean)
    close(size_back, np.where(more > 0.0, limit + hardening * more, size))
    close(s_back, s * (size_back / size)[:, None, None])
