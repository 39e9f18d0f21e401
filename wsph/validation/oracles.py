"""Closed forms and converged values of the published cases, SI.

The shock bars (Herreros & Mabssout 2011, 4.1): L = 1 m, c = 200 m/s, rho = 2000 kg/m3. The stress at the fixed end is 0
before t0 = L/c = 5 ms and 2 rho c v0 = 8e5 Pa (compression) until t0 + 2.5 ms. A scheme that is not exact needs some cells
to rise, so errors are taken on the plateau, away from both jumps.
"""

# pyright: strict

from pathlib import Path

import numpy as np

AMPLITUDE, ARRIVAL, DURATION = 8e5, 5e-3, 2.5e-3

MARGIN = 4e-4
"""Time cut off at both ends of the plateau [s]: eight cells at 100 particles, four at 50. Three cells at each end would
leave the foot of the front in: 0.27 % and 1.55 % in place of 0.0022 % and 0.50 %."""

CONVERGED = {5.5e-3: 7.641e5, 6e-3: 7.346e5, 7e-3: 6.891e5}
"""Converged compression at the fixed end of the Perzyna bar, N = 2, gamma = 2/s [Pa], by time [s]. One digit is 0.01 %."""


def plateau(time: np.ndarray, margin: float = MARGIN) -> np.ndarray:
    """Samples on the plateau, (n,) bool."""
    return (time > ARRIVAL + margin) & (time < ARRIVAL + DURATION - margin)


def elastic(time: np.ndarray) -> np.ndarray:
    """Compression at the fixed end of the elastic bar [Pa]."""
    return np.where((time > ARRIVAL) & (time < ARRIVAL + DURATION), AMPLITUDE, 0.0)


def viscoplastic(time: np.ndarray, youngs_modulus: float = 8e7, fluidity: float = 1.0) -> np.ndarray:
    """Compression at the fixed end of the Perzyna bar with N = 0 on the plateau [Pa]."""
    return AMPLITUDE - 0.5 * youngs_modulus * fluidity * (time - ARRIVAL)


def vibrating_bar(x: np.ndarray, t: float) -> np.ndarray:
    """Stress in the bar of examples/vibrating_bar.toml [Pa] (Serroukh & Mabssout 2022, eq 26b)."""
    c = np.sqrt(2.0)
    return 50.0 * 0.1 / c * np.cos(np.pi * x) * np.sin(np.pi * c * t)


PLATE = {"youngs_modulus": 210e9, "poisson_ratio": 0.3, "density": 8000.0, "stress": 500e6, "height": 2.0}
"""The cracked plate of examples/crack_dsif.toml; `height` is its half."""


def plate_wave_speed() -> float:
    """Dilatational wave speed of the plate [m/s]."""
    nu = PLATE["poisson_ratio"]
    return float(np.sqrt(PLATE["youngs_modulus"] * (1 - nu) / ((1 + nu) * (1 - 2 * nu) * PLATE["density"])))


def freund(time: np.ndarray) -> np.ndarray:
    """Mode-I stress intensity factor of a half-infinite crack under a normal tensile wave [Pa sqrt(m)]
    (Serroukh & Mabssout 2022, eq 27)."""
    nu, c = PLATE["poisson_ratio"], plate_wave_speed()
    since = np.maximum(time - PLATE["height"] / c, 0.0)
    return 2.0 * PLATE["stress"] / (1.0 - nu) * np.sqrt(c * since * (1.0 - 2.0 * nu) / np.pi)


def beam_deflection(
    length: float = 1.0, height: float = 0.02, youngs_modulus: float = 8e9, shear: float = 4e4
) -> float:
    """Tip deflection of a cantilever with mean shear stress `shear` at its end [m] (Herreros & Mabssout 2011, 4.2)."""
    return 4.0 * length**3 * shear / (youngs_modulus * height**2)


def plate_ligament(table: Path, radius: float, x: np.ndarray) -> np.ndarray:
    """Static sigma_yy(x, 0) over its mean beside the hole of the square plate: tests/references/plate_with_void.py."""
    columns = np.genfromtxt(table, delimiter=",", names=True, deletechars="")
    return np.interp(x, columns[f"x_{radius:g}"], columns[f"sigma_{radius:g}"])


BEAM_FREQUENCY = {0.05: 1026.18, 0.1: 2008.23}
"""First frequency of the magnesium beams [rad/s], L = 0.5 m, by height [m]: tests/references/beam_modes.py."""

MAGNESIUM_SPEED = float(np.sqrt(45e9 / 1738.0))
"""sqrt(E/rho) of magnesium [m/s]: the speed in He & Seaid's Courant number."""

STRUCK_BEAM = {10.0: 1.3, 20.0: 5.45, 30.0: 9.17, 40.0: 13.05}
"""Mean deflection of the middle of Islam & Peng's beam from 0.9 to 1.5 ms [mm], by speed [m/s], 14 rows of elements at
20 m/s, 7 at the others: tests/references/struck_beam.py."""


def rigid_plastic(speed: float) -> float:
    """Deflection of the middle of Islam & Peng's clamped beam, struck at `speed` [m/s], as a rigid-plastic one [mm].

    Their eq 36: H/2 (sqrt(1 + M V^2 L/(2 M_p H)) - 1), M_p = b H^2 sigma_y/4, per width, with a free span 2 L = 101.6 mm.
    """
    height, mass, half, plastic = 6.35e-3, 10.55, 50.8e-3, 277.8e6 * 6.35e-3**2 / 4.0
    return float(1e3 * 0.5 * height * (np.sqrt(1.0 + mass * speed**2 * half / (2.0 * plastic * height)) - 1.0))


RATIO = 0.3
"""Poisson's ratio of the bodies with curved surfaces; their Young's modulus and density are 1."""


def _plane(radial: np.ndarray, hoop: np.ndarray, sheared: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Stress xx, yy, xy (m, 3) of radial, hoop and shear stress (m,) at `place` (m, 2)."""
    c, s = place.T / np.hypot(*place.T)
    xx = radial * c * c + hoop * s * s - 2.0 * sheared * c * s
    yy = radial * s * s + hoop * c * c + 2.0 * sheared * c * s
    return np.stack([xx, yy, (radial - hoop) * c * s + sheared * (c * c - s * s)], 1)


def ring_displacement(r: np.ndarray, pressure: float) -> np.ndarray:
    """Outward displacement of a ring of radii 0.5 and 1 under a pressure inside, plane stress (Lame)."""
    return pressure / 3.0 * ((1.0 - RATIO) * r + (1.0 + RATIO) / r)


def ring_stress(place: np.ndarray, pressure: float) -> np.ndarray:
    """Its stress xx, yy, xy (m, 3) at `place` (m, 2)."""
    square = (place**2).sum(1)
    return _plane(pressure / 3.0 * (1.0 - 1.0 / square), pressure / 3.0 * (1.0 + 1.0 / square), 0.0 * square, place)


def kirsch_stress(place: np.ndarray, far: float) -> np.ndarray:
    """Stress xx, yy, xy (m, 3) at `place` (m, 2) about a hole of radius 1 under a stress xx far away (Kirsch)."""
    a, angle = 1.0 / (place**2).sum(1), np.arctan2(place[:, 1], place[:, 0])
    c, s = np.cos(2.0 * angle), np.sin(2.0 * angle)
    radial = 0.5 * far * (1.0 - a + (1.0 - 4.0 * a + 3.0 * a * a) * c)
    hoop = 0.5 * far * (1.0 + a - (1.0 + 3.0 * a * a) * c)
    return _plane(radial, hoop, -0.5 * far * (1.0 + 2.0 * a - 3.0 * a * a) * s, place)


def disc_displacement(r: np.ndarray, speed: float) -> np.ndarray:
    """Outward displacement of a disc of radius 1 that spins with `speed` [rad/s], plane stress."""
    return (1.0 - RATIO) / 8.0 * speed**2 * r * (3.0 + RATIO - (1.0 + RATIO) * r * r)


def disc_stress(place: np.ndarray, speed: float) -> np.ndarray:
    """Its stress xx, yy, xy (m, 3) at `place` (m, 2), along axes that turn with it."""
    square = (place**2).sum(1)
    hoop = speed**2 / 8.0 * (3.0 + RATIO - (1.0 + 3.0 * RATIO) * square)
    return _plane(speed**2 / 8.0 * (3.0 + RATIO) * (1.0 - square), hoop, 0.0 * square, place)


BLOCK_FREQUENCY = 0.010123997
"""First frequency of a clamped block of 10 x 1 x 1, E = rho = 1 [rad/s]: tests/references/beam_modes.py."""


def breathing_sphere() -> tuple[float, float]:
    """Wave number k and frequency [rad/s] of the breathing mode of a sphere of radius 1: tan k = k/(1 - k^2 c^2/(4 c_s^2))
    with the speeds of pressure and shear waves (Lamb)."""
    shear = 0.5 / (1.0 + RATIO)
    wave = (1.0 - RATIO) / ((1.0 + RATIO) * (1.0 - 2.0 * RATIO))
    low, high = 0.5 * np.pi + 1e-9, np.pi - 1e-9
    for _ in range(60):
        k = 0.5 * (low + high)
        # Sines in place of tangents: no pole between.
        beyond = np.sin(k) * (1.0 - 0.25 * k * k * wave / shear) - k * np.cos(k) > 0.0
        low, high = (low, k) if beyond else (k, high)
    return float(0.5 * (low + high)), float(0.5 * (low + high) * np.sqrt(wave))


def pressed_ball(depth: float, ratio: float) -> float:
    """Force on a ball of radius and Young's modulus 1 between rigid plates, at a way of each plate towards its middle
    (Tatara 1991: Hertz's approach a^2/R less what the force on the far side pushes the place in by)."""

    def way(a: float) -> float:
        force, far = 4.0 * a**3 / (3.0 * (1.0 - ratio**2)), a * a + 4.0
        return a * a - force / np.pi * (2.0 * (1.0 + ratio) / far**1.5 + (1.0 - ratio**2) / far**0.5)

    low, high = 0.0, 1.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if way(middle) < depth else (low, middle)
    return 4.0 * low**3 / (3.0 * (1.0 - ratio**2))
