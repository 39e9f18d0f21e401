"""Checks of total laws: stresses that follow from the deformation."""

# pyright: strict

import numpy as np

from wsph.constitutive.sampling import LawSampler

DOUBLED = (1e-10, 1e-6)
"""Gaps in double precision that constants in single precision make: 6e-8 of them, times what they count for."""


def of_constants(gap: float, precision: str) -> str:
    """What makes a gap of that size, where something is known for it, in words."""
    if precision != "f64" or not DOUBLED[0] < gap < DOUBLED[1]:
        return ""
    return (
        ". A gap this small is a constant in single precision: real(2.0/3.0) is rounded to it before it is a double; write"
        " real(2.0)/real(3.0)"
    )


SAMPLES, LARGE, SMALL = 100, 0.15, 1e-4
"""Displacement gradients of large strains and of small ones."""

STEP = {"f64": 1e-6, "f32": 1e-3}
"""Half of the difference of F over which the energy is differenced."""


def check_total_law(law: LawSampler, name: str, has_energy: bool, tolerance: float) -> np.ndarray:
    """Check the `stress` of a material: none without strain; symmetric; turned with the body, and not by a turn before
    the strain (isotropy); linear elasticity with moduli() at small strain; its `piola` is the same stress; its `energy`
    is the work of it, and least without strain; numbers, the same bits again, no particles. Raises AssertionError;
    returns the stress of some samples, of size 1."""
    random = np.random.default_rng(7)
    H, one, n = LARGE * random.standard_normal((SAMPLES, 3, 3)), np.eye(3), SAMPLES
    F = one + H
    cauchy, piola, energy = law.total(H)
    size = float(np.abs(cauchy).max())

    def same(a: np.ndarray, b: np.ndarray, what: str, by: float = size) -> None:
        gap = float(np.abs(a - b).max()) / by
        assert gap <= tolerance, f"{name}: {what}: differs by {gap:.2e} of the largest" + of_constants(
            gap, law.space.precision
        )

    for what, values in (("a stress", cauchy), ("a first Piola stress", piola), ("an energy", energy)):
        assert np.isfinite(values).all(), f"{name}: {what} of a strain of {LARGE} is not finite"
    at_rest, _, least = law.total(np.zeros((1, 3, 3)))
    same(at_rest, np.zeros_like(at_rest), "the stress without strain is not zero")
    same(cauchy, np.swapaxes(cauchy, 1, 2), "the stress is not symmetric")
    Q, _ = np.linalg.qr(random.standard_normal((n, 3, 3)))
    Q[:, :, 0] *= np.linalg.det(Q)[:, None]
    back = np.swapaxes(Q, 1, 2)
    turned, _, turned_energy = law.total(Q @ F - one)
    same(turned, Q @ cauchy @ back, "the stress does not turn with the body")
    same(law.total(F @ Q - one)[0], cauchy, "a turn before the strain gives another stress")
    volume = np.linalg.det(F)[:, None, None]
    same(
        piola,
        volume * cauchy @ np.swapaxes(np.linalg.inv(F), 1, 2),
        "`piola` is not the stress of `stress`",
        float(np.abs(piola).max()),
    )
    D = SMALL * (H + np.swapaxes(H, 1, 2)) / (2.0 * LARGE)
    mean = np.einsum("nii->n", D)[:, None, None] * one / 3.0
    elastic = 3.0 * law.bulk * mean + 2.0 * law.shear * (D - mean)
    gap = float(np.abs(law.total(D)[0] - elastic).max() / np.abs(elastic).max())
    # What is beyond linear is of the strain's own size.
    assert gap <= 100.0 * SMALL + tolerance / SMALL * 1e-2, (
        f"{name}: small strain is not that of moduli(): differs by {gap:.2e}"
    )
    if has_energy:
        most = float(np.abs(energy).max())
        same(turned_energy, energy, "the energy changes as the body turns", most)
        same(least, np.zeros_like(least), "the energy without strain is not zero", most)
        assert energy.min() >= -tolerance * most, f"{name}: an energy is below that without strain"
        _check_energy(law, name, H, piola)
    again = law.total(H)[0]
    assert np.array_equal(again, cauchy), f"{name}: the same input gave other bits"
    assert law.total(H[:0])[0].shape == (0, 3, 3), f"{name}: no particles are not accepted"
    return cauchy / size


def _check_energy(law: LawSampler, name: str, H: np.ndarray, piola: np.ndarray) -> None:
    """The derivative of the energy by F is the first Piola stress, to the differences' rounding and curvature."""
    step = STEP[law.space.precision]
    rounding = {"f64": 1e-16, "f32": 1e-7}[law.space.precision]
    allowed = 10.0 * rounding / step * float(np.abs(law.total(H)[2]).max()) + 1e2 * step**2
    for i in range(3):
        for j in range(3):
            moved = np.zeros((3, 3))
            moved[i, j] = step
            slope = (law.total(H + moved)[2] - law.total(H - moved)[2]) / (2.0 * step)
            gap = float(np.abs(slope - piola[:, i, j]).max())
            assert gap <= allowed, (
                f"{name}: the energy is not the work of the stress: dW/dF differs by {gap:.2e}"
                + of_constants(gap, law.space.precision)
            )
