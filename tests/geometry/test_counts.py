"""Counts of nodes, cells and pairs of cells are those of the lattice."""

from itertools import product

import numpy as np
import pytest

from tests.scenes import Data, box, cube, shape
from wsph.geometry.counts import block_counts, lattice_counts
from wsph.geometry.lattice import lattice

SHAPES: dict[str, tuple[Data, float, float]] = {
    "bar": (cube(1), 0.1, 0.0),
    "box": (box(1.0, 0.5), 0.1, 0.0),
    "block": (box(1.0, 0.5, 0.3), 0.1, 0.0),
    "turned lattice": (box(1.0, 0.5), 0.05, 30.0),
    "disc": ({"type": "disc", "center": [0.1, 0.2], "radius": 1.0}, 0.15, 0.0),
    "sphere": ({"type": "sphere", "center": [0.1, 0.2, 0.0], "radius": 1.0}, 0.3, 0.0),
    "hole": ({"type": "difference", "shapes": [box(1.0, 1.0), box((0.2, 0.6), (0.2, 0.6))]}, 0.1, 0.0),
    "two parts": ({"type": "union", "shapes": [box(0.4, 1.0), box((0.6, 1.0), 1.0)]}, 0.1, 0.0),
}


@pytest.mark.parametrize("name", list(SHAPES))
def test_counts_are_those_of_the_lattice(name: str) -> None:
    made, spacing, turn = SHAPES[name]
    body = lattice(shape(**made), spacing, lattice_rotate=turn)
    index = np.floor(body.index[body.corners].mean(1)).astype(int)
    cells, dim = {tuple(each) for each in index.tolist()}, index.shape[1]
    found = lattice_counts(shape(**made), spacing, turn)
    assert found[:2].tolist() == [len(body.nodes), len(body.cells)]
    for steps in range(1, dim + 1):
        ways = [way for way in product((-1, 0, 1), repeat=dim) if np.count_nonzero(way) == steps]
        pairs = [sum(tuple(np.add(cell, way).tolist()) in cells for cell in cells) for way in ways]
        assert found[steps + 1] == pytest.approx(np.mean(pairs), rel=1e-14)


@pytest.mark.parametrize("cells", [(7,), (7, 4), (7, 4, 3)])
def test_a_block_is_counted_by_its_sides(cells: tuple[int, ...]) -> None:
    whole = shape(type="union", shapes=[box(*map(float, cells)), box(*map(float, cells))])
    np.testing.assert_array_equal(block_counts(cells), lattice_counts(whole, 1.0))
