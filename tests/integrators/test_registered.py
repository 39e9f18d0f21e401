"""Every registered integrator: its order, the same bits, both precisions."""

import pytest

from wsph import registry
from wsph.testing import check_integrator

ENTRIES = [entry for entry in registry.entries("integrators") if entry.status == "ok"]


@pytest.mark.parametrize("name", [entry.name for entry in ENTRIES])
def test_conformance(name: str) -> None:
    check_integrator(name, order=registry.load("integrators", name).order)


def test_ours_are_registered() -> None:
    assert {"tsph"} <= {entry.name for entry in ENTRIES if entry.distribution == "wsph"}
