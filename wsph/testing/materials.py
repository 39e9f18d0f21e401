"""Checks that every material has to pass."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.constitutive.sampling import LawSampler
from wsph.plugins.traits import depends_on_stress, gives, relaxes, turns_itself
from wsph.protocols import Material
from wsph.testing.total_laws import check_total_law, of_constants

SAMPLES = 200
ROUNDING = {"f64": 1e-12, "f32": 1e-5}
"""What a law may differ by from what it should be, in either precision, a hundred times over."""


@dataclass(frozen=True)
class Trial:
    """A law on trial: what it is called in messages, its sampler, and the size of the stresses tried,
    nondimensional."""

    name: str
    law: LawSampler
    level: float
    random: np.random.Generator

    @property
    def tolerance(self) -> float:
        """Rounding of its precision."""
        return ROUNDING[self.law.space.precision]

    def same(self, a: np.ndarray, b: np.ndarray, what: str, size: float) -> None:
        """Both have to be the same, to rounding of numbers of a size."""
        gap = float(np.abs(a - b).max()) / size if a.size else 0.0
        assert gap <= 100.0 * self.tolerance, (
            f"{self.name}: {what}: differs by {gap:.2e} of the largest" + of_constants(gap, self.law.space.precision)
        )

    def finite(self, a: np.ndarray, what: str) -> None:
        """All of it has to be numbers."""
        assert np.isfinite(a).all(), f"{self.name}: {what} is not finite"

    def dissipated(self, stress: np.ndarray, plastic: np.ndarray, size: float) -> None:
        """The work of stresses on plastic strains, given as the stresses C of these, has to be nowhere below zero."""
        s_mean, p_mean = (np.einsum("nii->n", each) / 3.0 for each in (stress, plastic))
        deviators = np.einsum("nij,nij->n", stress, plastic) - 3.0 * s_mean * p_mean
        work = deviators / (2.0 * self.law.shear) + s_mean * p_mean / self.law.bulk
        assert work.min(initial=0.0) >= -self.tolerance * self.level * size, (
            f"{self.name}: dissipation is negative: {work.min():.2e}"
        )


def _symmetric(a: np.ndarray) -> np.ndarray:
    return 0.5 * (a + np.swapaxes(a, 1, 2))


def _rotations(n: int, random: np.random.Generator) -> np.ndarray:
    q, r = np.linalg.qr(random.standard_normal((n, 3, 3)))
    q *= np.sign(np.einsum("nii->ni", r))[:, None, :]
    q[:, :, 0] *= np.linalg.det(q)[:, None]
    return q


def check_material(
    material: Material, *, stress_level: float | None = None, precisions: tuple[str, ...] = ("f64", "f32")
) -> None:
    """Run what a material must obey, of whichever of `rate`, `project` and `stress` it has, on random stresses,
    velocity gradients, internals and deformations. Raises AssertionError.

    `stress_level` [Pa] is the size of the stresses tried (default: 1 % of the shear modulus). Of a rate: symmetric;
    none at rest without stress; the same in every frame (isotropy); affine in L; moduli() are its elastic response;
    `depends_on_stress`, `relaxes` and `turns_itself` told truly; dissipation not below zero. Of a way back to the yield
    surface: symmetric, the same in every frame, nothing without stress, the same when taken twice, dissipation not
    below zero. Of a total law: `wsph.testing.total_laws`. Of all: numbers, the same bits again, no particles, both
    precisions.
    """
    results: list[np.ndarray] = []
    for precision in precisions:
        name = f"{type(material).__name__} ({precision})"
        law = LawSampler(material, precision, name)
        level = (stress_level or 0.01 * material.moduli()[1]) / law.scales.stress
        trial = Trial(name, law, level, np.random.default_rng(7))
        assert gives(material, "rate") or gives(material, "stress"), f"{name}: has neither `rate` nor `stress`"
        found: list[np.ndarray] = []
        if gives(material, "rate"):
            found.append(_check_rate(trial, material))
        if gives(material, "project"):
            found.append(_check_return(trial))
        if gives(material, "stress"):
            found.append(check_total_law(law, name, gives(material, "energy"), 100.0 * trial.tolerance))
        results.append(np.concatenate([each.ravel() for each in found]))
    for other in results[1:]:
        gap = float(np.abs(other - results[0]).max())
        assert gap < 1e-4, f"{type(material).__name__}: single and double precision differ by {gap:.2e} of the largest"


def _check_rate(trial: Trial, material: Material) -> np.ndarray:
    """Check a rate; returns it for some samples, of size 1."""
    law, level, random, name = trial.law, trial.level, trial.random, trial.name
    stress = level * _symmetric(random.standard_normal((SAMPLES, 3, 3)))
    first, second = (level * random.standard_normal((SAMPLES, 3, 3)) for _ in range(2))
    zero = np.zeros_like(stress)
    rate, change = law(stress, first)
    trial.finite(rate, "a stress rate")
    trial.finite(change, "the rate of an internal")
    size = max(float(np.abs(rate).max()), level)
    trial.same(rate, np.swapaxes(rate, 1, 2), "the stress rate is not symmetric", size)
    at_rest, still = law(zero[:1], zero[:1])
    trial.same(at_rest, zero[:1], "the stress rate without stress and motion is not zero", size)
    assert np.abs(still).max(initial=0.0) <= trial.tolerance, f"{name}: an internal changes without stress and motion"
    Q = _rotations(SAMPLES, random)
    turned, turned_change = law(_turned(Q, stress), _turned(Q, first))
    trial.same(turned, _turned(Q, rate), "another frame gives another stress rate", size)
    most = max(float(np.abs(change).max(initial=0.0)), level)
    trial.same(turned_change, change, "another frame gives another rate of an internal", most)
    both, other, rest = law(stress, first + second)[0], law(stress, second)[0], law(stress, zero)[0]
    trial.same(both + rest, rate + other, "the rate is not affine in the velocity gradient", size)
    D = _symmetric(first)
    mean = np.einsum("nii->n", D)[:, None, None] * np.eye(3) / 3.0
    elastic = 3.0 * law.bulk * mean + 2.0 * law.shear * (D - mean)
    trial.same(
        law(zero, D)[0] - law(zero, zero)[0], elastic, "the response without stress is not that of moduli()", size
    )
    if not depends_on_stress(material):
        trial.same(law(zero, first)[0], rate, "depends_on_stress is False, but the rate depends on stress", size)
    if not relaxes(material):
        trial.same(rest, zero, "relaxes is False, but the stress rate at rest is not zero", size)
    if turns_itself(material):
        W = 0.5 * (first - np.swapaxes(first, 1, 2))
        turned_by = W @ stress - stress @ W
        trial.same(
            law(stress, W)[0] - rest, turned_by, "turns_itself is True, but a spin does not turn the stress", size
        )
    trial.dissipated(stress, -rest, size)
    again, _ = law(stress, first)
    assert np.array_equal(again, rate), f"{name}: the same input gave other bits"
    assert law(stress[:0], first[:0])[0].shape == (0, 3, 3), f"{name}: no particles are not accepted"
    return rate / size


def _check_return(trial: Trial) -> np.ndarray:
    """Check a way back to the yield surface, from stresses of the level and of ten times that; returns what it gives of
    some samples, of size 1."""
    law, random, name = trial.law, trial.random, trial.name
    sizes = trial.level * np.repeat([1.0, 10.0], SAMPLES // 2)[:, None, None]
    stress = sizes * _symmetric(random.standard_normal((SAMPLES, 3, 3)))
    back, q = law.project(stress)
    trial.finite(back, "a stress that `project` gives")
    trial.finite(q, "an internal that `project` gives")
    size = float(np.abs(stress).max())
    trial.same(back, np.swapaxes(back, 1, 2), "the stress that `project` gives is not symmetric", size)
    nothing, still = law.project(np.zeros_like(stress[:1]))
    trial.same(nothing, np.zeros_like(nothing), "`project` makes a stress where there is none", size)
    assert np.array_equal(still, np.tile(law.initial, (1, 1))), f"{name}: `project` changes an internal without stress"
    Q = _rotations(SAMPLES, random)
    turned, turned_q = law.project(_turned(Q, stress))
    trial.same(turned, _turned(Q, back), "another frame gives another stress from `project`", size)
    trial.same(
        turned_q, q, "another frame gives another internal from `project`", max(float(np.abs(q).max(initial=0.0)), size)
    )
    trial.same(law.project(back, q)[0], back, "`project` of what it gave gives something else", size)
    trial.dissipated(back, stress - back, size)
    again, _ = law.project(stress)
    assert np.array_equal(again, back), f"{name}: the same input of `project` gave other bits"
    assert law.project(stress[:0])[0].shape == (0, 3, 3), f"{name}: `project` does not accept no particles"
    return back / size


def _turned(Q: np.ndarray, a: np.ndarray) -> np.ndarray:
    return Q @ a @ np.swapaxes(Q, 1, 2)
