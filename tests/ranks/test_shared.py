"""A scene that processes share has the bits of one process: all that a run gives, whatever their number, and resumed on
another."""

import json

import pytest

from tests.ranks.launch import launched, needs_mpi
from tests.ranks.shared_cases import CASES

RESUMED = ("sides", "plastic", "edges viscous", "on faces", "inside", "breaking", "links")
GROUPS = [
    ("plastic", "edges viscous", "on faces", "cracked", "contact", "sides, resumed"),
    ("viscous", "rubber", "bar", "edges", "kernel", "sides"),
    ("inside", "periodic", "relaxed", "jittered edges", "cracked kernel", "mapped"),
    ("breaking", "breaking kernel", "breaking points", "links", "relaxed, stopped", "edges, begun"),
    tuple(f"{each}, resumed" for each in RESUMED if each != "sides"),
    ("bodies", "bodies, resumed"),
    ("contact 3D", "tie", "contact, resumed"),
    ("plastic, threads", "contact, threads"),
    ("balls", "balls of links", "balls of links, resumed"),
]
"""Some of all, and the rest, which is slow."""


def test_every_case_is_run() -> None:
    assert {name.partition(", ")[0] for names in GROUPS for name in names} == set(CASES)


@needs_mpi
@pytest.mark.parametrize("names", [GROUPS[0], *(pytest.param(each, marks=pytest.mark.slow) for each in GROUPS[1:])])
def test_bits_of_one_process(names: tuple[str, ...]) -> None:
    done = launched(4, "-m", "tests.ranks.shared_cases", *names)
    assert done.returncode == 0, done.stderr[-3000:]
    found: dict[str, dict[str, str]] = {}
    for line in done.stdout.splitlines():
        found |= json.loads(line)
    assert list(found) == list(names)
    for name, digests in found.items():
        assert len(digests) == {"stopped": 3, "threads": 5}.get(name.rpartition(", ")[2], 4)
        assert len(set(digests.values())) == 1, (name, digests)


@needs_mpi
def test_what_is_unlikely_is_said_as_by_one_process() -> None:
    """Of the whole body: no process takes its part for it, and all find the same."""
    done = launched(2, "-m", "tests.ranks.said_cases", seconds=120.0)
    assert done.returncode == 0, done.stderr[-3000:]
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [len(alone) for alone, _ in found] == [1, 1, 3, 3]
    for alone, shared in found:
        assert shared == alone
