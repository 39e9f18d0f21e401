"""Loops over pairs: as wide as the processor likes them."""

import pytest

from wsph.backend.pair_loops import PAIR_LOOPS, vector_width


@pytest.mark.parametrize(
    ("says", "width"), [("vendor_id\t: AuthenticAMD", 128), ("vendor_id\t: GenuineIntel", 512), ("", 512)]
)
def test_pair_loops_are_as_wide_as_the_processor_likes(says: str, width: int) -> None:
    assert vector_width(says) == width
    assert PAIR_LOOPS["cpu_compiler_flags"].endswith(("=128", "=512"))
