"""Artificial stress: against tension alone."""

import numpy as np
import pytest

from tests.scenes import spinning
from wsph.simulation.compose import compose


def test_artificial_stress_opposes_tension_alone() -> None:
    composition = compose(spinning(artificial_stress={"epsilon": 0.5, "exponent": 0.0}))
    system = composition.bodies[0].system
    x = system.position / composition.scales.length
    out = system.new()
    inside = np.abs(system.position).max(1) < 0.2
    pulls = []
    for sign in (1.0, -1.0):
        # A stress that grows along x: the force is its gradient, and half of it is opposed where it is tension.
        u = np.zeros_like(x)
        u[:, 0] = sign * 1e-4 * (x[:, 0] + 20.0) ** 2
        system.state.write("displacement", u)
        system.rate(system.state, out, "velocity")
        pulls.append(float(out.read("velocity")[inside, 0].mean()))
    assert pulls[0] / -pulls[1] == pytest.approx(0.5, abs=0.03)
