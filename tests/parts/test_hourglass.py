"""Hourglass control: holds what a gradient does not see, and nothing else."""

import numpy as np
import pytest

from tests.scenes import spinning
from wsph.simulation.compose import compose

AMPLITUDE = 1e-6
"""Of a displacement that alternates from particle to particle, in spacings."""


def checkered(**body: object) -> float:
    """The largest acceleration inside a block whose displacement alternates from particle to particle, nondimensional."""
    composition = compose(spinning(spacing=0.04, placement="cells", **body))
    system = composition.bodies[0].system
    sign = (-1.0) ** np.rint(system.lattice.index[system.lattice.corners].mean(1) - 0.5).sum(1)
    system.state.write("displacement", AMPLITUDE * sign[:, None] * [1.0, 0.0])
    out = system.new()
    system.rate(system.state, out, "velocity")
    inside = np.abs(system.position).max(1) < 0.2
    return float(np.abs(out.read("velocity")[inside]).max())


def test_hourglass_control_holds_what_a_gradient_does_not_see() -> None:
    """u_i = a s_i e_x, s = 1 and -1 in turn. On a square lattice r and -r have the same weight w = |W'|/r and the same u:
    every gradient is zero, F = 1. With a pair's stiffness chi E w V/S, S the sum of w r^2, along the line between, and to
    first order in a the length r.du/r it has gained, a particle is accelerated by chi E/(rho S) sum w (r.du/r^2) r. Pairs of
    one colour have du = 0, the others du = -2 a s e_x, and x and y are alike, so r_x^2 is half of r^2 on average: chi E a/
    rho times the sum of w over the other colour over that of w r^2 over all. What is of second order in a is odd in r."""
    assert checkered(hourglass=False) < 1e-12
    x, y = np.meshgrid(np.arange(-3, 4), np.arange(-3, 4))
    r = np.hypot(x, y)
    q = np.where(r > 0.0, r / 1.3, 1.0)
    w = np.where(q < 1.0, 3.0 - 2.25 * q, 0.75 * np.clip(2.0 - q, 0.0, None) ** 2 / q) * (r > 0.0)
    stiffness = w[(x + y) % 2 == 1].sum() / (w * r**2).sum()
    youngs = 1.3 * 0.4 / 0.7  # in units of rho c^2 = lambda + 2 mu, as r is in spacings
    for coefficient in (0.1, 0.2):
        exact = coefficient * youngs * AMPLITUDE * stiffness
        assert checkered(hourglass={"coefficient": coefficient}) == pytest.approx(exact, rel=1e-8)


def test_hourglass_takes_the_place_of_the_residual_unless_both_are_named() -> None:
    def terms(**body: object) -> tuple[bool, bool]:
        form = compose(spinning(**body)).bodies[0].system.form
        return form.stabilised, "spring" in form.numbers

    assert terms() == (True, False)
    assert terms(hourglass={"coefficient": 0.1}) == (False, True)
    assert terms(hourglass=False) == (False, False)
    assert terms(hourglass={"coefficient": 0.1}, residual={"coefficient": 0.5}) == (True, True)


def test_it_keeps_angular_momentum_and_a_linear_field_free_of_force() -> None:
    composition = compose(spinning(hourglass={"coefficient": 0.1}))
    system = composition.bodies[0].system
    x = system.position / composition.scales.length
    mass = system.volume * system.density

    def spin() -> float:
        at, v = x + system.state.read("displacement"), system.state.read("velocity")
        return float(mass @ (at[:, 0] * v[:, 1] - at[:, 1] * v[:, 0]))

    before = spin()
    composition.program.run(500)
    assert spin() == pytest.approx(before, rel=1e-12)
    system.state.write("displacement", x @ np.array([[0.1, 0.3], [-0.2, 0.2]]))
    system.rate(system.state, system.new(), "velocity")
    assert np.abs(system.rates.holding.numpy()).max() < 1e-14
