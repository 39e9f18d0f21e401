"""Every registered integrator: its order, the same bits, both precisions."""

import pytest

from wsph.plugins import registry
from wsph.testing import check_integrator

ENTRIES = [entry for entry in registry.entries("integrators") if entry.status == "ok"]


# Euler amplifies by (omega dt)^2/2 a step; a third-order method is of fourth order where the problem is nearly linear.
SETTINGS = {"euler": {"courant": (0.02, 0.01, 0.005, 0.0025)}, "kg4-8": {"tolerance": 1.1}}


@pytest.mark.parametrize("name", [entry.name for entry in ENTRIES])
def test_conformance(name: str) -> None:
    check_integrator(name, order=registry.load("integrators", name).order, **SETTINGS.get(name, {}))


def test_ours_are_registered() -> None:
    assert {"tsph", "ul-tsph", "leapfrog", "rk4", "rkc"} <= {
        entry.name for entry in ENTRIES if entry.distribution == "wsph"
    }
