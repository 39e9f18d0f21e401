"""Closed forms and fine integrations of every law that is shipped: a body pulled along one axis, and simple shear.

A strain along the pull is ln L where the body moves, and L - 1 in small strain, where nothing turns and no volume changes.
"""

from collections.abc import Callable

import numpy as np

from tests import scenes

NU, YIELD, HARDENING = 0.3, 2e-3, 5e-3
SHEAR, BULK = 1.0 / 2.6, 1.0 / 1.2
LAME = BULK - 2.0 * SHEAR / 3.0
FLUIDITY, PACE = 0.02, 0.01

LAWS = {
    "elastic": scenes.material("elastic"),
    "neo-hookean": scenes.material("neo-hookean"),
    "jaumann": scenes.material("jaumann"),
    "perzyna": scenes.material(
        "perzyna", yield_stress=YIELD, hardening_modulus=HARDENING, fluidity=FLUIDITY, exponent=1.0
    ),
    "mises": scenes.material("mises", yield_stress=YIELD, hardening_modulus=HARDENING),
}
"""E = rho = 1."""

STIFF = LAWS | {
    "mises": LAWS["mises"] | {"yield_stress": 1e3},
    "perzyna": LAWS["perzyna"] | {"yield_stress": 1e3},
}
"""The same that never yield."""

Line = tuple[np.ndarray, float, float]
"""Normal stresses (3,), volume over that at the start, and work per volume at the start."""


def elastic_line(free: list[int], stretch: float, small: bool = False) -> Line:
    """In closed form: stresses are moduli times the strain, and ln J = a ln L. What is `free` has no stress."""
    n, y = len(free), stretch - 1.0 if small else np.log(stretch)
    across = -LAME / (n * LAME + 2.0 * SHEAR) if n else 0.0
    D = np.array([1.0, *(across if k in free else 0.0 for k in (1, 2))])
    moduli, a = LAME * D.sum() + 2.0 * SHEAR * D, float(D.sum())
    return moduli * y, stretch**a, moduli[0] * ((a * y - 1.0) * np.exp(a * y) + 1.0) / a**2


def plastic_line(free: list[int], stretch: float, small: bool = False, steps: int = 400) -> Line:
    """Mises, brought back radially after equal steps of strain; what is free by a secant."""
    strain = stretch - 1.0 if small else np.log(stretch)
    part, s, plastic, J, work = strain / steps, np.zeros(3), 0.0, 1.0, 0.0

    def after(x: float) -> tuple[np.ndarray, float, np.ndarray]:
        D = np.array([part, *(x if k in free else 0.0 for k in (1, 2))])
        trial = s + LAME * D.sum() + 2.0 * SHEAR * D
        each = trial - trial.mean()
        size, limit = np.sqrt(1.5 * (each**2).sum()), YIELD + HARDENING * plastic
        more = max(size - limit, 0.0) / (3.0 * SHEAR + HARDENING)
        return trial - 3.0 * SHEAR * more * each / size, plastic + more, D

    for _ in range(steps):
        x = -0.5 * part
        if free:
            before, gap = x - 1e-3 * part, after(x - 1e-3 * part)[0][free[0]]
            for _ in range(8):
                there = after(x)[0][free[0]]
                if abs(there - gap) < 1e-16:
                    break
                x, before, gap = x - there * (x - before) / (there - gap), x, there
        new, plastic, D = after(x)
        work += J * np.exp(0.5 * D.sum()) * float(0.5 * (s + new) @ D)
        s, J = new, J * np.exp(D.sum())
    return s, J, work


def viscous_line(free: list[int], stretch: float, small: bool = False, speed: float = PACE, steps: int = 1500) -> Line:
    """Perzyna at a constant `speed` of the end of a body of length 1, by the midpoint rule."""
    s, plastic, J, work, pace = np.zeros(3), 0.0, 1.0, 0.0, np.sign(stretch - 1.0) * speed
    h = (stretch - 1.0) / pace / steps

    def rates(s: np.ndarray, plastic: float, t: float) -> tuple[np.ndarray, float, np.ndarray]:
        each, D = s - s.mean(), np.array([pace / (1.0 if small else 1.0 + pace * t), 0.0, 0.0])
        size = np.sqrt(1.5 * (each**2).sum()) + 1e-30
        flow = FLUIDITY * max(size / (YIELD + HARDENING * plastic) - 1.0, 0.0)
        d = 1.5 * flow * each / size
        if free:
            rate = LAME * (D - d).sum() + 2.0 * SHEAR * (D - d)[free[0]]
            D[free] = -rate / (len(free) * LAME + 2.0 * SHEAR)
        return LAME * (D - d).sum() + 2.0 * SHEAR * (D - d), flow, D

    for n in range(steps):
        ds, dp, D = rates(s, plastic, n * h)
        middle = s + 0.5 * h * ds
        ds, dp, D = rates(middle, plastic + 0.5 * h * dp, (n + 0.5) * h)
        work += J * np.exp(0.5 * h * D.sum()) * float(middle @ D) * h
        s, plastic, J = s + h * ds, plastic + h * dp, J * np.exp(h * D.sum())
    return s, J, work


LINES: dict[str, Callable[..., Line]] = {
    "elastic": elastic_line,
    "jaumann": elastic_line,
    "mises": plastic_line,
    "perzyna": viscous_line,
}
"""Of rate laws."""


def total(law: str, F: np.ndarray) -> np.ndarray:
    """Cauchy stress (3, 3) of the total laws: St Venant-Kirchhoff, which `elastic` is in one-set forms, and
    `neo-hookean`."""
    J, one = np.linalg.det(F), np.eye(3)
    if law == "neo-hookean":
        return (SHEAR * (F @ F.T - one) + LAME * np.log(J) * one) / J
    E = 0.5 * (F.T @ F - one)
    return F @ (LAME * np.trace(E) * one + 2.0 * SHEAR * E) @ F.T / J


def thinned(law: str, F: np.ndarray, free: tuple[int, ...] = (2,)) -> np.ndarray:
    """F (3, 3) with the stretch of the `free` directions, all alike, at which a total law has no stress along them, by
    bisection. Raises ValueError where there is none."""

    def after(across: float) -> np.ndarray:
        found = F.copy()
        found[free, free] = across
        return found

    low, high = 1e-6, 4.0
    if free and total(law, after(low))[free[0], free[0]] > 0.0:
        raise ValueError(f"{law} has a stress along {free} at any thickness")
    for _ in range(60 if free else 0):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if total(law, after(middle))[free[0], free[0]] > 0.0 else (middle, high)
    return after(low)


def total_line(law: str, free: list[int], stretch: float) -> np.ndarray:
    """Normal stresses (3,) of a total law."""
    return np.diag(total(law, thinned(law, np.diag([stretch, 1.0, 1.0]), tuple(free))))


def sheared(law: str, shear: float) -> tuple[float, float]:
    """sigma_xx = -sigma_yy and sigma_xy in simple shear: of Jaumann's rate, or of the rate in the axes of the material
    (Dienes 1979)."""
    if law == "jaumann":
        return SHEAR * (1.0 - np.cos(shear)), SHEAR * np.sin(shear)
    b = np.arctan(0.5 * shear)
    normal = np.cos(2.0 * b) * np.log(np.cos(b)) + b * np.sin(2.0 * b) - np.sin(b) ** 2
    along = 2.0 * b - 2.0 * np.tan(2.0 * b) * np.log(np.cos(b)) - np.tan(b)
    return 4.0 * SHEAR * normal, 2.0 * SHEAR * np.cos(2.0 * b) * along
