"""Artificial stress: against tension alone."""

import numpy as np
import pytest

import wsph
from wsph.simulation.compose import compose


def block(**body: object) -> wsph.Scene:
    """A free block that spins and stretches."""
    data = {"name": "b", "shape": {"type": "box", "min": [-0.5, -0.5], "max": [0.5, 0.5]}, "spacing": 0.1, "state": "strain",
            "velocity": ["-0.1*y + 0.05*x", "0.1*x"], "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.3}, **body}  # fmt: skip
    run = {"integrator": "leapfrog", "formulation": "total-lagrangian", "end": 4.0, "cfl": 0.5}
    return wsph.Scene(schema=1, dim=2, run=run, bodies=[data])


def test_artificial_stress_opposes_tension_alone() -> None:
    composition = compose(block(artificial_stress={"epsilon": 0.5, "exponent": 0.0}))
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
