"""Loads on faces of cells of every kind: tractions and pressures that hold a uniform stress, and the work of a pressure."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lagrangian.bodies import FITTED, FOLDER, MESHED, composed, forces
from wsph.geometry.gradients import mean_gradients
from wsph.geometry.lattice import Lattice
from wsph.geometry.meshes.meshed import Meshed
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.validation import meshes

pytestmark = pytest.mark.filterwarnings("ignore:body .* pieces that have no node in common")

FORM, EVERYWHERE = "stress-points", {"body": "b", "where": "x > -9"}
CLOSED = ["jittered notch", "bent bar", *list(FITTED)[:-1], *MESHED]
BOXES = ["jittered square", "jittered cube", *MESHED[:-1]]


def whole(composition: Composition) -> np.ndarray:
    """Places of the particles, nondimensional, (n, dim)."""
    system = composition.bodies[0].system
    return system.position / system.scales.length


def volume(composition: Composition, displacement: np.ndarray) -> float:
    """Of the body as a displacement leaves it, the sum of its cells', nondimensional."""
    geometry = composition.bodies[0].system.geometry
    blocks = geometry.mesh.blocks if isinstance(geometry, Meshed) else (geometry.corners,)
    assert isinstance(geometry, (Meshed, Lattice))
    now = geometry.nodes / composition.bodies[0].system.scales.length + displacement
    return sum(float(mean_gradients(now, corners)[1].sum()) for corners in blocks)


def gradient(dim: int) -> np.ndarray:
    """A turn by more than half a right angle, stretch and shear."""
    F = np.eye(dim)
    F[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    return F @ (np.eye(dim) + 0.05 * np.random.default_rng(7).standard_normal((dim, dim)))


@pytest.mark.parametrize("name", CLOSED)
def test_a_pressure_all_around_is_the_stress_of_a_body_that_has_shrunk_and_turned(name: str) -> None:
    """F = 0.97 Q, S = (3 lambda or 2 lambda + 2 mu) E: J p = -0.97^2 S leaves no force on any particle."""
    composition = composed(name, FORM)
    system = composition.bodies[0].system
    dim, scale = system.space.dim, 0.97
    turn = np.eye(dim)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    u = whole(composition) @ (scale * turn - np.eye(dim)).T
    inner = forces(composition, u)
    strain = 0.5 * (scale**2 - 1.0)
    pressure = -(scale ** (2 - dim)) * (dim * 0.3 / (1.3 * 0.4) + 1.0 / 1.3) * strain  # of E = 1 Pa
    loaded = composed(name, FORM, boundary=[{**EVERYWHERE, "pressure": pressure}])
    found = forces(loaded, u)
    assert np.abs(inner).max() > 1e-3
    assert np.abs(found).max() < 1e-12 * np.abs(inner).max()
    assert np.abs((found - inner).sum(0)).max() < 1e-13 * np.abs(inner).sum()
    stress = loaded.bodies[0].system.state.read("stress") * system.scales.stress
    labels = system.constitutive.state.labels
    normal = [labels.index(axis) for axis in ("xx", "yy", "zz")[:dim]]
    assert np.abs(stress[:, normal] + pressure).max() < 1e-11 * pressure


@pytest.mark.parametrize("name", CLOSED)
def test_the_force_of_a_pressure_is_what_it_does_for_the_volume(name: str) -> None:
    """p dV/du of a closed surface, at a finite turn, of a body that is out of shape."""
    free = composed(name, FORM)
    loaded = composed(name, FORM, boundary=[{**EVERYWHERE, "pressure": 0.25}])
    system, random = free.bodies[0].system, np.random.default_rng(8)
    dim, x = system.space.dim, whole(free)
    u, way = (0.05 * random.standard_normal(x.shape) for _ in range(2))
    u += x @ (gradient(dim) - np.eye(dim)).T
    found = forces(loaded, u) - forces(free, u)
    near, far = ((volume(free, u + h * way) - volume(free, u - h * way)) / (2.0 * h) for h in (0.1, 0.2))
    # The volume is a polynomial of third order at most, of which this is the slope.
    slope = (4.0 * near - far) / 3.0
    p = 0.25 / system.scales.stress
    assert np.sum(found * way) == pytest.approx(-p * slope, rel=1e-9, abs=1e-9 * np.abs(found * way).sum())
    assert np.abs(found.sum(0)).max() < 1e-13 * np.abs(found).sum()


@pytest.mark.parametrize("name", BOXES)
def test_tractions_on_a_box_hold_a_linear_field(name: str) -> None:
    """Tractions P N of a uniform first Piola-Kirchhoff stress, N the normals before: no force on any particle."""
    free = composed(name, FORM)
    system = free.bodies[0].system
    dim = system.space.dim
    F = gradient(dim)
    E = 0.5 * (F.T @ F - np.eye(dim))
    P = F @ (0.3 / (1.3 * 0.4) * np.trace(E) * np.eye(dim) + E / 1.3)  # of E = 1 Pa
    loads: list[dict[str, Any]] = []
    for axis, normal in enumerate("xyz"[:dim]):
        for sign in (-1, 1):
            pull = {"xyz"[k]: float(sign * P[k, axis]) for k in range(dim)}
            loads.append({"body": "b", "face": f"{'-+'[sign > 0]}{normal}", "traction": pull})
    u = whole(free) @ (F - np.eye(dim)).T
    inner, found = forces(free, u), forces(composed(name, FORM, boundary=loads), u)
    assert np.abs(found).max() < 1e-12 * np.abs(inner).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_a_mesh_of_a_lattices_cells_is_that_lattice(dim: int) -> None:
    """Points, weights, limit and motion: vectors in place of scalars, and the same answers."""
    counts = (8, 5, 4)[:dim]
    run = {"formulation": FORM, "end": 6.0, "dt": 0.03}
    velocity = ["1e-2*sin(3*x + y)", "1e-2*cos(2*x)*y", "5e-3*x*z"][:dim]
    tables = {"boundary": [{"body": "b", "face": "-x", "symmetry": "x"}, {"body": "b", "face": "+x", "pressure": 1e-3}]}
    made = scenes.body(scenes.box(*[0.1 * n for n in counts]), 0.1, velocity=velocity)
    lattice = scenes.scene(made, run=run, **tables)
    path = Path(FOLDER.name) / f"lattice{dim}.vtu"
    nodes, corners = meshes.moved_grid([0.1 * n for n in counts], counts, 0.0)
    meshes.write(path, nodes, **{"quad" if dim == 2 else "hexahedron": meshes.around(corners)})
    data = lattice.data()
    del data["bodies"][0]["shape"], data["bodies"][0]["spacing"]
    data["bodies"][0]["mesh"] = {"file": str(path)}
    mesh = wsph.Scene(**data)
    limits = [compose(each.with_(cfl=0.9)).dt for each in (lattice, mesh)]
    assert limits[1] == pytest.approx(limits[0], rel=1e-9)
    ones, others = wsph.run(lattice).particles, wsph.run(mesh).particles
    assert np.abs(ones["position"] - others["position"]).max() < 1e-14
    for field in ("velocity", "stress"):
        assert np.abs(ones[field] - others[field]).max() < 1e-12 * np.abs(ones[field]).max()
