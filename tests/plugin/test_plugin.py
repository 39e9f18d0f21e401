"""A third party's distribution, installed beside wsph: listed, composed, run, conforming; the core never names it."""

from pathlib import Path

import numpy as np
import pytest

import wsph
from wsph.errors import SceneError
from wsph.plugins import registry
from wsph.testing import check_integrator, check_material, vibrating_bar

SCENE = Path(__file__).with_name("relaxing_bar.toml")
maxwell = pytest.importorskip("wsph_maxwell.material", reason="pip install tests/plugin installs it")


def test_both_are_listed_with_their_distribution() -> None:
    found = {(e.group, e.name): e.distribution for group in registry.GROUPS for e in registry.entries(group)}
    assert found["materials", "maxwell"] == found["integrators", "ralston"] == "wsph-maxwell"
    source = "".join(path.read_text() for path in Path(wsph.__file__).parent.rglob("*.py")).lower()
    assert "maxwell" not in source
    assert "ralston" not in source


def test_conformance() -> None:
    check_material(maxwell.Maxwell(1000.0, 2e9, 6e8, 0.5))
    check_integrator("ralston", order=2)


def mode(times: np.ndarray, k: float) -> np.ndarray:
    """Velocity of the mode v = a sin(kx), stress = (p + s) cos(kx) in uniaxial strain: a' = -k (p + s)/rho, p' = K k a,
    s' = 4/3 G k a - s/tau, by the eigenvectors of the 3x3 system; a(0) = 1."""
    K, G, tau = 0.2, 0.6, 0.5
    matrix = np.array([[0.0, -k, -k], [K * k, 0.0, 0.0], [4.0 / 3.0 * G * k, 0.0, -1.0 / tau]])
    values, vectors = np.linalg.eig(matrix)
    start = np.linalg.solve(vectors, np.array([1.0, 0.0, 0.0]))
    return np.real(np.exp(np.outer(times, values)) @ (start * vectors[0]))


def test_the_scene_runs_against_its_closed_form() -> None:
    """Second order in the spacing: particles stand on the ends."""
    errors = []
    for spacing in (0.01, 0.005):
        result = wsph.run(wsph.load(SCENE).with_(**{"bodies.0.spacing": spacing}))
        probe = result.probes["middle"]
        errors.append(np.abs(probe["velocity_x"] / 1e-3 - mode(probe["time"], np.pi)).max())
    assert errors[0] < 0.05
    assert errors[0] / errors[1] > 3.5
    energy = result.summary["energy"]
    assert energy["dissipated"] > 0.9 * energy["external_work"]
    assert abs(energy["residual"]) < 1e-3 * energy["external_work"]
    assert result.summary["plugins"] == {
        "integrator ralston": "wsph-maxwell 1.0.0",
        "material maxwell": "wsph-maxwell 1.0.0",
    }


def test_their_material_under_our_integrator_and_ours_under_theirs() -> None:
    scene = wsph.load(SCENE)
    ours = wsph.run(scene.with_(integrator="tsph", cfl=0.9)).probes["middle"]
    assert np.abs(ours["velocity_x"] / 1e-3 - mode(ours["time"], np.pi)).max() < 5e-4
    assert wsph.run(vibrating_bar("ralston")).stable


def test_one_set_refuses_a_step_beyond_its_limit_and_unknown_options() -> None:
    scene = wsph.load(SCENE)
    with pytest.raises(
        wsph.Refused, match=r"ralston at Courant number 1 is beyond its stability limit 0\.\d+ \(omega dt <= .3"
    ):
        wsph.run(scene.with_(cfl=1.0))
    with pytest.raises(SceneError, match="run.integrator.order: unknown key; ralston knows no options"):
        wsph.run(scene.with_(integrator={"name": "ralston", "order": 3}))


@pytest.mark.parametrize("dim", [2, 3])
def test_one_set_keeps_momentum_and_rigid_rotation_free_of_stress_rates(dim: int) -> None:
    """A free block: linear momentum to rounding, energy kept."""
    body = {"name": "b", "shape": {"type": "box", "min": [0.0] * dim, "max": [1.0] * dim}, "spacing": 0.2,
            "velocity": ["1 + 0.01*sin(pi*x)", "0.01*cos(pi*x)", "0"][:dim],
            "material": {"model": "maxwell", "density": 1.0, "bulk_modulus": 1.0, "shear_modulus": 0.5, "relaxation_time": 1e9}}  # fmt: skip
    if dim == 2:
        body["state"] = "strain"
    result = wsph.run(
        wsph.Scene(schema=1, dim=dim, run={"integrator": "ralston", "end": 1.0, "cfl": 0.1}, bodies=[body])
    )
    momentum = result.history["momentum_x"]
    assert np.abs(momentum / momentum[0] - 1.0).max() < 1e-13
    energy = result.summary["energy"]
    assert abs(energy["residual"]) < 1e-4 * (energy["external_work"] - 0.5)
