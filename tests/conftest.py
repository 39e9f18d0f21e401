"""Shared by all tests: the scenes of the examples and short bars."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import wsph
from tests.distributions import seen
from wsph.backend import graph, threads

ROOT = Path(__file__).resolve().parents[1]

LONG_TABLES = (
    "tests/extremes/test_hostile_files.py",
    "tests/extremes/test_hostile_inputs.py",
    "tests/formulations/test_memory.py",
)
"""Files of many cases of one kind, of which the default suite has every third and `.ci/run` the others."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark two thirds of the long tables as slow."""
    for table in LONG_TABLES:
        cases = [item for item in items if item.path == ROOT / table]
        for number, item in enumerate(cases):
            if number % 3:
                item.add_marker(pytest.mark.slow)


if "PYTEST_XDIST_WORKER" in os.environ:
    # A worker for every core: a scene that leaves its threads open has one of them.
    graph.cores = lambda: threads.cores()[:1]


@pytest.fixture(scope="session")
def shock_bar() -> wsph.Scene:
    """The shipped elastic shock bar."""
    return wsph.load(ROOT / "examples" / "shock_bar.toml")


@pytest.fixture(scope="session")
def viscoplastic_bar() -> wsph.Scene:
    """The shipped viscoplastic shock bar."""
    return wsph.load(ROOT / "examples" / "viscoplastic_bar.toml")


@pytest.fixture
def share(monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """From its call on the cores share small scenes as they do large ones."""

    def begin() -> None:
        monkeypatch.setattr(graph, "SMALL_PAIRS", 0)
        monkeypatch.setattr(threads, "ALONE_SECONDS", 0.0)
        # Short enough for a machine on which a pass over a block of 512 cells takes 20 microseconds.
        monkeypatch.setattr(threads, "LONG_SECONDS", 5e-6)
        monkeypatch.setattr(threads, "PIECE_SECONDS", 2e-6)

    return begin


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder whose distributions this process sees while the test lasts, and in which it stands."""
    yield from seen(tmp_path, monkeypatch)
