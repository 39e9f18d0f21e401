"""Quantities of records that are known in closed form."""

import numpy as np
import pytest

from wsph.accuracy.measures import QUANTITIES, Record, arrival, distances, final, frequency, mean, peak

TIMES = np.linspace(0.0, 2.0, 2001)
WAVE = Record(TIMES, 3.0 * np.sin(2.0 * np.pi * 2.5 * TIMES + 0.3))


def test_numbers_of_a_wave():
    assert frequency(WAVE) == pytest.approx(2.5, rel=1e-5)
    assert mean(WAVE) == pytest.approx(0.0, abs=1e-6)
    assert peak(WAVE) == pytest.approx(3.0, rel=1e-4)
    assert final(WAVE) == pytest.approx(3.0 * np.sin(0.3), rel=1e-9)


def test_arrival_of_a_ramp():
    assert arrival(Record(TIMES, -np.clip(TIMES - 0.5, 0.0, 1.0))) == pytest.approx(1.0, abs=1e-9)


def test_history_of_records_at_other_times():
    coarse = Record(np.linspace(0.0, 2.0, 1201), 3.3 * np.sin(2.0 * np.pi * 2.5 * np.linspace(0.0, 2.0, 1201) + 0.3))
    found = distances([WAVE, coarse])
    assert found[0, 1] == found[1, 0] == pytest.approx(0.1, rel=1e-3)
    assert found[0, 0] == 0.0


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_scale_takes_the_place_of_the_own_size(quantity):
    shifted = Record(TIMES + 0.0, WAVE.values + 0.01)
    found = distances([WAVE, shifted], quantity, scale=2.0)
    wanted = {"history": 0.005, "mean": 0.005, "final": 0.005, "peak": 0.005, "arrival": None, "frequency": None}[
        quantity
    ]
    assert wanted is None or found[0, 1] == pytest.approx(wanted, rel=1e-3)


def test_the_end_is_one_that_all_records_have():
    ramp = [Record(np.array([0.0, end]), np.array([0.0, end])) for end in (1.0, 1.1, 1.3)]
    assert distances(ramp, "final").max() == pytest.approx(0.0, abs=1e-12)
    assert distances(ramp, "mean").max() == pytest.approx(0.0, abs=1e-12)


def test_what_has_no_size_is_infinitely_far():
    nothing = Record(TIMES, np.zeros(len(TIMES)))
    assert distances([nothing, WAVE])[0, 1] == np.inf
    assert distances([nothing, nothing])[0, 1] == 0.0
    still = Record(TIMES, np.ones(len(TIMES)))
    assert distances([still, WAVE], "frequency")[0, 1] == np.inf
