"""Stability regions of methods, and the limits of a body's time step that follow from them: public, for integrators.

A step of any method multiplies each small motion exp(lambda t) of a body by a number of its own, R(lambda dt). Of a
Runge-Kutta method R is a polynomial; of a splitting it is the half trace of a matrix. A body without damping has lambda = i
omega, so the method's limit is that of its fastest wave and how far R holds the imaginary axis (`imaginary_limit`,
`splitting_limit`). With damping every mode has to be looked at (`damped_limit`), or the motion that changes its sign from
step to step (`alternating_limit`).

A limit is (largest stable Courant number, "where it comes from"), as an integrator's `limit()` gives it. Margins are
taken off because only some modes of a body are known (`wsph.stability.margins`).
"""

# pyright: strict

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wsph.protocols import Stability
from wsph.stability import margins

Limit = tuple[float, str]
"""Largest stable Courant number, and where it comes from."""

Polynomial = NDArray[np.float64]
"""Coefficients of a stability polynomial R(z), ascending."""

WAVES: NDArray[np.float64] = np.linspace(1e-3, 12.0, 24001)
"""omega dt at which regions are looked at along the imaginary axis."""

LEAST = 0.02
"""omega dt below which a step is not worth taking."""


def imaginary_limit(polynomial: Polynomial) -> float:
    """Largest y up to which |R(iz)| <= 1 for all z <= y, R the stability polynomial (ascending coefficients)."""
    size = np.abs(_values(1j * WAVES, polynomial))
    beyond = np.flatnonzero(size > 1.0 + 1e-9)
    reach = float(WAVES[max(beyond[0] - 1, 0)]) if len(beyond) else float(WAVES[-1])
    # An |R| that leaves 1 as y^4 exceeds it by less than 1e-9 at first: that is no region.
    return reach if reach > 0.1 else 0.0


def splitting_limit(kicks: tuple[float, ...], drifts: tuple[float, ...]) -> float:
    """Largest omega dt up to which a splitting of kicks and drifts holds a wave: |trace|/2 of its step's matrix at most
    1."""
    y = WAVES
    a, b, c, d = np.ones_like(y), np.zeros_like(y), np.zeros_like(y), np.ones_like(y)
    for k, kick in enumerate(kicks):
        c, d = c - kick * y * a, d - kick * y * b
        if k < len(drifts):
            a, b = a + drifts[k] * y * c, b + drifts[k] * y * d
    beyond = np.flatnonzero(np.abs(a + d) > 2.0 + 1e-9)
    return float(y[beyond[0] - 1]) if len(beyond) else float(y[-1])


def undamped_limit(system: Stability, reach: float) -> Limit:
    """The Courant number at which the fastest wave of a body has omega dt = `reach`, less a margin."""
    end = f"{reach:.0f}" if reach.is_integer() else f"{reach:.3f}"
    return system.courant(margins.HELD * reach), f"omega dt <= {end} for its fastest wave, times .98"


def limit_of(system: Stability, polynomial: Polynomial, order: int) -> Limit:
    """The Courant number where the small motions of a body leave the region of a Runge-Kutta method."""
    reach = imaginary_limit(polynomial)
    if system.damped:
        share = margin(system, order, amplifies=reach == 0.0)
        return damped_limit(system, lambda z: _values(z, polynomial), len(polynomial), share)
    if reach == 0.0:
        return 0.0, "it amplifies every undamped wave: use leapfrog or rk4, or damp the waves of the body"
    return undamped_limit(system, reach)


def margin(system: Stability, order: int, amplifies: bool) -> float:
    """Share of the step that the known modes of a damped body bear.

    A method that amplifies waves is limited by the mode that is damped least for its frequency. The known modes are means of
    several, and bear longer steps than that one: by up to 2 %; by 8 % where a residual damps the fastest modes well, so that
    the least damped ones lie inside of the spectrum; by twice that in an irregular body, whose modes keep to few particles.
    Euler's limit follows the damping itself, not its third root: in more than one dimension by up to 35 %, irregular 60 %.
    """
    if not amplifies:
        return margins.HELD_IRREGULAR if system.irregular else margins.HELD
    euler = order == 1 and system.space.dim > 1
    share = margins.EULER if euler else margins.AMPLIFIED_INSIDE if system.stabilisation > 0.0 else margins.AMPLIFIED
    return share * (margins.AMPLIFIED_IRREGULAR if system.irregular else 1.0)


def damped_limit(
    system: Stability, amplification: Callable[[NDArray[np.complex128]], np.ndarray], stages: int, share: float
) -> Limit:
    """A share of the Courant number where damped motions leave the region |amplification(lambda dt)| <= 1. A method that
    amplifies waves may hold those that are damped."""
    if not 0.0 < system.frequency < np.inf:
        return system.courant(1.0), "its fastest wave"
    modes = system.modes
    # A method that needs a hundred times the steps of leapfrog is of no use.
    steps = np.geomspace(LEAST, 2.0 * stages**2, 400) / np.abs(modes).max()
    low, high = 0.0, steps[-1]

    def holds(dt: float) -> bool:
        return bool(np.abs(amplification(dt * modes)).max() <= 1.0 + 1e-9)

    for dt in steps:
        if not holds(dt):
            high = dt
            break
        low = dt
    if low == 0.0:
        return 0.0, "it amplifies undamped waves, and some stay undamped: use leapfrog or rk4"
    while high - low > 1e-3 * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return system.courant(share * system.frequency * low), "its waves and their damping"


def alternating_limit(system: Stability, factor: float) -> Limit:
    """The Courant number where motion that changes its sign from step to step begins to grow in a damped body: dt^2 K +
    factor dt D = 4. Of leapfrog the factor is 2 where damping is lagged, 4 where it is predicted."""
    low, high = 0.0, 2.0 / system.frequency
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if system.largest(middle, factor) <= 4.0 else (low, middle)
    share = margins.ALTERNATING_IRREGULAR if system.irregular else margins.HELD
    words = f"dt^2 K + {factor:.0f} dt D <= 4 for its waves and their damping, times {share:.2f}"
    return system.courant(share * system.frequency * low), words


def two_step_limit(second_moment: float, dim: int) -> Limit:
    """The Courant number of Taylor-SPH's two steps on two sets of particles: 2 sqrt(m2), m2 the second moment of the
    interpolation weights in spacings squared, and less where there are corners."""
    if second_moment <= 0.0:
        return (
            0.0,
            f"the interpolation's second moment m2 = {second_moment:.3g} is not positive: run.support does not suit these"
            " particles: 1.2 does on a lattice, 1.8 with jitter up to .2",
        )
    limit = 2.0 * math.sqrt(second_moment)
    if dim == 1:
        return limit, "2 sqrt(m2) of the interpolation weights"
    return margins.CORNERS * limit, ".9 of 2 sqrt(m2) of the interpolation weights, because corners grow above"


def _values(z: NDArray[Any], polynomial: Polynomial) -> NDArray[Any]:
    return np.polynomial.polynomial.polyval(z, polynomial)
