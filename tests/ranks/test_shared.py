"""A scene that processes share has the bits of one process: all that a run gives, whatever their number, and resumed on
another."""

import json
from typing import Any

import pytest

from tests.ranks import broken_cases, shape_cases, shared_cases
from tests.ranks.case_runs import case_of
from tests.ranks.launch import launched, needs_mpi

RESUMED = ("sides", "plastic", "edges viscous", "on faces", "inside", "breaking", "links")
GROUPS = [
    ("edges viscous", "contact", "updated sheared", "two sets moving"),
    ("cracked", "updated walls", "two sets, resumed", "updated, resumed"),
    ("two sets bar", "two sets jittered", "two sets cracked", "two sets bodies"),
    ("two sets adapting", "two sets moving 3D", "two sets moving bar", "two sets moving jittered"),
    ("two sets moving, resumed", "two sets, begun", "two sets plastic, resumed", "two sets moving, threads"),
    ("viscous", "rubber", "bar", "edges", "kernel"),
    ("periodic", "relaxed", "jittered edges", "cracked kernel", "mapped", "breaking map"),
    ("breaking kernel", "breaking points", "breaking jitter", "relaxed, stopped", "edges, begun"),
    tuple(f"{each}, resumed" for each in RESUMED),
    ("contact of two", "contact 3D", "contact with itself"),
    ("contact, resumed", "tie, resumed", "bodies, resumed"),
    ("relaxed bodies, stopped", "relaxed balls"),
    ("plastic, threads", "relaxed bodies, threads"),
    ("round", "round in 3D", "round along edges, resumed"),
    ("balls", "balls of links, resumed"),
    ("updated cracked", "updated bar", "updated relaxed", "updated balls", "updated nodes", "updated bodies"),
    ("updated, begun", "updated plastic, resumed", "updated contact, resumed"),
    ("updated pressed, resumed", "updated heaped", "updated waiting, narrow"),
]
"""Some, by one to four processes, and the rest, which is slow, by one, two or three, and four. What is resumed is begun by
one and by two, and goes on by one, three and four: it needs no run from start to end by these."""

SHAPES = [
    ("fitted", "mixed", "points"),
    ("fitted, rates", "fitted at one end", "fitted, relaxed", "fitted, resumed"),
    ("fitted bar", "fitted ball", "fitted contact, resumed"),
    ("quads", "triangles", "mixed, resumed", "quads, begun", "periodic", "fitted, periodic", "round"),
    ("hexahedra", "tetrahedra", "tied"),
    ("fitted, breaking", "breaking, resumed", "breaking, touched"),
    ("points, rates", "points of links", "points, resumed"),
    ("moving points, resumed",),
]
"""The same of bodies that no grid has cut."""

BROKEN = [
    ("field", "links tied"),
    ("field tied, resumed", "links, resumed"),
    ("field in 3D", "links in 3D"),
]
"""The same of bodies that break while they touch others."""

FIRST = [("shared_cases", GROUPS[0]), ("shape_cases", SHAPES[0])]
OTHERS = {"shared_cases": GROUPS[1:], "shape_cases": SHAPES[1:], "broken_cases": BROKEN}
REST = [(of, names) for of, groups in OTHERS.items() for names in groups]


@pytest.mark.parametrize(
    ("cases", "groups"), [(shared_cases.CASES, GROUPS), (shape_cases.CASES, SHAPES), (broken_cases.CASES, BROKEN)]
)
def test_every_case_is_run(cases: dict[str, Any], groups: list[tuple[str, ...]]) -> None:
    assert {case_of(name) for names in groups for name in names} == set(cases)


@needs_mpi
@pytest.mark.parametrize(("of", "names"), [*FIRST, *(pytest.param(*each, marks=pytest.mark.slow) for each in REST)])
def test_bits_of_one_process(of: str, names: tuple[str, ...]) -> None:
    every = ["--every"] if (of, names) in FIRST else []
    done = launched(4, "-m", f"tests.ranks.{of}", *every, *names)
    assert done.returncode == 0, done.stderr[-3000:]
    found: dict[str, dict[str, str]] = {}
    for line in done.stdout.splitlines():
        found |= json.loads(line)
    assert list(found) == list(names)
    for name, digests in found.items():
        how = {"stopped": 3, "threads": 4, "resumed": 4, "begun": 4}
        assert len(digests) == how.get(name.rpartition(", ")[2], 4 if every else 3)
        assert len(set(digests.values())) == 1, (name, digests)


@needs_mpi
def test_what_is_unlikely_is_said_as_by_one_process() -> None:
    """Of the whole body: no process takes its part for it, and all find the same."""
    done = launched(2, "-m", "tests.ranks.said_cases", seconds=120.0)
    assert done.returncode == 0, done.stderr[-3000:]
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [len(alone) for alone, _ in found] == [1, 1, 3, 3, 1]
    assert "a mode of its step grows by" in found[-1][0][0]
    for alone, shared in found:
        assert shared == alone
