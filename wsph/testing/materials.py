"""Checks that every material has to pass."""

from collections.abc import Callable
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.constitutive.laws import user_law
from wsph.constitutive.stress_state import STRESS_STATES
from wsph.plugins.traits import depends_on_stress, own_internals, relaxes, turns_itself
from wsph.protocols import Material
from wsph.units import Scales

SAMPLES = 200
_ROUNDING = {"f64": 1e-12, "f32": 1e-5}


class LawSampler:
    """A material's bare law over arrays, nondimensional: stress over rho c^2, rates over c per metre."""

    def __init__(self, material: Material, precision: str = "f64"):
        self.space = Space(3, precision)
        bulk, shear = material.moduli()
        state = STRESS_STATES[3, None]
        speed = state.wave_speed(bulk, shear, material.density)
        self.scales = Scales(1.0, 1.0 / speed, material.density)
        self.constitutive = Constitutive(self.space, material, state, self.scales, type(material).__name__)
        self.names = list(own_internals(material))
        self.initial = np.array([self.constitutive.internals[name] for name in self.names])
        self.bulk, self.shear = bulk / self.scales.stress, shear / self.scales.stress
        laws = self.constitutive.laws
        law = user_law(self.space, material, laws.Params, laws.internal)
        self._kernel = _sample_kernel(self.space, law, laws.Params, laws.internal)

    def __call__(self, stress: np.ndarray, L: np.ndarray, q: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Stress rate (n, 3, 3) and internals' rates (n, k) at `stress`, `L` (n, 3, 3) and internals `q` (n, k)."""
        n, width = len(stress), self.constitutive.laws.internal._length_
        internals = np.zeros((n, width))
        internals[:, : len(self.names)] = np.tile(self.initial, (n, 1)) if q is None else q
        arrays = [
            wp.array(v, dtype=t, device="cpu")
            for v, t in (
                (stress, self.space.tensor),
                (L, self.space.tensor),
                (internals, self.constitutive.laws.internal),
            )
        ]
        rate, change = wp.zeros_like(arrays[0]), wp.zeros_like(arrays[2])
        wp.launch(self._kernel, n, inputs=[self.constitutive.params, *arrays], outputs=[rate, change], device="cpu")
        return rate.numpy().astype(float).reshape(n, 3, 3), change.numpy().astype(float).reshape(n, width)[
            :, : len(self.names)
        ]


@cache
def _sample_kernel(space: Space, law: wp.Function, Params: type, internal: type) -> wp.Kernel:
    tensor = space.tensor

    @kernel()
    def sample(
        p: Params,
        stress: wp.array(dtype=tensor),
        L: wp.array(dtype=tensor),
        q: wp.array(dtype=internal),
        rate_out: wp.array(dtype=tensor),
        change_out: wp.array(dtype=internal),
    ):
        i = wp.tid()
        rate, change = law(p, stress[i], L[i], q[i])
        rate_out[i] = rate
        change_out[i] = change

    return sample


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
    """Run every law that a rate material must obey on random stresses, velocity gradients and internals.

    `stress_level` [Pa] is the size of the stresses tried (default: 1 % of the shear modulus). Checks: a symmetric rate; no
    rate at rest without stress; the same answer in every frame (isotropy); affine in L; moduli() are its elastic response;
    `depends_on_stress`, `relaxes` and `turns_itself` told truly; dissipation not below zero; the same bits again; no
    particles; both precisions agree.
    """
    name = type(material).__name__
    results = {}
    for precision in precisions:
        random = np.random.default_rng(7)
        law, tolerance = LawSampler(material, precision), _ROUNDING[precision]
        level = (stress_level or 0.01 * material.moduli()[1]) / law.scales.stress
        stress = level * _symmetric(random.standard_normal((SAMPLES, 3, 3)))
        first, second = (level * random.standard_normal((SAMPLES, 3, 3)) for _ in range(2))
        zero = np.zeros_like(stress)
        rate, change = law(stress, first)
        size = max(np.abs(rate).max(), level)
        results[precision] = (rate / size, change)

        def same(
            a: np.ndarray,
            b: np.ndarray,
            what: str,
            size: float = size,
            tolerance: float = tolerance,
            precision: str = precision,
        ) -> None:
            gap = float(np.abs(a - b).max()) / size if a.size else 0.0
            assert gap <= 100.0 * tolerance, f"{name} ({precision}): {what}: differs by {gap:.2e} of the largest rate"

        assert np.isfinite(rate).all(), f"{name} ({precision}): a stress rate is not finite"
        same(rate, np.swapaxes(rate, 1, 2), "the stress rate is not symmetric")
        at_rest, still = law(zero[:1], zero[:1])
        same(at_rest, zero[:1], "the stress rate without stress and motion is not zero")
        assert not still.size or np.abs(still).max() <= tolerance, (
            f"{name} ({precision}): an internal changes without stress and motion"
        )
        Q = _rotations(SAMPLES, random)
        turn: Callable[[np.ndarray], np.ndarray] = lambda a, Q=Q: Q @ a @ np.swapaxes(Q, 1, 2)  # noqa: E731
        turned, turned_change = law(turn(stress), turn(first))
        same(turned, turn(rate), "another frame gives another stress rate")
        same(
            turned_change,
            change,
            "another frame gives another rate of an internal",
            size=max(np.abs(change).max(initial=0.0), level),
        )
        both, other, rest = law(stress, first + second)[0], law(stress, second)[0], law(stress, zero)[0]
        same(both + rest, rate + other, "the rate is not affine in the velocity gradient")
        D = _symmetric(first)
        mean = np.einsum("nii->n", D)[:, None, None] * np.eye(3) / 3.0
        elastic = 3.0 * law.bulk * mean + 2.0 * law.shear * (D - mean)
        same(law(zero, D)[0] - law(zero, zero)[0], elastic, "the response without stress is not that of moduli()")
        if not depends_on_stress(material):
            same(law(zero, first)[0], rate, "depends_on_stress is False, but the rate depends on stress")
        if not relaxes(material):
            same(rest, zero, "relaxes is False, but the stress rate at rest is not zero")
        if turns_itself(material):
            W = 0.5 * (first - np.swapaxes(first, 1, 2))
            turned_by = W @ stress - stress @ W
            same(law(stress, W)[0] - rest, turned_by, "turns_itself is True, but a spin does not turn the stress")
        s_mean = np.einsum("nii->n", stress) / 3.0
        r_mean = np.einsum("nii->n", rest) / 3.0
        deviators = np.einsum("nij,nij->n", stress, rest) - 3.0 * s_mean * r_mean
        dissipation = -(deviators / (2.0 * law.shear) + s_mean * r_mean / law.bulk)
        assert dissipation.min() >= -tolerance * level * size, (
            f"{name} ({precision}): dissipation is negative: {dissipation.min():.2e}"
        )
        again, _ = law(stress, first)
        assert np.array_equal(again, rate), f"{name} ({precision}): the same input gave other bits"
        assert law(stress[:0], first[:0])[0].shape == (0, 3, 3), f"{name} ({precision}): no particles are not accepted"
    if len(results) == 2:
        (a, _), (b, _) = results.values()
        gap = float(np.abs(a - b).max())
        assert gap < 1e-4, f"{name}: single and double precision differ by {gap:.2e} of the largest rate"
