"""Operators: patch tests on jittered clouds, order on lattices, what the ranks say."""

import numpy as np
import pytest
import warp as wp

from wsph.backend.space import Space
from wsph.geometry.lattice import lattice
from wsph.geometry.shapes.box import Box
from wsph.sph import weights
from wsph.sph.pairs import find_pairs
from wsph.testing import operators

# The gates of the patch tests: rounding of a weighted sum, an order above what was measured.
GATE = {"f64": 1e-12, "f32": 5e-5}
CELLS = {1: 20, 2: 12, 3: 7}


def sets(dim: int, jitter: float, which: str) -> tuple[np.ndarray, np.ndarray, bool, float]:
    """Targets, sources, same, radius: one set, virtual from real, real from virtual."""
    body = lattice(Box(type="box", min=[0.0] * dim, max=[float(CELLS[dim])] * dim), 1.0, jitter, 1)
    return {
        "one": (body.nodes, body.nodes, True, 2.6),
        "virtual": (body.cells, body.nodes, False, 1.8),
        "real": (body.nodes, body.cells, False, 2.4),
    }[which]


def apply(
    space: Space, targets: np.ndarray, sources: np.ndarray, pairs, field, spread: float = 0.5
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Interpolation, Shepard interpolation, gradient (n, k, dim) and divergence of `field` (n, k = dim)."""
    volume = np.random.default_rng(2).uniform(
        1.0 - spread, 1.0 + spread, len(sources)
    )  # they must not matter on the patch
    linear, constant = (
        weights.interpolation_weights(space, pairs, targets, sources, volume, order=o) for o in ("linear", "constant")
    )
    slope = weights.gradient_weights(space, pairs, targets, sources, volume)
    assert (linear.rank == space.dim).all()
    assert (slope.rank == space.dim).all()
    array = lambda v: wp.array(v, dtype=space.scalar, device="cpu")  # noqa: E731
    n, k = len(targets), space.dim
    interpolated, shepard, divergence = (wp.zeros((n, k), dtype=space.scalar, device="cpu") for _ in range(3))
    gradient = wp.zeros((n, k, space.dim), dtype=space.scalar, device="cpu")
    at = field(targets)
    operators.interpolate(space, linear, array(field(sources)), interpolated)
    operators.interpolate(space, constant, array(field(sources)), shepard)
    operators.gradient(space, slope, array(field(sources)), array(at), gradient)
    tensor = lambda v: array(np.repeat(v[:, :, None], space.dim, 2))  # noqa: E731
    operators.divergence(space, slope, tensor(field(sources)), tensor(at), divergence)
    return interpolated.numpy(), shepard.numpy(), gradient.numpy(), divergence.numpy()


@pytest.mark.parametrize("precision", ["f64", "f32"])
@pytest.mark.parametrize("which", ["one", "virtual", "real"])
@pytest.mark.parametrize("dim", [1, 2, 3])
def test_constant_and_linear_fields_on_jittered_clouds_boundary_included(dim: int, which: str, precision: str) -> None:
    space = Space(dim, precision)
    for jitter in (0.2, 0.4):
        targets, sources, same, radius = sets(dim, jitter, which)
        pairs = find_pairs(targets, sources, radius, same=same)
        A = np.random.default_rng(0).uniform(-1.0, 1.0, (dim, dim)) / CELLS[dim]
        for constant, slope in ((1.0, 0.0 * A), (0.5, A)):
            field = lambda x, constant=constant, slope=slope: constant + x @ slope  # noqa: E731
            interpolated, shepard, gradient, divergence = apply(space, targets, sources, pairs, field)
            assert np.abs(interpolated - field(targets)).max() <= GATE[precision]
            assert np.abs(gradient - slope.T[None]).max() <= GATE[precision]
            assert np.abs(divergence - slope.sum(0)).max() <= GATE[precision]
            if not slope.any():
                assert np.abs(shepard - constant).max() <= GATE[precision]


@pytest.mark.parametrize("dim", [1, 2])
def test_the_gradient_is_second_order_inside_a_lattice(dim: int) -> None:
    errors, spacings = [], [1 / 20, 1 / 40, 1 / 80]
    for spacing in spacings:
        body = lattice(Box(type="box", min=[0.0] * dim, max=[1.0] * dim), spacing)
        pairs = find_pairs(body.nodes, body.nodes, 2.6 * spacing, same=True)
        field = lambda x: np.sin(3.0 * x[:, :1] + x.sum(1, keepdims=True)) @ np.ones((1, x.shape[1]))  # noqa: E731
        _, _, gradient, _ = apply(Space(dim), body.nodes, body.nodes, pairs, field, spread=0.0)
        inner = ((body.nodes > 0.3) & (body.nodes < 0.7)).all(1)
        exact = 4.0 * np.cos(3.0 * body.nodes[:, 0] + body.nodes.sum(1))
        errors.append(np.abs(gradient[inner, 0, 0] - exact[inner]).max())
    order = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("dim", [1, 2])
def test_the_gradient_is_of_first_order_on_jitter(dim: int) -> None:
    """20 % of jitter, boundary included, averaged over three clouds."""
    errors, spacings = [], [1 / 20, 1 / 40, 1 / 80]
    for spacing in spacings:
        square = 0.0
        for seed in range(3):
            body = lattice(Box(type="box", min=[0.0] * dim, max=[1.0] * dim), spacing, 0.2, seed)
            pairs = find_pairs(body.nodes, body.nodes, 2.6 * spacing, same=True)
            field = lambda x: np.sin(3.0 * x[:, :1] + x.sum(1, keepdims=True)) @ np.ones((1, x.shape[1]))  # noqa: E731
            _, _, gradient, _ = apply(Space(dim), body.nodes, body.nodes, pairs, field, spread=0.0)
            exact = 4.0 * np.cos(3.0 * body.nodes[:, 0] + body.nodes.sum(1))
            square += ((gradient[:, 0, 0] - exact) ** 2).mean()
        errors.append(np.sqrt(square / 3.0))
    assert np.polyfit(np.log(spacings), np.log(errors), 1)[0] >= 1.0


def test_ranks_tell_what_the_neighbours_span() -> None:
    sources = np.array([[0.0, 0.0], [1.0, 0.0]])
    targets = np.array([[0.5, 0.0], [0.2, 0.6], [9.0, 9.0]])
    pairs = find_pairs(targets, sources, 1.2)
    found = weights.interpolation_weights(Space(2), pairs, targets, sources, np.ones(2))
    gradients = weights.gradient_weights(Space(2), pairs, targets, sources, np.ones(2))
    assert found.rank.tolist() == [1, 1, -1]
    assert gradients.rank.tolist() == [-1, 2, -1]  # on their line no gradient across it; beside it both
    with pytest.raises(ValueError, match="neither 'linear' nor 'constant'"):
        weights.interpolation_weights(Space(2), pairs, targets, sources, np.ones(2), order="cubic")
