"""The envelope on ladders whose error is known: made up, and of the program itself."""

import numpy as np
import pytest

from wsph.accuracy.envelope import ORDERS_OF_FITTED, disagree, estimate, fitted_order, own_part
from wsph.accuracy.measures import Record, distances

TIMES = np.linspace(0.0, 1.0, 401)


def ladder(
    order: float, *, ratio: float = 2.0**0.5, rows: int = 4, constant: float = 0.3
) -> tuple[np.ndarray, list[Record]]:
    """Spacings and records whose error is `constant` h^order of the true answer, finest first."""
    h = 0.1 * ratio ** np.arange(rows)
    return h, [Record(TIMES, np.sin(4.0 * TIMES) * (1.0 + constant * each**order)) for each in h]


@pytest.mark.parametrize("order", [0.5, 0.7, 1.0, 1.5, 2.0])
def test_order_and_error_of_a_pure_power(order):
    h, records = ladder(order)
    found = estimate(h, distances(records), formal=2.0 if order > 1.0 else 1.0)
    assert fitted_order(h, distances(records)) == pytest.approx(order, abs=0.01)
    # Relative to the finest in place of the true answer: by as much as that is off.
    assert found.error == pytest.approx(0.3 * h[0] ** order, rel=0.12)
    assert found.bar == pytest.approx(1.5 * found.error)
    assert found.converges


def test_orders_are_held_between_bounds():
    assert estimate(*_of(3.0), formal=2.0).order == 2.0
    assert estimate(*_of(2.0), formal=1.0).order == 1.0
    low = estimate(*_of(0.2), formal=1.0)
    assert low.order == 0.4
    assert low.clamped


def _of(order: float) -> tuple[np.ndarray, np.ndarray]:
    h, records = ladder(order)
    return h, distances(records)


def test_a_lucky_last_difference_does_not_shrink_it():
    h, records = ladder(1.0)
    honest = estimate(h, distances(records), formal=1.0)
    lucky = [Record(TIMES, 0.9 * records[1].values + 0.1 * records[0].values), *records[1:]]
    assert estimate(h, distances(lucky), formal=1.0).error > 0.5 * honest.error


def test_rows_that_agree_to_rounding_have_no_error():
    h, records = ladder(1.0)
    found = estimate(h, distances([records[0]] * 4), formal=1.0)
    assert (found.error, found.bar, found.converges) == (0.0, 0.0, True)


def test_differences_that_do_not_fall_are_no_convergence():
    h = 0.1 * 2.0 ** np.arange(4)
    growing = [Record(TIMES, np.full(len(TIMES), each)) for each in (1.0, 1.4, 1.6, 1.65)]
    found = estimate(h, distances(growing), formal=1.0)
    assert not found.converges
    assert found.bar == np.inf


def test_differences_that_follow_no_order_are_no_convergence():
    """The last one small by luck; of numbers, which coincide, it says nothing."""
    h = np.array([1.0, 2.0, 4.0, 16.0 / 3.0])
    table = np.zeros((4, 4))
    table[np.triu_indices(4, 1)] = [0.061, 0.318, 0.075, 0.26, 0.095, 0.337]
    table += table.T
    assert not estimate(h, table, formal=1.0).converges
    assert estimate(h, table, formal=1.0, norms=False).converges
    pure = 0.1 * np.abs(h[:, None] ** 0.7 - h[None, :] ** 0.7)
    assert estimate(h, pure, formal=1.0).converges


def test_what_is_far_below_the_tolerance_may_do_as_it_likes():
    h = 0.1 * 2.0 ** np.arange(4)
    growing = [Record(TIMES, np.full(len(TIMES), 1.0 + 1e-3 * each)) for each in (0.0, 0.4, 0.6, 0.65)]
    assert not estimate(h, distances(growing), formal=1.0).converges
    assert estimate(h, distances(growing), formal=1.0, tolerance=0.01).converges


def test_two_rows_give_no_estimate():
    h, records = ladder(1.0, rows=2)
    with pytest.raises(ValueError, match="at least 3"):
        estimate(h, distances(records), formal=1.0)
    h, records = ladder(1.0)
    with pytest.raises(ValueError, match="finest row first"):
        estimate(h[::-1], distances(records), formal=1.0)


def test_answers_disagree_where_their_bars_do_not_meet():
    assert disagree(0.015, 0.02, apart=0.04)
    assert not disagree(0.015, 0.02, apart=0.03)


@pytest.mark.parametrize("order", [1.5, 1.6, 1.7])
def test_a_part_that_is_a_row_s_own_is_found_beside_the_one_of_all(order):
    """Errors along one direction that all rows share and each along one of its own, all of an order."""
    h = np.array([1.0, 1.6, 2.0, 3.2])
    for alike, own in ((0.01, 0.0), (0.01, 0.005), (0.0, 0.01)):
        errors = np.zeros((4, 5))
        errors[:, 0] = alike * h**order
        errors[np.arange(4), 1 + np.arange(4)] = own * h**order
        table = np.linalg.norm(errors[:, None] - errors[None, :], axis=2)
        true = np.hypot(alike, own)
        assert own_part(h, table) == pytest.approx(true, rel=0.02)
        envelope, found = (estimate(h, table, 2.0, fitted=fitted).error for fitted in (False, True))
        assert found == pytest.approx(np.sqrt(envelope * true), rel=0.01)
        assert found >= 0.98 * true
        if own:
            assert envelope > 1.3 * true


@pytest.mark.parametrize("norms", [True, False])
@pytest.mark.parametrize("rows", [3, 4])
def test_no_order_of_fitted_rows_is_taken_to_be_as_high_as_that_of_a_grid(rows, norms):
    """Errors that fall with the square of the spacing: they are said to be larger by what the lower order makes of it."""
    h, records = ladder(2.0, rows=rows)
    table = distances(records)
    straight, found = (estimate(h, table, 2.0, fitted=fitted, norms=norms) for fitted in (False, True))
    assert straight.order == pytest.approx(2.0, abs=0.01)
    assert found.order == ORDERS_OF_FITTED[1]
    # The coarsest two differ by the most of what that order would make of them.
    ratio, far = h[1] / h[0], (h[-2] / h[0]) ** (2.0 - ORDERS_OF_FITTED[1])
    more = (ratio**2.0 - 1.0) / (ratio ** ORDERS_OF_FITTED[1] - 1.0)
    assert straight.error * 1.1 < found.error <= straight.error * more * far * 1.01


def test_fitted_rows_without_a_part_of_their_own_are_no_special_case_and_numbers_have_none():
    h, records = ladder(1.6)
    table = distances(records)
    for rows in (3, 4):
        few = h[:rows], table[:rows, :rows], 2.0
        assert estimate(*few, fitted=True).error == pytest.approx(estimate(*few).error, rel=1e-9)
    assert estimate(h, table, 2.0, fitted=True, norms=False) == estimate(h, table, 2.0, norms=False)


def test_where_cracks_have_no_limit_differences_have_to_follow_an_order_closely():
    h, records = ladder(1.0)
    pure = distances(records)
    assert estimate(h, pure, 1.0, torn=True) == estimate(h, pure, 1.0)
    # The mean damage of a strip that links tear to pieces, whose rows fall by chance.
    h, table = np.array([1.0, 2.0, 4.0, 16.0 / 3.0]), np.zeros((4, 4))
    table[np.triu_indices(4, 1)] = [0.026, 0.202, 0.167, 0.221, 0.185, 0.105]
    table += table.T
    assert estimate(h, table, 1.0).converges
    assert not estimate(h, table, 1.0, torn=True).converges
    assert not estimate(h, table, 1.0, torn=True, norms=False).converges
    assert estimate(h, table, 1.0, torn=True, tolerance=0.3).converges
