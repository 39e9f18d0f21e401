"""Pairs along the edges of the cells: what faces are due, linear fields, energy, and what they are not made for."""

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.formulations.lagrangian.bodies import BODIES, IRREGULAR, composed, due, forces
from wsph.geometry.edges import cell_edges


@pytest.mark.parametrize("name", list(BODIES))
def test_the_discrete_divergence_theorem_holds(name: str) -> None:
    """A uniform deformation pulls at every particle with -P times what its faces are due, of every union of cells."""
    composition = composed(name)
    system = composition.bodies[0].system
    dim = system.space.dim
    H = 0.1 * np.random.default_rng(3).standard_normal((dim, dim))
    F, E = np.eye(dim) + H, 0.5 * (H + H.T + H.T @ H)
    P = F @ (0.3 / (1.3 * 0.4) * np.trace(E) * np.eye(dim) + E / 1.3)
    found = forces(composition, system.position / system.scales.length @ H.T)
    scale = system.scales.stress  # of E = 1 Pa
    expected = due(composition) @ P.T / scale
    assert np.abs(found + expected).max() < 1e-13 * np.abs(expected).max()


@pytest.mark.parametrize("ratio", [0.3, 0.4999])
@pytest.mark.parametrize("name", list(IRREGULAR))
def test_cells_that_differ_leave_a_linear_field_without_force_inside(name: str, ratio: float) -> None:
    """What every particle gets is -P times the integral of its shape function times the normal, over its faces; nothing
    inside. Stress is one value."""
    composition = composed(name, material=scenes.material(poisson_ratio=ratio))
    system = composition.bodies[0].system
    H = 0.1 * np.random.default_rng(3).standard_normal((system.space.dim,) * 2)
    found, expected = forces(composition, system.position / system.scales.length @ H.T), due(composition)
    stress = system.state.read("stress")
    assert np.ptp(stress, axis=0).max() < 1e-10 * np.abs(stress).max()
    P = np.linalg.lstsq(expected, -found, rcond=None)[0]
    assert np.abs(expected @ P + found).max() < 1e-11 * np.abs(found).max()


@pytest.mark.parametrize("ratio", [0.3, 0.4999])
@pytest.mark.parametrize("model", ["elastic", "neo-hookean"])
@pytest.mark.parametrize("name", ["notched", "ball", "jittered notch", "bent bar"])
def test_forces_are_the_slope_of_the_energy_and_turn_nothing(name: str, model: str, ratio: float) -> None:
    """With volumes averaged over blocks too, as a body that hardly changes its volume has them."""
    composition = composed(name, material=scenes.material(model, poisson_ratio=ratio))
    assert composition.bodies[0].system.form.blocks == (ratio > 0.45)
    run = composition.bodies[0]
    system = run.system
    random = np.random.default_rng(4)
    u, way = (0.02 * random.standard_normal((system.count, system.space.dim)) for _ in range(2))
    found = forces(composition, u)

    def energy(displacement: np.ndarray) -> float:
        forces(composition, displacement)
        return run.diagnostics.measure(system.state).strain + system.held_energy()

    h = 1e-4
    slope = (energy(u + h * way) - energy(u - h * way)) / (2.0 * h)
    assert -np.sum(found * way) == pytest.approx(slope, rel=1e-7)
    assert np.abs(found.sum(0)).max() < 1e-13 * np.abs(found).sum()
    place = system.position / system.scales.length + u
    torque = np.einsum("na,nb->ab", place, found)
    assert np.abs(torque - torque.T).max() < 1e-13 * np.abs(found).sum()


def test_every_edge_knows_the_cells_around_it() -> None:
    """Of three cubes in an L: the inner edge of the corner has three cells around it, those of two two."""
    cells = np.zeros((2, 2, 1), bool)
    cells[0, 0] = cells[1, 0] = cells[0, 1] = True
    ids = np.arange(18).reshape(3, 3, 2)
    corners = np.array([[ids[i + a, j + b, k + c] for a in (0, 1) for b in (0, 1) for c in (0, 1)]
                        for i, j, k in np.argwhere(cells)])  # fmt: skip
    edges = cell_edges(corners, 18)
    around = {(a, b): n for a, b, n in zip(edges.start, edges.end, edges.cells, strict=True)}
    assert around[ids[1, 1, 0], ids[1, 1, 1]] == 3
    assert around[ids[1, 0, 0], ids[1, 0, 1]] == 2
    assert around[ids[0, 0, 0], ids[0, 0, 1]] == 1
    assert all(around[b, a] == n for (a, b), n in around.items())


BAR = {"formulation": "total-lagrangian", "end": 60.0, "cfl": 0.5}


@pytest.mark.parametrize("model", ["elastic", "neo-hookean", "jaumann"])
@pytest.mark.parametrize("face", ["held", "loaded"])
def test_the_stress_of_a_pulled_bar_is_one_value(model: str, face: str) -> None:
    """At the ends too, where a kernel's pairs have a fifth to a half too much or too little."""
    end = (
        scenes.driven("+x", x="1e-4*(t<10)")
        if face == "held"
        else {"body": "b", "face": "+x", "stress": {"xx": "1e-3*min(t/10,1)"}}
    )
    bar = scenes.body(scenes.box(1.0), 0.05, state="stress", material=scenes.material(model), damping={"rate": 2.0})
    result = wsph.run(scenes.scene(bar, run=BAR, boundary=[scenes.held("-x", 1), end]))
    stress = result.particles["stress"][:, 0]
    assert np.ptp(stress) < 1e-4 * stress.mean()
    assert stress.mean() == pytest.approx(1e-3, rel=3e-3)
