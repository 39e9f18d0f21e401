"""A scene that processes share has the bits of one process: all that a run gives, whatever their number, and resumed on
another."""

import json

import pytest

from tests.ranks.launch import launched, needs_mpi
from tests.ranks.shared_cases import CASES

RESUMED = ("sides", "plastic", "edges viscous")


@needs_mpi
@pytest.mark.parametrize("names", [tuple(CASES)[:4], tuple(CASES)[4:], tuple(f"{each}, resumed" for each in RESUMED)])
def test_bits_of_one_process(names: tuple[str, ...]) -> None:
    done = launched(4, "-m", "tests.ranks.shared_cases", *names)
    assert done.returncode == 0, done.stderr[-3000:]
    found: dict[str, dict[str, str]] = {}
    for line in done.stdout.splitlines():
        found |= json.loads(line)
    assert list(found) == list(names)
    for name, digests in found.items():
        assert len(digests) == 4
        assert len(set(digests.values())) == 1, (name, digests)
