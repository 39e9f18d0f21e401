"""No form is wrong with a law in a stress state without a word: a seeded tenth of the table, and all of it."""

import numpy as np
import pytest

from tests.extremes.form_checks import Row
from tests.extremes.forms import ROWS, cells, wrong

TENTH = set(np.random.default_rng(20).choice(len(ROWS), len(ROWS) // 10, replace=False).tolist())


@pytest.mark.parametrize(
    "row",
    [pytest.param(row, id=str(row), marks=[] if k in TENTH else [pytest.mark.slow]) for k, row in enumerate(ROWS)],
)
def test_what_a_form_gives_is_right_or_said(row: Row) -> None:
    found = cells(row)
    assert found
    assert not wrong(row, found)
