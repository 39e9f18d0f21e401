"""Bodies by their lattice under one deformation throughout, against closed forms: the stress is that of St Venant and
Kirchhoff, and every node is pushed by what the faces at it are due, -sum of P n A, and by nothing inside."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph.simulation.compose import compose

TURNED: dict[str, tuple[dict[str, Any], Any]] = {
    "bar": (scenes.box(1.0), 0.05),
    "turned box of unequal cells": (scenes.box(1.0, 1.3) | {"rotate": 25.0}, [0.05, 0.13]),
    "turned plate with a hole": (
        {
            "type": "difference",
            "shapes": [
                scenes.box(1.0, 2.0) | {"rotate": 20.0},
                {"type": "disc", "center": [0.5, 1.0], "radius": 0.2},
            ],
        },
        0.04,
    ),
    "turned block of unequal cells": (
        scenes.box(0.5, 0.65, 0.8) | {"rotate": [[1.0, 2.0, 3.0], 35.0]},
        [0.1, 0.13, 0.16],
    ),
    "sphere": ({"type": "sphere", "center": [0.5] * 3, "radius": 0.8}, 0.05),
}
"""Shapes and spacings: those of cells that are all alike, and those with a layer that is not."""


def dimension(shape: dict[str, Any]) -> int:
    """The dimension of a shape."""
    first = shape["shapes"][0] if "shapes" in shape else shape
    return len(first["min"] if "min" in first else first["center"])


CASES = [
    (name, state)
    for name in TURNED
    for state in ("strain", "stress")
    if dimension(TURNED[name][0]) < 3 or state == "strain"
]
"""Bodies and their states; in space all normals are strained."""

BEGUN = {"xx": 0.03, "yy": -0.02, "xy": 0.01}
LAWS: dict[str, dict[str, Any]] = {
    "with volumes of blocks": {"material": scenes.material("elastic", poisson_ratio=0.47)},
    "about a stress": {"initial": {"stress": BEGUN}},
    "about a stress with volumes of blocks": {
        "material": scenes.material("elastic", poisson_ratio=0.47),
        "initial": {"stress": BEGUN},
    },
}
"""Of what bodies that strain all normals are made; in one set blocks have a volume where it is hard to change."""


def stress_of(F: np.ndarray, lame: tuple[float, float], state: str) -> np.ndarray:
    """First Piola stress of F (dim, dim), S = lambda tr(E) I + 2 mu E; free normals strain so that their stress is zero."""
    dim, (first, shear) = len(F), lame
    whole = np.eye(3)
    whole[:dim, :dim] = F
    if state == "stress":
        free = 3 - dim
        strain = 0.5 * (np.trace(F.T @ F) - dim)
        across = -first * strain / (free * first + 2.0 * shear)
        whole[range(dim, 3), range(dim, 3)] = np.sqrt(1.0 + 2.0 * across)
    green = 0.5 * (whole.T @ whole - np.eye(3))
    return (whole @ (first * np.trace(green) * np.eye(3) + 2.0 * shear * green))[:dim, :dim]


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("form", ["stress-points", "total-lagrangian"])
@pytest.mark.parametrize(
    ("name", "state", "law"),
    [*((*case, "") for case in CASES), *((name, "strain", law) for name in list(TURNED)[1:] for law in LAWS)],
)
def test_one_deformation_has_one_stress_and_faces_get_their_due(
    name: str, state: str, law: str, form: str, precision: str
) -> None:
    shape, spacing = TURNED[name]
    dim = dimension(shape)
    keys = ({"state": state} if dim < 3 else {}) | LAWS.get(law, {})
    run = {"formulation": form, "precision": precision, "guard": "off", "cfl": 0.05, "end": 1.0}
    body = compose(scenes.scene(scenes.body(shape, spacing, **keys), run=run)).bodies[0]
    system, scales = body.system, body.system.scales
    assert system.regular > 0.25
    H = 0.2 * np.random.default_rng(1).standard_normal((dim, dim))
    state_of, out = system.state, system.new()
    state_of.write("displacement", (system.position - system.position.mean(0)) @ H.T / scales.length)
    system.rate(state_of, out, "velocity")
    bulk, shear = body.constitutive.material.moduli()
    P = stress_of(np.eye(dim) + H, (bulk - 2.0 / 3.0 * shear, shear), state)
    if "about" in law:
        # The initial stress is one of the reference configuration.
        own = np.zeros((3, 3))
        for (i, j), value in zip(((0, 0), (1, 1), (0, 1)), BEGUN.values(), strict=True):
            own[i, j] = own[j, i] = value
        P = P + (np.eye(dim) + H) @ own[:dim, :dim]
    due, faces = np.zeros((system.count, dim)), system.geometry.faces
    np.add.at(due, faces.nodes.ravel(), -faces.vector.reshape(-1, dim) @ P.T)
    mass = body.constitutive.material.density * system.volume * scales.length**dim
    force = mass[:, None] * out.read("velocity") * scales.velocity / scales.time
    within = 1e-11 if precision == "f64" else 2e-5
    assert np.abs(force - due).max() < within * np.abs(due).max()
    found = state_of.read("deformation").reshape(-1, dim, dim)
    assert np.abs(found - H).max() < within
