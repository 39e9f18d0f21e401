"""Points that see the corners of their own cells: linear fields, what faces are due, energy, and a kernel beside it."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lagrangian.bodies import BODIES, FITTED, IRREGULAR, MESHED, composed, due, forces
from wsph.simulation.compose import compose

FORM = "stress-points"

pytestmark = pytest.mark.filterwarnings("ignore:body .* pieces that have no node in common")


@pytest.mark.parametrize("name", [*BODIES, *IRREGULAR, *FITTED, *MESHED])
def test_a_linear_field_has_one_stress_and_faces_get_what_they_are_due(name: str) -> None:
    """Of every union of cells, alike or not: -P times the integral of N_j n at every node, nothing inside."""
    composition = composed(name, FORM)
    system = composition.bodies[0].system
    dim = system.space.dim
    H = 0.1 * np.random.default_rng(3).standard_normal((dim, dim))
    F, E = np.eye(dim) + H, 0.5 * (H + H.T + H.T @ H)
    P = F @ (0.3 / (1.3 * 0.4) * np.trace(E) * np.eye(dim) + E / 1.3) / system.scales.stress  # of E = 1 Pa
    found, expected = forces(composition, system.position / system.scales.length @ H.T), due(composition) @ P.T
    stress = system.state.read("stress")
    assert np.ptp(stress, axis=0).max() < 1e-11 * np.abs(stress).max()
    assert np.abs(found + expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("model", ["elastic", "neo-hookean"])
@pytest.mark.parametrize("name", ["notched", "ball", "jittered notch", "bent bar", "fitted disc", "fitted ball", "triangles",
                                  "hexahedra", "hexahedra and tetrahedra"])  # fmt: skip
def test_forces_are_the_slope_of_the_energy_and_turn_nothing(name: str, model: str) -> None:
    composition = composed(name, FORM, material=scenes.material(model))
    run = composition.bodies[0]
    system = run.system
    random, dim = np.random.default_rng(4), system.space.dim
    u, way = (0.02 * random.standard_normal((system.count, dim)) for _ in range(2))
    turn = np.eye(dim)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    u += system.position / system.scales.length @ (turn - np.eye(dim)).T
    found = forces(composition, u)

    def energy(displacement: np.ndarray) -> float:
        forces(composition, displacement)
        return run.diagnostics.measure(system.state).strain + system.held_energy()

    near, far = (energy(u + h * way) - energy(u - h * way) for h in (0.05, 0.1))
    # Of fourth order; the energy of the elastic law is a polynomial of that order.
    slope = (8.0 * near - far) / 0.6
    assert -np.sum(found * way) == pytest.approx(slope, rel=1e-9 if model == "elastic" else 1e-6)
    assert np.abs(found.sum(0)).max() < 1e-13 * np.abs(found).sum()
    place = system.position / system.scales.length + u
    torque = np.einsum("na,nb->ab", place, found)
    assert np.abs(torque - torque.T).max() < 1e-13 * np.abs(found).sum()


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("name", ["bar", "flat cells", "turned", "notched", "ball"])
def test_on_a_lattice_it_is_a_kernel_of_three_halves_of_a_spacing(name: str, precision: str) -> None:
    """Weights, gradients and forces are those of the pairs that a kernel of that support finds."""
    form, spacing = BODIES[name]
    found: list[np.ndarray] = []
    for support in (None, 1.5):
        run = {"formulation": FORM, "support": support, "precision": precision}
        composition = compose(scenes.scene(scenes.body(form, spacing, surface="stairs"), run=run))
        system = composition.bodies[0].system
        u = 1e-2 * np.random.default_rng(5).standard_normal((system.count, system.space.dim))
        found.append(forces(composition, u))
    assert np.abs(found[0] - found[1]).max() < {"f64": 1e-13, "f32": 1e-5}[precision] * np.abs(found[0]).max()


@pytest.mark.parametrize("name", ["jittered square", "jittered cube"])
def test_in_single_precision_forces_sum_up_to_nothing(name: str) -> None:
    """The vectors of a point do so exactly, so what is left is the rounding of the sums over points."""
    form, how = IRREGULAR[name]
    run = {"formulation": FORM, "precision": "f32", "seed": how["seed"]}
    composition = compose(scenes.scene(scenes.body(form, 0.2, jitter=how["jitter"]), run=run))
    system = composition.bodies[0].system
    found = forces(composition, 1e-3 * np.random.default_rng(6).standard_normal((system.count, system.space.dim)))
    assert np.abs(found.astype(float).sum(0)).max() < 2e-7 * np.abs(found).sum()


def ran(precision: str, end: float) -> np.ndarray:
    """The stress of a free box that shakes."""
    waves = [".1*sin(3*x+2*y-z+.3)", ".08*sin(2*x-3*y+2*z+1.7)", ".06*sin(-2*x+y+4*z+.7)"]
    box = scenes.box((-0.4, 0.4), (-0.2, 0.3), (-0.3, 0.3))
    material = scenes.material(density=1000.0, youngs_modulus=1e6)
    made = scenes.body(box, 0.1, velocity=waves, material=material)
    run: dict[str, Any] = {"formulation": FORM, "end": end, "precision": precision, "threads": 1}
    return wsph.run(scenes.scene(made, run=run)).particles["stress"]


@pytest.mark.parametrize(("end", "most"), [(0.05, 1e-4), (0.2, 1e-4), (2.0, 4e-3)])
def test_single_precision_is_the_same_discretisation(end: float, most: float) -> None:
    double = ran("f64", end)
    assert np.abs(ran("f32", end) - double).max() < most * np.abs(double).max()
