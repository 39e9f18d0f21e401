"""Surfaces on the device: places, areas, normals, forces and works against numpy, and the bound of their springs."""

from typing import Any

import numpy as np
import pytest

from tests import scenes
from wsph.backend.state import State
from wsph.contact.surfaces.meshing.mesh import area_vectors
from wsph.contact.surfaces.surface import Surface
from wsph.formulations.one_set import OneSetSystem
from wsph.simulation.compose import compose

DISC = {"type": "disc", "center": [0.0, 0.0], "radius": 0.5}
SPHERE = {"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 0.5}
UPDATED = {"run": {"formulation": "updated-lagrangian"}, "model": "jaumann"}
CELLS = {"run": {"formulation": "total-lagrangian"}, "placement": "cells"}
FORMS: dict[str, tuple[int, dict[str, Any]]] = {
    "bar of stress points": (1, {"state": "stress"}),
    "bar of cells": (1, {"state": "stress", **CELLS}),
    "stress points": (2, {}),
    "edges": (2, {"run": {"formulation": "total-lagrangian"}}),
    "cells": (2, CELLS),
    "updated-lagrangian": (2, UPDATED),
    "disc in stairs": (2, {"shape": DISC, "surface": "stairs"}),
    "disc of cells": (2, {"shape": DISC, **CELLS}),
    "fitted disc": (2, {"shape": DISC}),
    "single precision": (
        2,
        {"shape": DISC, "run": {"formulation": "total-lagrangian", "precision": "f32"}, "placement": "cells"},
    ),
    "stress points in 3D": (3, {}),
    "sphere of cells": (3, {"shape": SPHERE, **CELLS}),
}
pytestmark = pytest.mark.filterwarnings("ignore:body")


def system_of(dim: int, keys: dict[str, Any], **tables: Any) -> OneSetSystem:
    keys = dict(keys)
    run, model = keys.pop("run", {"formulation": "stress-points"}), keys.pop("model", "elastic")
    shape = keys.pop("shape", scenes.cube(dim))
    body = scenes.body(shape, 0.125, material=scenes.material(model), **keys)
    system = compose(scenes.scene(body, run=run, **tables)).bodies[0].system
    assert isinstance(system, OneSetSystem)
    return system


def surface_of(system: OneSetSystem, *, lagged: bool = False) -> Surface:
    return Surface("b", system, system.position.mean(0) + 0.25, lagged=lagged)


def moving(system: OneSetSystem, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Displacements and velocities of the particles of a body, which its state has then."""
    random = np.random.default_rng(seed)
    shape = system.count, system.space.dim
    u, v = 0.1 * random.normal(size=shape), random.normal(size=shape)
    system.state.write("displacement", u)
    system.state.write("velocity", v)
    return u, v


def every(surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    return np.arange(surface.n), np.arange(surface.m)


def rounding(system: OneSetSystem) -> float:
    return 60.0 * system.space.epsilon


def rate_of(surface: Surface, system: OneSetSystem) -> State:
    rate = system.temporary()
    surface.spread(rate)
    return rate


def corner_normals(surface: Surface, x: np.ndarray, area: np.ndarray) -> np.ndarray:
    """At every corner the area vectors of its faces over the squares of their edges there (Max 1999)."""
    starts, smooth, _ = surface.mesh.groups()
    faces = surface.mesh.faces
    corner = np.repeat(faces.ravel(), np.diff(starts))
    edges = x[faces[smooth]] - x[corner][:, None]
    squares = np.where(faces[smooth] == corner[:, None], 1.0, (edges**2).sum(2))
    return np.add.reduceat(area[smooth] / squares.prod(1)[:, None], starts[:-1], axis=0)


@pytest.mark.parametrize("name", FORMS)
def test_where_a_surface_is_and_how_it_lies(name: str) -> None:
    system = system_of(*FORMS[name])
    surface = surface_of(system)
    start = surface.places()
    u, v = moving(system)
    surface.place(system.state)
    off = rounding(system)
    X = (surface.mesh.X - system.position.mean(0) - 0.25) / system.scales.length
    x, struct = X + surface.B @ u, surface.struct
    assert start == pytest.approx(X, abs=off)
    assert struct.x.numpy() == pytest.approx(x, abs=off * max(1.0, np.abs(X).max()))
    assert surface.places() == pytest.approx(x, abs=off)
    assert struct.moved.numpy() == pytest.approx(surface.B @ u, abs=off)
    assert struct.speed.numpy() == pytest.approx(surface.B @ v, abs=10.0 * off)
    area = area_vectors(x, surface.mesh.faces, surface.mesh.N)
    assert struct.area.numpy() == pytest.approx(area, abs=off * max(1.0, np.abs(X).max()))
    mean = corner_normals(surface, x, area)
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    clear = length[:, 0] > 0.1
    assert struct.normal.numpy()[clear] == pytest.approx((mean / length)[clear], abs=100.0 * off)


@pytest.mark.parametrize("name", FORMS)
def test_particles_feel_what_the_vertices_feel(name: str) -> None:
    """Accelerations are B^T f/m, and the work of a step is that at the vertices."""
    system = system_of(*FORMS[name])
    surface = surface_of(system)
    random = np.random.default_rng(4)
    forces = random.normal(size=(2, surface.n, system.space.dim))
    u, _ = moving(system)
    surface.attend(*every(surface))
    surface.place(system.state)
    assert not surface.force.numpy().any()
    surface.force.assign(forces[0].astype(system.space.numpy))
    expected = surface.B.T @ forces[0] / surface.mass[:, None]
    assert rate_of(surface, system).read("velocity") == pytest.approx(expected, abs=20.0 * rounding(system))
    assert surface.resultant() == pytest.approx(forces[0].sum(0), abs=rounding(system) * surface.n)
    surface.start(system.state)
    assert surface.work == 0.0
    later, _ = moving(system, 1)
    surface.place(system.state)
    way = surface.B @ (later - u)
    assert surface.struct.moved.numpy() == pytest.approx(way, abs=rounding(system))
    surface.force.assign(forces[1].astype(system.space.numpy))
    rate_of(surface, system)
    surface.close(system.state)
    work = 0.5 * (forces.sum(0) * way).sum()
    assert surface.work == pytest.approx(work, abs=rounding(system) * np.abs(forces).sum())
    surface.place(system.state)
    assert not surface.struct.moved.numpy().any()


@pytest.mark.parametrize("name", ["bar of cells", "edges", "cells"])
def test_lagged_velocities_are_the_ways_of_the_step(name: str) -> None:
    system = system_of(*FORMS[name])
    surface = surface_of(system, lagged=True)
    u, _ = moving(system)
    surface.place(system.state)
    assert surface.struct.speed.numpy() == pytest.approx(surface.B @ u / system.clock.dt)


@pytest.mark.parametrize("name", ["stress points", "disc of cells", "stress points in 3D"])
def test_what_is_not_near_is_left_alone(name: str) -> None:
    """Of a few vertices and faces all is as it is with all of them; others feel nothing, and their particles neither."""
    system = system_of(*FORMS[name])
    surface, other = surface_of(system), surface_of(system)
    for each in (surface, other):
        each.attend(*every(each))
    vertices, faces = np.array([3, 1]), np.array([7])
    surface.attend(vertices, faces)
    moving(system)
    for each in (surface, other):
        each.place(system.state)
    seen = np.unique([*vertices, *surface.mesh.faces[faces].ravel()])
    corners = faces[0] * system.space.dim + np.arange(system.space.dim)
    around = np.unique(
        np.concatenate(
            [
                surface.mesh.around[a:b]
                for a, b in zip(surface.mesh.starts[seen], surface.mesh.starts[seen + 1], strict=True)
            ]
        )
    )
    for field, rows in (("x", seen), ("moved", seen), ("speed", seen), ("area", around), ("normal", corners)):
        one, both = (getattr(each.struct, field).numpy()[rows] for each in (surface, other))
        assert (one == both).all()
    far = np.setdiff1d(np.arange(surface.n), np.unique(surface.mesh.faces[around]))
    assert not surface.struct.moved.numpy()[far].any()
    force = np.zeros((surface.n, system.space.dim))
    force[seen] = np.random.default_rng(2).normal(size=(len(seen), system.space.dim))
    rates = []
    for each in (surface, other):
        each.force.assign(force)
        rates.append(rate_of(each, system).read("velocity"))
        each.close(system.state)
    assert (rates[0] == rates[1]).all()
    assert surface.work == other.work
    assert surface.work != 0.0


def test_a_force_that_is_no_longer_near_does_no_more_work() -> None:
    """Not even on particles that vertices which are near share with it."""
    system = system_of(*FORMS["cells"])
    surface = surface_of(system)
    surface.place(system.state)
    surface.force.fill_(1.0)
    rate_of(surface, system)
    surface.close(system.state)
    nothing = np.zeros(0, int)
    surface.attend(np.zeros(1, int), nothing)
    moving(system)
    surface.place(system.state)
    assert not rate_of(surface, system).read("velocity").any()
    surface.attend(nothing, nothing)
    surface.close(system.state)
    assert surface.work == 0.0
    # Ways are counted from where the last step ended, whether or not it was near then.
    surface.attend(*every(surface))
    surface.place(system.state)
    assert not surface.struct.moved.numpy().any()


@pytest.mark.parametrize("name", ["bar of cells", "stress points", "cells", "disc in stairs", "sphere of cells"])
def test_the_bound_of_springs_holds_and_is_not_far(name: str) -> None:
    """Against the largest eigenvalue of M^-1 B^T k B."""
    system = system_of(*FORMS[name])
    surface = surface_of(system)
    k = np.random.default_rng(6).uniform(0.5, 1.5, surface.n)
    B = surface.B.dense() / np.sqrt(surface.mass)
    largest = np.linalg.eigvalsh(B.T @ (k[:, None] * B))[-1]
    bound = surface.square(k)
    assert largest <= bound * (1.0 + 1e-12)
    assert bound < 2.5 * largest


def test_particles_that_are_held_do_not_count_in_the_bound() -> None:
    held = [{"body": "b", "where": "x < 9", "fixed": ["x", "y"]}]
    assert surface_of(system_of(2, {}, boundary=held)).square(np.ones(32)) == 0.0
    slides = [{"body": "b", "where": "x < 9", "fixed": ["x"]}]
    assert surface_of(system_of(2, {}, boundary=slides)).square(np.ones(32)) == pytest.approx(4.0)


def test_moduli_and_sizes() -> None:
    """Of unit stiffness and density c^2 = (1 - nu)/((1 + nu)(1 - 2 nu))."""
    system = system_of(2, {})
    surface = surface_of(system)
    stiff = 0.7 / (1.3 * 0.4)
    unit = system.scales.density * system.scales.velocity**2
    assert surface.modulus * unit == pytest.approx(stiff)
    assert surface.impedance * system.scales.density * system.scales.velocity == pytest.approx(stiff**0.5)
    assert surface.wave_speed * system.scales.velocity == pytest.approx(stiff**0.5)
    assert surface.spacing * system.scales.length == pytest.approx(0.125)
    assert surface.struct.size.numpy().sum() * system.scales.length == pytest.approx(4.0)


def test_a_body_in_touch_with_itself_meets_neither_its_neighbourhood_nor_itself_from_behind() -> None:
    """The arms of a U of two cells: the outer side of an arm is behind the inner one, the other arm is not."""
    arms = [scenes.box((0.0, 0.25), (0.0, 2.0)), scenes.box((0.5, 0.75), (0.0, 2.0)), scenes.box(0.75, 0.25)]
    system = system_of(2, {"shape": {"type": "union", "shapes": arms}})
    surface = surface_of(system)
    X, middles = surface.mesh.X, surface.mesh.X[surface.mesh.faces].mean(1)
    vertex = int(np.linalg.norm(X - [0.25, 1.5], axis=1).argmin())
    ways = {"beside": [0.25, 1.6], "across": [0.5, 1.55], "along": [0.25, 1.0], "behind": [0.0, 1.55]}
    faces = np.array([np.linalg.norm(middles - at, axis=1).argmin() for at in ways.values()])
    meets = surface.meets(np.full(len(faces), vertex), faces)
    assert dict(zip(ways, meets.tolist(), strict=True)) == {
        "beside": False,
        "across": True,
        "along": True,
        "behind": True,
    }
    # Behind 1.5 spacings of material, not two.
    thin = surface_of(system_of(2, {"shape": scenes.box(1.0, 0.125)}))
    X, middles = thin.mesh.X, thin.mesh.X[thin.mesh.faces].mean(1)
    vertex = int(np.linalg.norm(X - [0.5, 0.125], axis=1).argmin())
    under = int(np.linalg.norm(middles - [0.4375, 0.0], axis=1).argmin())
    far = int(np.linalg.norm(middles - [0.9375, 0.0], axis=1).argmin())
    assert thin.meets(np.array([vertex, vertex]), np.array([under, far])).tolist() == [False, True]


def test_a_run_goes_on_from_what_is_kept() -> None:
    """Works have the same bits, with whatever is near then."""
    system = system_of(*FORMS["disc of cells"])
    surface = surface_of(system)
    force = np.random.default_rng(3).normal(size=(surface.n, 2))

    def step(each: Surface, seed: int) -> None:
        moving(system, seed)
        each.place(system.state)
        each.force.assign(force)
        rate_of(each, system)
        each.close(system.state)

    step(surface, 0)
    kept = {name: array.numpy().copy() for name, array in surface.kept().items()}
    resumed = surface_of(system)
    for name, array in resumed.kept().items():
        array.assign(kept[name])
    assert resumed.as_kept({}) is None
    resumed.attend(*every(resumed))
    for each in (surface, resumed):
        moving(system, 0)
        step(each, 1)
    assert resumed.work == surface.work
    assert (resumed.struct.moved.numpy() == surface.struct.moved.numpy()).all()
