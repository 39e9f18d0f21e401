"""Conformance kits for plugins: what every material and every integrator must do. Our own run them too.

    from wsph.testing import check_material, check_integrator

    def test_mine():
        check_material(Mine(density=1000.0, ...))
        check_integrator("mine", order=2)

Each check raises AssertionError with a sentence that says what the plugin did and what was expected.
"""

import itertools
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from wsph.composition import Composition, compose
from wsph.constitutive import Constitutive, user_law
from wsph.driver import run
from wsph.plugins import relaxes
from wsph.scene import Scene
from wsph.space import Space
from wsph.spectrum import Products
from wsph.stress_state import STRESS_STATES
from wsph.units import Scales

SAMPLES = 200
AMPLITUDE = 0.01
_ROUNDING = {"f64": 1e-12, "f32": 1e-5}


class LawSampler:
    """A material's bare law over arrays, nondimensional: stress over rho c^2, rates over c per metre."""

    def __init__(self, material: Any, precision: str = "f64"):
        self.space = Space(3, precision)
        bulk, shear = material.moduli()
        state = STRESS_STATES[3, None]
        speed = state.wave_speed(bulk, shear, material.density)
        self.scales = Scales(1.0, 1.0 / speed, material.density)
        self.constitutive = Constitutive(self.space, material, state, self.scales, type(material).__name__)
        self.names = list(getattr(material, "internals", {}))
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

    @wp.kernel(module="unique", enable_backward=False)
    def sample(p: Params, stress: wp.array(dtype=tensor), L: wp.array(dtype=tensor), q: wp.array(dtype=internal),
               rate_out: wp.array(dtype=tensor), change_out: wp.array(dtype=internal)):  # fmt: skip
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
    material: Any, *, stress_level: float | None = None, precisions: tuple[str, ...] = ("f64", "f32")
) -> None:
    """Run every law that a rate material must obey on random stresses, velocity gradients and internals.

    `stress_level` [Pa] is the size of the stresses tried (default: 1 % of the shear modulus). Checks: a symmetric rate; no
    rate at rest without stress; the same answer in every frame (isotropy); affine in L; moduli() are its elastic response;
    `depends_on_stress` and `relaxes` told truly; dissipation not below zero; the same bits again; no particles; both
    precisions agree.
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
        if not getattr(material, "depends_on_stress", True):
            same(law(zero, first)[0], rate, "depends_on_stress is False, but the rate depends on stress")
        if not relaxes(material):
            same(rest, zero, "relaxes is False, but the stress rate at rest is not zero")
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


def vibrating_bar(
    integrator: str | dict[str, Any],
    *,
    cells: int = 20,
    courant: float = 0.2,
    precision: str = "f64",
    periods: float = 0.25,
    amplitude: float = AMPLITUDE,
    material: dict[str, Any] | None = None,
    formulation: str | None = None,
    **body: Any,
) -> Scene:
    """A bar of length 1 m held at both ends, started in its first mode, for `periods` of it: smooth, with a closed form.

    v = a sin(pi x) cos(pi c t), stress = rho c a cos(pi x) sin(pi c t), a = `amplitude` [m/s] (.01 is a strain that large-
    deformation methods take for small, and no shock forms), c = 1 m/s, rho = 1 kg/m3, E = 1 Pa. `material` are keys of
    another material of that E and rho, `body` further keys of the body.
    """
    return Scene(
        schema=1, dim=1, title="vibrating bar",
        run={"integrator": integrator, "end": 2.0 * periods, "cfl": courant, "precision": precision, "guard": "off", "device": "cpu",
             **({"formulation": formulation} if formulation else {})},
        bodies=[{
            "name": "bar", "shape": {"type": "box", "min": [0.0], "max": [1.0]}, "spacing": 1.0 / cells, "state": "stress", "velocity": [f"{amplitude}*sin(pi*x)"],
            "material": {"model": "elastic", "density": 1.0, "youngs_modulus": 1.0, "poisson_ratio": 0.0} | (material or {}), **body,
        }],
        stop={"energy": 1e9},
        boundary=[{"body": "bar", "face": "-x", "fixed": ["x"]}, {"body": "bar", "face": "+x", "fixed": ["x"]}],
    )  # fmt: skip


def temporal_order(
    integrator: str | dict[str, Any], courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025), **scene: Any
) -> float:
    """Order in time at a fixed spacing: slope of the differences between runs at halved time steps, by regression.

    `scene` are further arguments of `vibrating_bar`.
    """
    states = [run(vibrating_bar(integrator, courant=c, **scene)).particles["velocity"][:, 0] for c in courant]
    differences = [np.linalg.norm(a - b) for a, b in itertools.pairwise(states)]
    return float(np.polyfit(np.log(courant[:-1]), np.log(differences), 1)[0])


def check_integrator(
    integrator: str | dict[str, Any],
    *,
    order: float,
    tolerance: float = 0.1,
    courant: tuple[float, ...] = (0.2, 0.1, 0.05, 0.025),
) -> None:
    """Run what a registered integrator must do: its order in time over the Courant numbers `courant`, the same bits again,
    both precisions agree."""
    measured = temporal_order(integrator, courant)
    assert abs(measured - order) <= tolerance, f"{integrator}: order {measured:.3f} in time, not {order}"
    runs = [run(vibrating_bar(integrator, courant=courant[0])) for _ in range(2)]
    a, b = (r.particles["velocity"] for r in runs)
    assert np.array_equal(a, b), f"{integrator}: the same scene gave other bits"
    single = run(vibrating_bar(integrator, courant=courant[0], precision="f32")).particles["velocity"]
    gap = np.abs(single - a).max() / AMPLITUDE
    assert gap < 1e-4, f"{integrator}: single and double precision differ by {gap:.2e} of the velocity"


def step_matrix(scene: Scene, amplitude: float = 1.0) -> np.ndarray:
    """The linear part of a scene's step as a matrix over its flat nondimensional state, column by column from the program.

    For boundary values that do not depend on time, and linear materials or a small `amplitude` of the columns; (m, m) for a
    state of m numbers, all bodies' states one after the other. Prescribed values are imposed on every column first, so the
    constrained subspace is what it acts on. Of methods that keep nothing else between steps (not leapfrog).
    """
    composition = compose(scene)
    composition.compile()
    composition.program.prepare(1)
    states = [run.system.state.buffer for run in composition.bodies]
    sizes = [len(buffer) for buffer in states]

    def step(vector: np.ndarray) -> np.ndarray:
        for buffer, part in zip(states, np.split(vector, np.cumsum(sizes)[:-1]), strict=True):
            buffer.assign(part.astype(composition.space.numpy))
        for body in composition.bodies:
            body.system.hold(body.system.state, 0.0)
        composition.program.run(1)
        return np.concatenate([buffer.numpy() for buffer in states]).astype(float)

    total = sum(sizes)
    rest = step(np.zeros(total))
    return np.stack([step(column) - rest for column in amplitude * np.eye(total)], 1) / amplitude


def spectral_radius(scene: Scene, amplitude: float = 1.0) -> float:
    """Largest |eigenvalue| of a scene's step: above 1 it grows by that factor per step."""
    return float(np.abs(np.linalg.eigvals(step_matrix(scene, amplitude))).max())


def whole_spectrum(system: Any) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping of all free components of a one-set body, (m, m), mass-weighted and nondimensional: a product
    for every column of what `wsph.spectrum` projects. Without viscosity the damping is zero."""
    products = Products(system)
    free = np.flatnonzero(products.free)
    units = np.eye(len(products.free))[free]
    stiffness = np.array([products.stiffness(x)[free] for x in units]).T
    damping = np.array([products.damping(x)[free] for x in units]).T if system.viscous else np.zeros_like(stiffness)
    products.restore()
    return stiffness, damping


def drift(composition: Composition, steps: int) -> tuple[float, float, float]:
    """How far linear momentum, angular momentum and energy of a free body go in `steps` steps: the largest of ten looks,
    momentum over the mass times the largest speeds, the others over their own size."""
    run = composition.bodies[0]
    system, mass = run.system, run.system.volume * run.system.density
    placed = "displacement" in system.state.widths

    def sums() -> tuple[np.ndarray, np.ndarray, float]:
        composition.publish()
        x = system.position / composition.scales.length
        x = x - x.mean(0) + (system.state.read("displacement") if placed else 0.0)
        v = system.state.read("velocity")
        spin = [mass @ (x[:, i] * v[:, j] - x[:, j] * v[:, i]) for i, j in ((0, 1), (1, 2), (0, 2)) if j < x.shape[1]]
        ledger = run.diagnostics.measure(system.state)
        return ledger.momentum, np.array(spin), ledger.kinetic + ledger.strain + system.hourglass_energy()

    p, L, e = sums()
    size = np.sqrt(mass.sum() * (mass @ (system.state.read("velocity") ** 2).sum(1)))
    worst = [0.0, 0.0, 0.0]
    for _ in range(10):
        composition.program.run(steps // 10)
        now = sums()
        gaps = (np.abs(now[0] - p).max() / size, np.abs(now[1] - L).max() / np.abs(L).max(), abs(now[2] / e - 1.0))
        worst = [max(a, float(b)) for a, b in zip(worst, gaps, strict=True)]
    return worst[0], worst[1], worst[2]
