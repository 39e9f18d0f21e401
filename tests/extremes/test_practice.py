"""Small scenes beside the paved road have their right values."""

import pytest

from tests.extremes.practice import CASES, Case, meets, outcome


@pytest.mark.parametrize("each", CASES, ids=lambda each: each.name)
def test_what_comes_is_right(each: Case) -> None:
    found = outcome(each)
    assert meets(each, found), f"{found}, right is {each.right}"
