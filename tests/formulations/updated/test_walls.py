"""Walls, images behind them and loads on faces of the updated-Lagrangian form: linear fields, equilibrium, work, columns."""

import itertools

import numpy as np
import pytest

import wsph
from tests import scenes
from wsph.formulations.updated.system import UpdatedSystem
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

FORM = {"formulation": "updated-lagrangian", "cfl": 0.7}
OUTPUT = {"fields": ["stress", "velocity", "displacement"], "history": 100}


def sliding(dim: int, *faces: str) -> list[dict]:
    """Faces on which a body slides."""
    return [{"body": "b", "face": face, "symmetry": face[1]} for face in faces]


def closed(dim: int, precision: str = "f64", **velocity: object) -> Composition:
    """A cube with images behind all of its faces: one driven, one held, the others sliding."""
    faces = [sign + axis for axis in "xyz"[1:dim] for sign in "-+"]
    tables = {"boundary": [scenes.held("-x", 1), *sliding(dim, *faces), scenes.driven("+x", x=0.1, **velocity)]}
    run = FORM | {"precision": precision}
    return compose(scenes.block(dim, 6, model="jaumann", run=run, tables=tables))


def put(system: UpdatedSystem, name: str, values: np.ndarray) -> None:
    """Set a field to one value everywhere."""
    system.state.write(name, np.tile(values, (system.state.counts[name], 1)))


@pytest.mark.parametrize(("dim", "precision"), [*itertools.product((1, 2, 3), ("f64",)), (2, "f32")])
def test_a_linear_field_has_its_gradient_up_to_the_walls(dim: int, precision: str) -> None:
    composition = closed(dim, precision)
    system, eps = composition.bodies[0].system, 1e-13 if precision == "f64" else 2e-5
    state, rate = system.state, system.new()
    state.write("velocity", 0.1 * system.position * np.eye(dim)[0] / composition.scales.velocity)
    strain = 0.1 * composition.scales.time
    for ahead in (0.0, 0.5):
        system.rate(state, rate, "rest", ahead=ahead)
        gradient = rate.read("deformation")
        np.testing.assert_allclose(gradient[:, 0], strain, rtol=eps)
        assert np.abs(gradient[:, 1:]).max(initial=0.0) < eps * strain
        assert np.abs(rate.read("deviation")).max() < 10.0 * eps * strain


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_a_uniform_stress_is_in_equilibrium_with_walls(dim: int) -> None:
    system = closed(dim).bodies[0].system
    state, rate = system.state, system.new()
    labels = system.constitutive.state.labels
    put(system, "stress", np.array([float(len(set(label)) == 1) for label in labels]))
    system.rate(state, rate, "velocity")
    assert np.abs(rate.read("velocity")).max() < 1e-12


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("remembers", [True, False])
def test_walls_do_what_forces_and_stresses_do_not(dim: int, remembers: bool) -> None:
    """Power of forces, of stresses and of what is remembered, at any disturbed state: their sum is the walls'."""
    faces = [scenes.driven("+x", **dict.fromkeys("xyz"[:dim], 0.1)), *sliding(dim, *(f"-{a}" for a in "xyz"[:dim]))]
    keys = {} if remembers else {"residual": False}
    composition = compose(scenes.block(dim, 6, model="jaumann", run=FORM, tables={"boundary": faces}, **keys))
    system, random = composition.bodies[0].system, np.random.default_rng(0)
    state, rate = system.state, system.new()
    for name in ("velocity", "displacement", "deformation", "stress", "wall", *(["deviation"] if remembers else [])):
        state.write(name, 0.05 * random.standard_normal((state.counts[name], state.widths[name])))
    system.follow()
    system.start_works()
    system.rate(state, rate)
    F, dF = (each.read("deformation").reshape(-1, dim, dim) for each in (state, rate))
    F = F + np.eye(dim)
    L = dF @ np.linalg.inv(F)
    labels = system.constitutive.state.labels
    sigma = np.zeros_like(F)
    for k, label in enumerate(labels):
        a, b = ("xyz".index(axis) for axis in label)
        if max(a, b) < dim:
            sigma[:, a, b] = sigma[:, b, a] = state.read("stress")[:, k]
    stored = (system.volume * np.linalg.det(F) * (sigma * L).sum((1, 2))).sum()
    if remembers:
        D, dD = state.read("deviation")[..., None], rate.read("deviation")[..., None]
        spring = float(system.rates._points.stabilisation) * system.volume
        stored += (spring * ((F @ D) * (dF @ D + F @ dD)).sum((1, 2))).sum()
    forces = (system.density * system.volume[:, None] * rate.read("velocity") * state.read("velocity")).sum()
    walls = float(system._wall_work._power.numpy().sum())
    assert abs(walls) > 1e-4
    assert walls == pytest.approx(stored + forces, abs=1e-12)


def column(**keys: object) -> wsph.Scene:
    """A column under its own weight, 4 x 40 cells, between walls on which it slides."""
    body = scenes.body(scenes.box(1.0, 10.0), 0.25, damping={"rate": 0.12}, **keys)
    return scenes.scene(
        body, boundary=sliding(2, "-x", "+x", "-y"), gravity={"y": -1e-5}, run=FORM | {"end": 140.0}, output=OUTPUT
    )


def test_a_column_under_its_weight() -> None:
    """Stress within .2 % down to the walls, and a ledger that stands still."""
    result = wsph.run(column())
    y, stress = result.particles["position"][:, 1], result.particles["stress"]
    inside = y < 9.0
    np.testing.assert_allclose(stress[inside, 1], -1e-5 * (10.0 - y[inside]), rtol=2e-3)
    np.testing.assert_allclose(stress[inside, 0] / stress[inside, 1], 3.0 / 7.0, rtol=1e-3)
    assert np.abs(result.particles["velocity"]).max() < 1e-7
    assert abs(result.summary["energy"]["residual"]) < 1e-3 * result.summary["energy"]["external_work"]


SMOOTHLY = "5e-5*(1 - cos(pi*t/20))*(t < 20) + 1e-4*(t >= 20)"
"""A load of 1e-4."""

DRIVEN = "1e-5*(1 - cos(pi*t/10))*(t < 20)"
"""A way of 2e-4."""

PULLED = [
    ("uniaxial stress", 1, "stress", 0.3),
    ("uniaxial strain", 1, "strain", 0.3),
    ("plane stress", 2, "stress", 0.3),
    ("plane strain", 2, "strain", 0.3),
    ("three dimensions", 3, None, 0.3),
]


@pytest.mark.parametrize("by", ["load", "wall"])
@pytest.mark.parametrize(("name", "dim", "state", "ratio"), PULLED, ids=[each[0] for each in PULLED])
def test_a_pulled_bar_has_one_stress(by: str, name: str, dim: int, state: str | None, ratio: float) -> None:
    """Held, sliding, free and loaded or driven faces; whole ends too."""
    sides = [6.0, *([1.5] * (dim - 1))]
    pull = 1e-4
    end = {"body": "b", "face": "+x", "traction": {"x": SMOOTHLY}} if by == "load" else scenes.driven("+x", x=DRIVEN)
    boundary = [{"body": "b", "face": "-x", "fixed": ["x"]}, *sliding(dim, *("-y", "-z")[: dim - 1]), end]
    keys = {"state": state} if state else {}
    body = scenes.body(
        scenes.box(*sides), 0.5, damping={"rate": 0.5}, material=scenes.material(poisson_ratio=ratio), **keys
    )
    result = wsph.run(scenes.scene(body, boundary=boundary, run=FORM | {"end": 100.0}, output=OUTPUT))
    stress = result.particles["stress"][:, 0]
    stiffness = {"uniaxial strain": 0.7 / (1.3 * 0.4), "plane strain": 1.0 / 0.91}.get(name, 1.0)
    x, u = result.particles["position"][:, 0], result.particles["displacement"][:, 0]
    right = pull if by == "load" else stiffness * (u[x.argmax()] - u[x.argmin()]) / (x.max() - x.min())
    np.testing.assert_allclose(stress, right, rtol=5e-4)
    assert abs(result.summary["energy"]["residual"]) < 2e-3 * result.summary["energy"]["external_work"]


@pytest.mark.parametrize("by", ["load", "wall"])
def test_a_turned_bar_has_one_stress(by: str) -> None:
    """Along its own axis, which is none of the coordinates'; its ends are held and driven in all components."""
    angle = 0.5
    along = np.array([np.cos(angle), np.sin(angle)])
    shape = scenes.box(6.0, 1.5) | {"rotate": float(np.degrees(angle))}
    speeds = [f"{each}*{DRIVEN}" for each in along]
    end = (
        {"body": "b", "face": "+x", "stress": {"xx": 1e-4}}
        if by == "load"
        else scenes.driven("+x", x=speeds[0], y=speeds[1])
    )
    body = scenes.body(shape, 0.5, state="stress", damping={"rate": 0.5}, material=scenes.material(poisson_ratio=0.0))
    result = wsph.run(
        scenes.scene(body, boundary=[scenes.held("-x", 2), end], run=FORM | {"end": 100.0}, output=OUTPUT)
    )
    stress = result.particles["stress"]
    tensor = stress[:, [0, 3, 3, 1]].reshape(-1, 2, 2)
    own = np.einsum("a,nab,b->n", along, tensor, along)
    right = 1e-4 if by == "load" else own.mean()
    np.testing.assert_allclose(own, right, rtol=5e-4)
    assert right == pytest.approx(1e-4 if by == "load" else 2e-4 / 6.0, rel=0.02)
    assert np.abs(tensor - right * np.outer(along, along)).max() < 5e-4 * right


def test_the_resultant_of_a_load_is_that_of_its_face() -> None:
    """A traction that varies along the face, and one on a part of it: forces and their moment about the middle."""
    for condition, area in (({"face": "+x"}, 1.0), ({"where": "x > 0.9 and y > 0.1 and y < 0.4"}, 0.3)):
        boundary = [{"body": "b", **condition, "traction": {"y": 1.0}}]
        system = compose(scenes.block(2, 10, run=FORM, tables={"boundary": boundary})).bodies[0].system
        forces = system.loads.vectors.numpy()
        assert forces[:, 1].sum() * system.scales.length * system.scales.stress == pytest.approx(area, rel=1e-12)
        if area == 1.0:
            arm = (system.position[:, 0] * forces[:, 1]).sum() / forces[:, 1].sum()
            assert arm == pytest.approx(1.0, rel=1e-12)


def test_a_wall_that_is_not_one_is_named() -> None:
    speed = {"boundary": [scenes.driven("+x", x="0.1*y")]}
    with pytest.warns(RuntimeWarning, match=r"face '\+x'.*not the same all over the face.*stress-points"):
        system = compose(scenes.block(2, 6, run=FORM, tables=speed)).bodies[0].system
    assert not system.walls
    assert (system.free_components == 0.0).sum() == 6


@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_loads_on_opposite_faces_have_one_stress_between_them(turn: float) -> None:
    """A free plate that is pulled at both ends: the loads have no resultant, and each is its face's."""
    plate = scenes.body({**scenes.box(1.0, 0.5), "rotate": turn}, 0.125, damping={"rate": 1.0})
    pull = {"xx": "1e-4*min(t/10, 1)"}
    ends = [{"body": "b", "face": face, "stress": pull} for face in ("-x", "+x")]
    run = {"formulation": "updated-lagrangian", "end": 40.0, "cfl": 0.4}
    stress = wsph.run(scenes.scene(plate, run=run, boundary=ends)).particles["stress"]
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for column, exact in ((0, c * c), (1, s * s), (3, c * s)):
        assert stress[:, column] == pytest.approx(np.full(len(stress), 1e-4 * exact), abs=3e-7)


def test_a_jittered_lattice_is_named() -> None:
    """Its stress is 5 to 50 % off: the patch test of `tests/extremes/forms.py`."""
    with pytest.warns(RuntimeWarning, match="pairs of a kernel that follow.*jittered"):
        compose(scenes.block(2, 4, run=FORM, jitter=0.2))
