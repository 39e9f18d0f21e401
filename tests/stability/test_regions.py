"""Stability regions beside closed forms, and the limits that follow from them for bodies whose modes are known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from wsph.protocols import Stability
from wsph.stability import margins
from wsph.stability.regions import (
    alternating_limit,
    damped_limit,
    imaginary_limit,
    limit_of,
    margin,
    splitting_limit,
    two_step_limit,
    undamped_limit,
)

EULER = np.array([1.0, 1.0])
MIDPOINT = np.array([1.0, 1.0, 0.5])
CLASSICAL = np.array([1.0, 1.0, 1 / 2, 1 / 6, 1 / 24])


def body(
    omega: float = 2.0, ratio: float = 0.0, *, irregular: bool = False, stabilisation: float = 0.0, dim: int = 2
) -> Stability:
    """A body with one mode, of damping ratio `ratio`; a Courant number is omega dt."""
    damping = 2.0 * ratio * omega
    return SimpleNamespace(
        space=SimpleNamespace(dim=dim),
        frequency=omega,
        modes=np.roots([1.0, damping, omega**2]).astype(complex),
        damped=ratio > 0.0,
        irregular=irregular,
        stabilisation=stabilisation,
        largest=lambda dt, factor: dt**2 * omega**2 + factor * dt * damping,
        courant=lambda product: product,
    )  # type: ignore[return-value]


@pytest.mark.parametrize(("polynomial", "reach"), [(EULER, 0.0), (MIDPOINT, 0.0), (CLASSICAL, math.sqrt(8.0))])
def test_runge_kutta_on_the_imaginary_axis(polynomial: np.ndarray, reach: float) -> None:
    assert imaginary_limit(polynomial) == pytest.approx(reach, abs=1e-3)


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_leapfrog_in_parts_holds_two_a_part(parts: int) -> None:
    kicks = (0.5 / parts, *[1.0 / parts] * (parts - 1), 0.5 / parts)
    assert splitting_limit(kicks, (1.0 / parts,) * parts) == pytest.approx(2.0 * parts, abs=1e-3)


def test_without_damping_the_fastest_wave_decides() -> None:
    assert undamped_limit(body(), 2.0) == (0.98 * 2.0, "omega dt <= 2 for its fastest wave, times .98")
    courant, reason = limit_of(body(), CLASSICAL, 4)
    assert courant == pytest.approx(margins.HELD * math.sqrt(8.0), abs=1e-3)
    assert reason == "omega dt <= 2.828 for its fastest wave, times .98"
    assert limit_of(body(), MIDPOINT, 2)[0] == 0.0


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.9])
def test_euler_holds_a_damped_mode_up_to_twice_its_damping_ratio(ratio: float) -> None:
    """|1 + lambda dt|^2 = 1 - 2 ratio omega dt + (omega dt)^2."""
    courant, _ = damped_limit(body(ratio=ratio), lambda z: 1.0 + z, 2, 1.0)
    assert courant == pytest.approx(2.0 * ratio, rel=2e-3)
    assert limit_of(body(ratio=ratio), EULER, 1)[0] == pytest.approx(margins.EULER * courant, rel=1e-12)


@pytest.mark.parametrize("factor", [2.0, 4.0])
@pytest.mark.parametrize("ratio", [0.05, 0.3, 2.0])
def test_motion_that_alternates_grows_where_a_quadratic_equation_says(ratio: float, factor: float) -> None:
    """x^2 + 2 ratio factor x = 4, x = omega dt."""
    courant, reason = alternating_limit(body(ratio=ratio), factor)
    exact = math.sqrt((ratio * factor) ** 2 + 4.0) - ratio * factor
    assert courant == pytest.approx(margins.HELD * exact, rel=2e-3)
    assert reason == f"dt^2 K + {factor:.0f} dt D <= 4 for its waves and their damping, times 0.98"
    rough, _ = alternating_limit(body(ratio=ratio, irregular=True), factor)
    assert rough == pytest.approx(courant * margins.ALTERNATING_IRREGULAR / margins.HELD, rel=1e-12)


def test_less_is_taken_where_less_is_known() -> None:
    """A method that amplifies waves, of a held spectrum, of an irregular body, in more than one dimension."""
    plain, held = margin(body(), 2, True), margin(body(stabilisation=0.6), 2, True)
    rough = margin(body(stabilisation=0.6, irregular=True), 2, True)
    assert 1.0 > margin(body(), 4, False) > plain > held > rough > 0.5
    assert margin(body(), 1, True) < margin(body(dim=1), 1, True) == plain


def test_two_steps_on_two_sets() -> None:
    assert two_step_limit(0.25, 1) == (1.0, "2 sqrt(m2) of the interpolation weights")
    assert two_step_limit(0.25, 3)[0] == margins.CORNERS
    courant, reason = two_step_limit(-0.1, 2)
    assert courant == 0.0
    assert reason.startswith("the interpolation's second moment m2 = -0.1 is not positive")
