"""Closed forms and norms of the shock bars (Herreros & Mabssout 2011, 4.1): L = 1 m, c = 200 m/s, rho = 2000 kg/m3.

The stress at the fixed end is 0 before t0 = L/c = 5 ms and 2 rho c v0 = 8e5 Pa (compression) until t0 + 2.5 ms. A scheme
that is not exact needs some cells to rise, so errors are taken on the plateau, away from both jumps.
"""

import numpy as np

AMPLITUDE, ARRIVAL, DURATION = 8e5, 5e-3, 2.5e-3
MARGIN = 4e-4
"""Time cut off at both ends of the plateau [s]: eight cells at 100 particles, four at 50. Three cells at each end would
leave the foot of the front in: .27 % and 1.55 % in place of .0022 % and .50 %."""

CONVERGED = {5.5e-3: 7.641e5, 6e-3: 7.346e5, 7e-3: 6.891e5}
"""Converged compression at the fixed end of the Perzyna bar, N = 2, gamma = 2/s [Pa], by time [s]. One digit is .01 %."""


def plateau(time: np.ndarray, margin: float = MARGIN) -> np.ndarray:
    """Samples on the plateau, (n,) bool."""
    return (time > ARRIVAL + margin) & (time < ARRIVAL + DURATION - margin)


def elastic(time: np.ndarray) -> np.ndarray:
    """Compression at the fixed end of the elastic bar [Pa]."""
    return np.where((time > ARRIVAL) & (time < ARRIVAL + DURATION), AMPLITUDE, 0.0)


def viscoplastic(time: np.ndarray, youngs_modulus: float = 8e7, fluidity: float = 1.0) -> np.ndarray:
    """Compression at the fixed end of the Perzyna bar with N = 0 on the plateau [Pa]."""
    return AMPLITUDE - 0.5 * youngs_modulus * fluidity * (time - ARRIVAL)
