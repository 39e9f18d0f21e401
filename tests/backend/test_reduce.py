"""Reductions of device arrays, through the domain of a scene."""

import numpy as np
import pytest
import warp as wp

from wsph.backend.domain import WHOLE, Domain, Whole
from wsph.backend.reduce import BLOCK, Segments, blocks, largest, total, totals


class Twice(Whole):
    """Two parts of the same content."""

    size = 2

    def joined(self, rows: np.ndarray) -> np.ndarray:
        return np.concatenate([rows, rows])

    def max(self, x: np.ndarray) -> np.ndarray:
        return np.maximum(x, 7.0)


@pytest.mark.parametrize("n", [0, 1, BLOCK, BLOCK + 1])
def test_blocks_hold_all_rows(n: int) -> None:
    assert (blocks(n) - 1) * BLOCK < n <= blocks(n) * BLOCK


def test_one_process_has_the_whole() -> None:
    x = np.arange(3.0)
    assert all(of(x) is x for of in (WHOLE.sum, WHOLE.max, WHOLE.min, WHOLE.joined, WHOLE.gathered))


@pytest.mark.parametrize(("domain", "times", "most"), [(WHOLE, 1.0, 3.0), (Twice(), 2.0, 7.0)])
def test_what_is_summed_up_is_so_over_all_parts(domain: Domain, times: float, most: float) -> None:
    values = wp.array([1.0, 3.0, 2.0], dtype=wp.float32, device="cpu")
    table = wp.array([[1.0, 2.0], [3.0, 4.0]], dtype=wp.float64, device="cpu")
    assert total(values, domain) == 6.0 * times
    assert totals(table, domain).tolist() == [4.0 * times, 6.0 * times]
    assert largest(values, domain) == most


def test_a_largest_number_that_is_none_is_seen() -> None:
    assert np.isnan(largest(wp.array([1.0, np.nan], dtype=wp.float64, device="cpu")))


def test_sums_of_single_precision_are_taken_in_double() -> None:
    assert total(wp.array([1e8, 1.0, -1e8], dtype=wp.float32, device="cpu")) == 1.0


def test_segments_are_blocks_of_one_owner_each() -> None:
    owners = np.array([3, 0, 3, -1] + [0] * (2 * BLOCK) + [3])
    made = Segments.of(owners)
    assert sorted(made.order) == list(range(len(owners)))
    for block, owner in enumerate(made.owner):
        rows = made.order[made.starts[block] : made.starts[block + 1]]
        assert 0 < len(rows) <= BLOCK
        assert (owners[rows] == owner).all()
        assert (np.diff(rows) > 0).all()
    assert made.owner.tolist() == [-1, 0, 0, 0, 3]
    sums = wp.zeros((made.count, 2), dtype=wp.float64, device="cpu")
    term = made.terms(0, sums, ("work", "force_x"))["force_x"][0]
    assert (term.first, term.count, term.stride) == (3, 3, 2)
    assert made.terms(7, sums, ("work", "force_x")) == {}
    assert Segments.of(np.zeros(0, int)).count == 0
