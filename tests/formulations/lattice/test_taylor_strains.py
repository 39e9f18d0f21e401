"""Taylor-SPH by rows of turned lattices in a uniform rate of strain: inside, where no face has been heard of yet, the stress
is that of the law for that strain. Beyond yield q grows by H/(3 G + H) of what it would without."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph.formulations.taylor import operators
from wsph.simulation.compose import compose

BODIES: dict[str, tuple[dict[str, Any], list[float], dict[str, Any]]] = {
    "strain": (scenes.box(1.0, 1.3) | {"rotate": 25.0}, [1.0 / 34, 1.3 / 34], {"state": "strain"}),
    "stress": (scenes.box(1.0, 1.3) | {"rotate": 25.0}, [1.0 / 34, 1.3 / 34], {"state": "stress"}),
    "space": (scenes.box(1.0, 1.2, 1.1) | {"rotate": [[1.0, 2.0, 3.0], 35.0]}, [1.0 / 26, 1.2 / 26, 1.1 / 26], {}),
}
"""Turned boxes of unequal cells, by their states."""

G, NU, YIELD, HARDENING, RATE, STEPS = 1.0e6, 0.3, 0.02e6, 0.4e6, 50.0, 4
LAWS = {
    "elastic": {},
    "mises": {"yield_stress": YIELD, "hardening_modulus": HARDENING},
    "perzyna": {"yield_stress": YIELD, "hardening_modulus": HARDENING, "fluidity": 0.0, "exponent": 1.0},
}


def expected(strain: np.ndarray, law: str, state: str) -> np.ndarray:
    """The stress (3, 3) [Pa] of a strain (dim, dim)."""
    whole = np.zeros((3, 3))
    whole[: len(strain), : len(strain)] = strain
    if state == "stress":
        whole[2, 2] = -NU / (1.0 - NU) * np.trace(strain)
    stress = 2.0 * G * NU / (1.0 - 2.0 * NU) * np.trace(whole) * np.eye(3) + 2.0 * G * whole
    if law == "mises":
        tried = np.sqrt(3.0) * stress[0, 1]
        assert tried > 1.5 * YIELD
        stress *= (YIELD + (tried - YIELD) * HARDENING / (3.0 * G + HARDENING)) / tried
    return stress


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize(
    ("law", "kind"), [("elastic", "shear"), ("elastic", "stretch"), ("mises", "shear"), ("perzyna", "shear")]
)
@pytest.mark.parametrize("name", BODIES)
def test_a_uniform_strain_has_its_stress(
    name: str, law: str, kind: str, precision: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(operators, "FEWEST", {1: 1, 2: 1, 3: 1})
    shape, spacing, keys = BODIES[name]
    L = np.zeros((len(spacing), len(spacing)))
    if kind == "shear":
        L[0, 1] = L[1, 0] = 0.5 * RATE
    else:
        L[0, 0], L[1, 1] = RATE, -0.3 * RATE
    material = {"model": law, "density": 1e3, "youngs_modulus": 2.0 * G * (1.0 + NU), "poisson_ratio": NU, **LAWS[law]}
    velocity = ["+".join(f"{rate!r}*{axis}" for rate, axis in zip(row, "xyz", strict=False)) for row in L.tolist()]
    body = scenes.body(shape, spacing, material=material, velocity=velocity, **keys)
    run = {"integrator": "tsph", "formulation": "small-strain", "precision": precision, "cfl": 0.4, "end": 1.0}
    made = compose(scenes.scene(body, run=run | {"guard": "off", "threads": 1}))
    system = made.bodies[0].system
    assert system.regular > 0.7
    made.compile()
    made.program.run(STEPS)
    # Each half step hears of one layer more.
    index, heard = system.lattice.index, 2 * STEPS + 1
    inside = ((index >= heard) & (index <= index.max(0) - heard)).all(1)
    assert inside.any()
    right = expected(0.5 * (L + L.T) * STEPS * system.clock.dt * system.scales.time, law, name)
    stress = (system.state.read("stress") * system.scales.of("Pa"))[inside]
    for label, found in zip(system.constitutive.state.labels, stress.T, strict=True):
        off = np.abs(found - right["xyz".index(label[0]), "xyz".index(label[1])]).max()
        assert off < {"f64": 1e-13, "f32": 2e-5}[precision] * np.abs(right).max(), label
