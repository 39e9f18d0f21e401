"""Every published case in its short form meets what is asked of it; the full form is slow."""

import pytest

from wsph.errors import WsphError
from wsph.validation import CASES, validate


@pytest.mark.parametrize("name", list(CASES))
def test_the_short_form_meets_what_is_asked(name: str) -> None:
    (outcome,) = validate([name])
    missed = [f"{row.figure}: {row.reached:.4g} {row.unit}, asked {row.asked}" for row in outcome.rows if not row.meets]
    assert not missed
    assert any(row.asked != "reported" for row in outcome.rows)


KNOWN_MISSES = {"shear-band": ["81 columns: width"]}
"""Figures of the full forms that do not come out as asked: .141 m, where .14 is asked."""


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_the_full_form_misses_only_what_is_known(name: str) -> None:
    (outcome,) = validate([name], full=True)
    assert [row.figure for row in outcome.rows if not row.meets] == KNOWN_MISSES.get(name, [])


def test_a_name_that_is_none() -> None:
    with pytest.raises(WsphError, match="no case is named 'shockbar'; did you mean 'shock-bar'"):
        list(validate(["shockbar"]))
