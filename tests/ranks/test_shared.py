"""A scene that processes share has the bits of one process: all that a run gives, whatever their number, and resumed on
another."""

import json
from typing import Any

import pytest

from tests.ranks import broken_cases, shape_cases, shared_cases
from tests.ranks.case_runs import case_of
from tests.ranks.launch import launched, needs_mpi

RESUMED = (
    *("sides", "plastic", "edges viscous", "on faces", "inside", "breaking", "links", "round along edges"),
    *("contact", "tie", "bodies", "balls of links"),
    *("updated", "updated plastic", "updated contact", "updated pressed"),
    *("two sets", "two sets plastic", "two sets moving"),
)
GROUPS = [
    ("edges viscous", "contact", "updated sheared", "two sets moving"),
    (
        *("cracked", "viscous", "rubber", "bar", "edges", "kernel", "periodic", "relaxed", "jittered edges", "mapped"),
        *(
            "cracked kernel",
            "breaking map",
            "breaking kernel",
            "breaking points",
            "breaking jitter",
            "round",
            "round in 3D",
        ),
        *("contact of two", "contact 3D", "contact with itself", "relaxed balls", "balls"),
        *("updated walls", "updated cracked", "updated bar", "updated relaxed", "updated balls", "updated nodes"),
        *("updated bodies", "updated heaped", "updated waiting, narrow"),
        *("two sets bar", "two sets jittered", "two sets cracked", "two sets bodies", "two sets adapting"),
        *("two sets moving 3D", "two sets moving bar", "two sets moving jittered"),
    ),
    tuple(f"{each}, resumed" for each in RESUMED),
    ("edges, begun", "updated, begun", "two sets, begun", "relaxed, stopped", "relaxed bodies, stopped"),
    ("plastic, threads", "relaxed bodies, threads", "two sets moving, threads"),
]
"""Some, by one to four processes, and the rest, which is slow, by one and, in turn, two, three or four. What is resumed is
begun by one and by two, and goes on by one, three and four: it needs no run from start to end by these."""

SHAPES = [
    ("fitted", "mixed", "points"),
    (
        *("fitted, rates", "fitted at one end", "fitted, relaxed", "fitted bar", "fitted ball", "fitted, periodic"),
        *("fitted, breaking", "quads", "triangles", "periodic", "round", "hexahedra", "tetrahedra", "tied"),
        *("breaking, touched", "points, rates", "points of links", "quads, begun"),
    ),
    (
        *("fitted, resumed", "fitted contact, resumed", "mixed, resumed", "breaking, resumed"),
        *("points, resumed", "moving points, resumed"),
    ),
]
"""The same of bodies that no grid has cut."""

BROKEN = [("field in 3D", "links tied", "field tied, resumed", "links, resumed")]
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
        how = {"stopped": 3, "threads": 3, "resumed": 4, "begun": 4}
        assert len(digests) == how.get(name.rpartition(", ")[2], 4 if every else 2)
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
