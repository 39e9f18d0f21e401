"""Linear velocities in two-set bodies: every stress state and dimension, driven and loaded faces, turned, jittered."""

from typing import Any

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.geometry.shapes.shape import rotation_matrix
from wsph.output.fields import AXES, TENSOR

FORMS = ("tsph", "ul-tsph")
STATES = [(1, "stress"), (1, "strain"), (2, "stress"), (2, "strain"), (3, "")]
TURN: dict[int, Any] = {2: 30.0, 3: [[1, 2, 3], 50.0]}


def tensors(packed: np.ndarray) -> np.ndarray:
    """(n, 6) as (n, 3, 3)."""
    full = np.zeros((len(packed), 3, 3))
    for k, (i, j) in enumerate((AXES.index(a), AXES.index(b)) for a, b in TENSOR):
        full[:, i, j] = full[:, j, i] = packed[:, k]
    return full


def stress_rate(gradient: np.ndarray, state: str, poisson: float = 0.3) -> np.ndarray:
    """Of linear elasticity with E = 1, (3, 3): Hooke's law, no stress along what a stress state leaves free."""
    dim, shear = len(gradient), 0.5 / (1.0 + poisson)
    first = 2.0 * shear * poisson / (1.0 - 2.0 * poisson)
    D = np.zeros((3, 3))
    D[:dim, :dim] = 0.5 * (gradient + gradient.T)
    if state == "stress":
        free = np.arange(dim, 3)
        D[free, free] = -first * np.trace(D) / (first * len(free) + 2.0 * shear)
    return first * np.trace(D) * np.eye(3) + 2.0 * shear * D


def linear(gradient: np.ndarray) -> dict[str, str]:
    """Expressions of the velocity `gradient` . x."""
    axes = AXES[: len(gradient)]
    return {
        a: " + ".join(f"({float(g)!r})*{b}" for g, b in zip(row, axes, strict=True))
        for a, row in zip(axes, gradient, strict=True)
    }


def error(integrator: str, dim: int, state: str, seed: int, *, jitter: float = 0.0, turned: bool = False) -> float:
    """Largest error of the stress after a unit of time, over the largest stress, of a cube whose faces prescribe velocity or
    stress in each direction as a throw of `seed` says; a turned body's faces drive all or load all."""
    random = np.random.default_rng(seed)
    # A rate law in the current configuration agrees with Hooke's to the size of the strain.
    gradient = (1e-3 if integrator == "tsph" else 1e-7) * random.uniform(-1.0, 1.0, (dim, dim))
    rate, R = stress_rate(gradient, state), np.eye(dim)
    shape = scenes.cube(dim)
    if turned:
        angle = TURN[dim]
        R = rotation_matrix((tuple(angle[0]), angle[1]) if dim == 3 else angle, dim)
        shape["rotate"] = angle
    velocity = linear(R @ gradient @ R.T)
    boundary = []
    for k, name in enumerate(AXES[:dim]):
        for sign in "-+":
            drives = np.full(dim, random.random() < 0.5) if turned else random.random(dim) < 0.5
            condition: dict[str, Any] = {"body": "b", "face": sign + name}
            moved = {a: velocity[a] for a, d in zip(AXES, drives, strict=False) if d}
            loads = {
                "".join(AXES[m] for m in sorted((k, j))): f"{float(rate[k, j])!r}*t" for j in np.flatnonzero(~drives)
            }
            boundary.append(condition | ({"velocity": moved} if moved else {}) | ({"stress": loads} if loads else {}))
    keys = {"state": state} if dim < 3 else {}
    body = scenes.body(shape, 1.0 / (4 if dim < 3 else 3), velocity=list(velocity.values()), jitter=jitter, **keys,
                       material=scenes.material("elastic" if integrator == "tsph" else "jaumann"))  # fmt: skip
    run = {"integrator": integrator, "end": 1.0, "cfl": 0.5, "guard": "off"}
    result = wsph.run(scenes.scene(body, run=run, boundary=boundary, output={"fields": ["stress"]}))
    Q = np.eye(3)
    Q[:dim, :dim] = R
    found = Q.T @ tensors(result.particles["stress"]) @ Q
    return float(np.abs(found - rate * result.time).max() / np.abs(rate * result.time).max())


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize(("dim", "state"), STATES)
def test_a_linear_velocity_gives_one_stress(integrator: str, dim: int, state: str) -> None:
    bound = 1e-13 if integrator == "tsph" else 1e-6
    for seed in range(3):
        for jitter in (0.0, 0.2):
            assert error(integrator, dim, state, seed, jitter=jitter) < bound, (seed, jitter)


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize("dim", [2, 3])
def test_in_a_turned_body_too(integrator: str, dim: int) -> None:
    bound = 1e-13 if integrator == "tsph" else 1e-6
    for seed in range(2):
        assert error(integrator, dim, "strain", seed, jitter=0.2 * seed, turned=True) < bound, seed


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize(
    "material",
    [
        {"model": "mises", "yield_stress": 0.01, "hardening_modulus": 0.1},
        {"model": "perzyna", "yield_stress": 0.01, "hardening_modulus": 0.1, "fluidity": 0.1, "exponent": 1.0},
    ],
)
def test_what_yields_under_a_linear_velocity_stays_of_one_stress(integrator: str, material: dict) -> None:
    """A square whose sides are sheared, corners included; its stresses beyond yield."""
    velocity = linear(np.array([[0.0, 0.05], [0.01, 0.0]]))
    drive = {"body": "b", "where": "x <= 0 or x >= 1 or y <= 0 or y >= 1", "velocity": velocity}
    run = {"integrator": integrator, "end": 1.0, "cfl": 0.2}
    scene = scenes.block(2, 4, run=run, tables={"boundary": [drive]}, velocity=list(velocity.values()),
                         material=scenes.material(**material))  # fmt: skip
    stress = wsph.run(scene).particles["stress"]
    assert np.ptp(stress, axis=0).max() < 1e-13
    yields = np.sqrt(3.0) * np.abs(stress[:, 3]).max()
    assert yields > 0.0101
    assert yields < 0.9 * np.sqrt(3.0) * 0.06 / 2.6


def test_jittered_bodies_see_two_layers() -> None:
    """With one, a face that bears a load finds wrong stress."""
    system = (
        wsph.simulation.compose.compose(scenes.block(2, 4, run={"integrator": "tsph"}, jitter=0.2)).bodies[0].system
    )
    regular = wsph.simulation.compose.compose(scenes.block(2, 4, run={"integrator": "tsph"})).bodies[0].system
    assert system.pairs > 2 * regular.pairs


@pytest.mark.parametrize("integrator", FORMS)
@pytest.mark.parametrize("exponent", [0.0, 1.0])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_dissipation_grows_at_every_particle(integrator: str, exponent: float, jitter: float) -> None:
    """Waves across a block that flows and softens: nowhere does plastic strain, or what it dissipates, shrink in a step."""
    material = scenes.material("perzyna", yield_stress=0.01, hardening_modulus=0.1, fluidity=0.5, exponent=exponent)
    boundary = [scenes.held("-x", 2), {"body": "b", "face": "+x", "stress": {"xx": "-.03*(t<1)"}}]
    scene = scenes.block(2, 8, run={"integrator": integrator, "cfl": 0.2, "guard": "off"}, material=material, jitter=jitter,
                         tables={"boundary": boundary}, velocity=[".05*sin(6*x)*(1 + y)", "0.04*cos(5*y)*x"])  # fmt: skip
    composition = wsph.simulation.compose.compose(scene)
    run, before = composition.bodies[0], 0.0
    # The stored energy, an internal of what moves, may fall.
    grows = [list(run.constitutive.internals).index(name) for name in ("plastic_strain", "dissipation")]
    for _ in range(40):
        composition.program.run(1)
        now = run.system.state.read("internals")[:, grows].copy()
        assert (now >= before).all()
        before = now
    assert now.max() > 1e-3
