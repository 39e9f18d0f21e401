"""Pairs along the edges of the cells: what faces are due, linear fields, energy, and what they are not made for."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.geometry.edges import cell_edges
from wsph.simulation.compose import compose
from wsph.simulation.composition import Composition

STAIRS = {"type": "polygon", "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]}
NOTCHED = {"type": "difference", "shapes": [scenes.box(1.0, 1.0), scenes.box((0.4, 0.6), (0.4, 1.0))]}
TURNED = {**scenes.box(1.0, 0.6), "rotate": 30.0}
BALL = {"type": "sphere", "center": [0.5] * 3, "radius": 0.5}
PIPE = {"type": "difference", "shapes": [
    {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.6], "radius": 0.5},
    {"type": "cylinder", "from": [0.5, 0.5, 0.0], "to": [0.5, 0.5, 0.6], "radius": 0.25}]}  # fmt: skip
BODIES = {
    "bar": (scenes.box(1.0), 0.1),
    "square": (scenes.box(1.0, 1.0), 0.1),
    "flat cells": (scenes.box(1.0, 1.0), [0.1, 0.05]),
    "one row": (scenes.box(1.0, 0.1), 0.1),
    "notched": (NOTCHED, 0.1),
    "stairs": (STAIRS, 0.1),
    "turned": (TURNED, 0.1),
    "cube": (scenes.cube(3), 0.25),
    "ball": (BALL, 0.125),
    "pipe": (PIPE, 0.1),
}
IRREGULAR = {
    "jittered square": (scenes.box(1.0, 1.0), {"jitter": 0.3, "seed": 2}),
    "jittered notch": (NOTCHED, {"jitter": 0.3, "seed": 3}),
    "jittered cube": (scenes.cube(3), {"jitter": 0.25, "seed": 4}),
    "quarter of a ring": (scenes.box((1.0, 2.0), (0.0, 1.5)), {"map": ["x*cos(y)", "x*sin(y)"]}),
    "bent bar": (scenes.box(1.0, 0.4, 0.4), {"map": ["x", "y + 0.3*x*x", "z*(1 + 0.5*x) + 0.2*x*y"]}),
}


def composed(name: str, **keys: Any) -> Composition:
    """A body of edge pairs, in plane strain, uniaxial strain or 3D."""
    form, spacing = BODIES[name]
    return compose(scenes.scene(scenes.body(form, spacing, **keys), run={"formulation": "total-lagrangian"}))


def irregular(name: str, **keys: Any) -> Composition:
    """A body whose cells differ."""
    form, how = IRREGULAR[name]
    run = {"formulation": "total-lagrangian", **({"seed": how["seed"]} if "seed" in how else {})}
    own = {key: value for key, value in how.items() if key != "seed"}
    return compose(scenes.scene(scenes.body(form, 0.1 if "cube" not in name else 0.2, **own, **keys), run=run))


def lines(composition: Composition) -> np.ndarray:
    """The areas times outward normals of the faces at every particle, nondimensional, (n, dim): what faces are due."""
    system = composition.bodies[0].system
    faces, scale = system.lattice.faces, system.scales.length ** (system.space.dim - 1)
    normal = faces.sign[:, None] * system.lattice.frame.axes.T[faces.axis]
    corners = faces.nodes.shape[1]
    due = np.zeros((system.count, system.space.dim))
    np.add.at(due, faces.nodes.ravel(), np.repeat(normal * faces.area[:, None] / corners / scale, corners, 0))
    return due


def forces(composition: Composition, displacement: np.ndarray) -> np.ndarray:
    """Forces of a displacement, nondimensional, (n, dim)."""
    system = composition.bodies[0].system
    system.state.write("displacement", displacement)
    out = system.new()
    system.impose(system.state, 0.0)
    system.rate(system.state, out)
    return out.read("velocity") * (system.density * system.volume)[:, None]


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
    due = lines(composition) @ P.T / scale
    assert np.abs(found + due).max() < 1e-13 * np.abs(due).max()


@pytest.mark.parametrize("ratio", [0.3, 0.4999])
@pytest.mark.parametrize("name", list(IRREGULAR))
def test_cells_that_differ_leave_a_linear_field_without_force_inside(name: str, ratio: float) -> None:
    """What every particle gets is -P times the integral of its shape function times the normal, over its faces: in 2D half
    of each; nothing inside. Stress is one value."""
    composition = irregular(name, material=scenes.material(poisson_ratio=ratio))
    system = composition.bodies[0].system
    dim, faces = system.space.dim, system.lattice.faces
    H = 0.1 * np.random.default_rng(3).standard_normal((dim, dim))
    found = forces(composition, system.position / system.scales.length @ H.T)
    stress = system.state.read("stress")
    assert np.ptp(stress, axis=0).max() < 1e-10 * np.abs(stress).max()
    inside = np.ones(system.count, bool)
    inside[faces.nodes.ravel()] = False
    size = np.abs(found).max()
    assert np.abs(found[inside]).max() < 1e-11 * size
    assert np.abs(found.sum(0)).max() < 1e-11 * size
    if dim == 2:
        ends = system.position[faces.nodes]
        along = (ends[:, 1] - ends[:, 0]) / system.scales.length
        normal = np.stack([along[:, 1], -along[:, 0]], 1)
        outward = system.position[faces.nodes].mean(1) - system.lattice.cells[faces.cell]
        normal *= np.sign(np.einsum("na,na->n", normal, outward))[:, None]
        due = np.zeros((system.count, dim))
        np.add.at(due, faces.nodes.ravel(), 0.5 * np.repeat(normal, 2, 0))
        P = np.linalg.lstsq(due, -found, rcond=None)[0]
        assert np.abs(due @ P + found).max() < 1e-11 * size


@pytest.mark.parametrize("ratio", [0.3, 0.4999])
@pytest.mark.parametrize("model", ["elastic", "neo-hookean"])
@pytest.mark.parametrize("name", ["notched", "ball", "jittered notch", "bent bar"])
def test_forces_are_the_slope_of_the_energy_and_turn_nothing(name: str, model: str, ratio: float) -> None:
    """With volumes averaged over blocks too, as a body that hardly changes its volume has them."""
    make = irregular if name in IRREGULAR else composed
    composition = make(name, material=scenes.material(model, poisson_ratio=ratio))
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
