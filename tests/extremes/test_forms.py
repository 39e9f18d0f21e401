"""No form is wrong with a law in a stress state without a word: a row of one set and one of two, and the whole table."""

import pytest

from tests.extremes.form_checks import Row
from tests.extremes.forms import ROWS, Cell, cells, wrong

# In two dimensions every check says something, and kernels are smaller than in three.
CHOSEN = (Row("stress-points", "jaumann", 2, "stress"), Row("ul-tsph, updated-lagrangian", "mises", 2, "strain"))


@pytest.mark.parametrize(
    "row", [pytest.param(row, id=str(row), marks=[] if row in CHOSEN else [pytest.mark.slow]) for row in ROWS]
)
def test_what_a_form_gives_is_right_or_said(row: Row) -> None:
    found = cells(row)
    assert found
    assert not wrong(row, found)


def test_words_about_another_fault_excuse_nothing() -> None:
    row = Row("stress-points", "elastic", 2, "strain")
    assert wrong(row, {"patch": Cell(0.1, "", ("energy was created, ... % of the largest seen",))})
    assert wrong(row, {"patch": Cell(None, "stopped", ("energy of body 'b': energy was created",))})
    assert not wrong(row, {"patch": Cell(0.1, "", ("stress is 20 to 70 % off beside held and loaded faces",))})
