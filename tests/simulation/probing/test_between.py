"""Points between particles: linear fields to rounding, quadratic ones without an error that goes with the place."""

import numpy as np
import pytest

import wsph
from tests import scenes
from tests.simulation.test_probes import FORMS
from wsph.formulations.reading import Reading
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import BodyRun

SLOPE = np.array([0.3, 0.7, -0.2])
CURVED = np.array([[0.5, 0.2, 0.1], [0.2, -0.4, 0.3], [0.1, 0.3, 0.6]])
TWO_SETS = ("tsph", "ul-tsph")
"""They average to the middles of the cells, which adds h^2/8 of second derivatives everywhere alike."""


def linear(x: np.ndarray) -> np.ndarray:
    return 1.0 + x @ SLOPE[: x.shape[1]]


def quadratic(x: np.ndarray) -> np.ndarray:
    dim = x.shape[1]
    return np.einsum("ni,ij,nj->n", x, CURVED[:dim, :dim], x)


def composed(form: str, shape: scenes.Data, spacing: float, dim: int, **keys: object) -> BodyRun:
    scene = scenes.block(dim, 8, run={**FORMS[form], "cfl": 0.2, "guard": "warn"}, velocity=["0.1*x", "0", "0"][:dim])
    changes = {f"bodies.0.{key}": value for key, value in {"shape": shape, "spacing": spacing, **keys}.items()}
    return compose(scene.with_(**changes)).bodies[0]


def errors(read: Reading, points: np.ndarray, of, name: str) -> np.ndarray:
    """What each of the components of a field errs by, (m, width)."""
    values, found = of(read.where(name)), read.sample(points, name)
    return np.stack([np.bincount(a.rows, a.weights * values[a.places], a.count) - of(points) for a in found], 1)


def points_in(dim: int, count: int = 150, low: float = 0.0, high: float = 1.0) -> np.ndarray:
    return np.random.default_rng(dim).uniform(low, high, (count, dim))


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_every_field_of_every_form(form: str, dim: int, jitter: float) -> None:
    """Up to the faces, in every offset to the lattice."""
    n = 8 if dim < 3 else 6
    read, points = composed(form, scenes.cube(dim), 1.0 / n, dim, jitter=jitter).reading, points_in(dim)
    for name in read.fields:
        assert np.abs(errors(read, points, linear, name)).max() < 1e-11
        apart = errors(read, points, quadratic, name)
        # A linear interpolation errs by up to .5 h^2 in the middle of a cell and by nothing on a particle.
        if form in TWO_SETS:
            assert np.abs(apart).max() < 0.7 / n**2
        else:
            assert np.mean(np.abs(apart) > 1e-11) < 0.02
            assert np.abs(apart).max() < 1.0 / n**2


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("form", TWO_SETS)
def test_two_sets_err_by_the_same_wherever_a_point_is(form: str, dim: int) -> None:
    n = 10
    read = composed(form, scenes.cube(dim), 1.0 / n, dim).reading
    points = points_in(dim, 60, 0.4, 0.6)
    apart = errors(read, points, quadratic, "velocity")
    assert apart * n**2 == pytest.approx(np.full(apart.shape, 0.25 * np.trace(CURVED[:dim, :dim])), abs=1e-10)


@pytest.mark.parametrize("kind", ["disc", "sphere", "notch"])
def test_fitted_and_notched_bodies(kind: str) -> None:
    dim = 3 if kind == "sphere" else 2
    if kind == "notch":
        shape = {"type": "difference", "shapes": [scenes.cube(2), scenes.box((0.4, 0.6), (0.5, 1.0))]}
        read = composed("stress-points", shape, 0.1, 2).reading
        points = points_in(2)
        points = points[~((np.abs(points[:, 0] - 0.5) < 0.1) & (points[:, 1] > 0.5))]
    else:
        shape = {"type": kind, "center": [0.5] * dim, "radius": 0.5}
        read = composed("stress-points", shape, 0.1, dim, surface="fitted").reading
        points = points_in(dim, 300)
        points = points[np.linalg.norm(points - 0.5, axis=1) < 0.49]
    for name in ("velocity", "stress"):
        assert np.abs(errors(read, points, linear, name)).max() < 1e-11
        apart = np.abs(errors(read, points, quadratic, name))
        assert np.mean(apart > 1e-11) < 0.02
        assert apart.max() < 0.01


def test_what_is_left_is_of_third_order() -> None:
    points = points_in(2, 100, 0.2, 0.8)
    worst = []
    for n in (10, 20):
        read = composed("stress-points", scenes.cube(2), 1.0 / n, 2).reading
        worst.append(np.abs(errors(read, points, lambda x: np.sin(2.0 * x[:, 0] + x[:, 1]), "velocity")).max())
    assert worst[0] < 5e-4  # a quarter of |slope|^3 h^3/6
    assert worst[1] < worst[0] / 6.0


def test_bodies_of_a_cell_are_read_linearly() -> None:
    """Too few places for a quadratic field."""
    read, points = composed("stress-points", scenes.cube(2), 1.0, 2).reading, points_in(2, 20)
    assert np.abs(errors(read, points, linear, "velocity")).max() < 1e-12
    assert np.abs(errors(read, points, quadratic, "velocity")).max() > 0.05


@pytest.mark.parametrize("form", ["stress-points", "edges", "kernel pairs", "updated-lagrangian"])
def test_nothing_is_read_through_a_crack(form: str) -> None:
    """1 above the crack and -1 below it, also where particles stand on it, on a side each."""
    crack = [{"from": [0.0, 0.5], "to": [0.5, 0.5]}]
    run = composed(form, scenes.cube(2), 0.125, 2, cracks=crack)
    read, geometry = run.reading, run.system.geometry
    for name in ("velocity", "stress"):
        count = len(read.where(name))
        place = geometry.off_cracks[0 if count == len(geometry.nodes) else 1]
        side = np.sign(place[:, 1] - 4.0)
        for y in (0.47, 0.499, 0.501, 0.53):
            (a, *_) = read.sample(np.array([[0.16, y]]), name)
            assert a.weights @ side[a.places] == pytest.approx(np.sign(y - 0.5), abs=1e-12)
    with pytest.raises(ValueError, match="is on a crack, with a value on either side"):
        read.sample(np.array([[0.16, 0.5]]), "velocity")


def test_a_probe_on_a_line_reads_a_curved_velocity() -> None:
    line = {"from": [0.03, 0.11], "to": [0.93, 0.77], "points": 7}
    probe = {"name": "p", "line": line, "fields": ["velocity_x"]}
    run = {"formulation": "stress-points", "cfl": 0.2, "end": 0.01}
    read = wsph.run(scenes.block(2, 8, run=run, velocity=["1e-3*x*y", "0"], tables={"probes": [probe]})).probes["p"]
    along = np.linspace(0.0, 1.0, 7)[:, None]
    points = (1.0 - along) * [0.03, 0.11] + along * [0.93, 0.77]
    first = [read[f"velocity_x[{k}]"][0] for k in range(7)]
    assert first == pytest.approx(1e-3 * points.prod(1), rel=1e-12)
