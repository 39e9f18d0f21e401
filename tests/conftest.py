"""Shared by all tests: the scenes of the examples and short bars."""

from pathlib import Path

import pytest

import wsph

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shock_bar() -> wsph.Scene:
    """The shipped elastic shock bar."""
    return wsph.load(ROOT / "examples" / "shock_bar.toml")


@pytest.fixture(scope="session")
def viscoplastic_bar() -> wsph.Scene:
    """The shipped viscoplastic shock bar."""
    return wsph.load(ROOT / "examples" / "viscoplastic_bar.toml")
