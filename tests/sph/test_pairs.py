"""Pairs: equal to brute force, rows ascending, nothing lost at cell faces or among coincident particles."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from wsph.sph import pairs as pairs_of
from wsph.sph.pairs import find_pairs, find_pairs_once


def brute_force(targets: np.ndarray, sources: np.ndarray, radius: float, same: bool) -> list[list[int]]:
    """The definition, in the arithmetic of the kernel."""
    origin = sources.min(0)
    r = (sources - origin)[None] - (targets - origin)[:, None]
    near = sum(r[..., k] ** 2 for k in range(r.shape[-1])) < radius * radius
    if same:
        np.fill_diagonal(near, False)
    return [np.flatnonzero(row).tolist() for row in near]


def rows(pairs) -> list[list[int]]:
    """Rows as lists."""
    offsets, indices = pairs.offsets.numpy(), pairs.indices.numpy()
    return [indices[a:b].tolist() for a, b in itertools.pairwise(offsets)]


# Multiples of a quarter put particles on each other and on the faces of the grid's cells.
coordinates = st.one_of(st.integers(-8, 8).map(lambda k: k / 4), st.floats(-2.0, 2.0, width=32))


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(1, 3), st.sampled_from([0.25, 0.5, 0.7, 1.0, 3.0]), st.booleans())
def test_pairs_equal_brute_force(data: st.DataObject, dim: int, radius: float, same: bool) -> None:
    targets = data.draw(arrays(float, (data.draw(st.integers(1, 24)), dim), elements=coordinates))
    sources = targets if same else data.draw(arrays(float, (data.draw(st.integers(1, 24)), dim), elements=coordinates))
    assert rows(find_pairs(targets, sources, radius, same=same)) == brute_force(targets, sources, radius, same)


@settings(max_examples=60, deadline=None)
@given(st.data(), st.integers(1, 3), st.booleans())
def test_few_that_are_looked_at_all_with_all_are_the_same(data: st.DataObject, dim: int, few: bool) -> None:
    targets, sources = (
        data.draw(arrays(float, (data.draw(st.integers(1, 24)), dim), elements=coordinates)) for _ in range(2)
    )
    radius = data.draw(arrays(float, len(targets), elements=st.sampled_from([0.25, 0.5, 0.7, 1.0, 3.0])))
    with pytest.MonkeyPatch.context() as patch:
        if not few:
            patch.setattr(pairs_of, "FEW", 0)
        found = find_pairs_once(targets, sources, radius)
    expected = find_pairs(targets, sources, radius)
    assert rows(found) == rows(expected)
    assert (found.targets, found.sources) == (expected.targets, expected.sources)
    np.testing.assert_array_equal(found.reach.numpy(), expected.reach.numpy())


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_lattices_of_any_size_far_from_the_origin(scale: float) -> None:
    grid = np.stack(np.meshgrid(*[np.arange(6.0)] * 3, indexing="ij"), -1).reshape(-1, 3) * scale + 1e3 * scale
    pairs = find_pairs(grid, grid, 1.5 * scale, same=True)
    assert rows(pairs) == brute_force(grid, grid, 1.5 * scale, True)
    assert pairs.count == 2 * (3 * 5 * 36 + 3 * 2 * 25 * 6)  # faces and edges of a 6^3 lattice


def test_empty_sets_have_no_pairs() -> None:
    for find in (find_pairs, find_pairs_once):
        assert find(np.zeros((0, 2)), np.zeros((3, 2)), 1.0).count == 0
        assert find(np.zeros((3, 2)), np.zeros((0, 2)), 1.0).count == 0


def test_positions_that_are_not_finite_and_bad_radii_are_refused() -> None:
    points = np.zeros((3, 1))
    for find in (find_pairs, find_pairs_once):
        with pytest.raises(ValueError, match="particle 1 has a position that is not finite"):
            find(np.array([[0.0], [np.nan], [1.0]]), points, 1.0)
        for radius in (0.0, -1.0, np.nan):
            with pytest.raises(ValueError, match=f"the support radius {radius} is not above zero"):
                find(points, points, radius)
