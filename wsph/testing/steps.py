"""A scene's step as a matrix, whole spectra, and how far conserved quantities go."""

# pyright: strict

import re
from typing import cast

import numpy as np

from wsph.backend.arrays import host
from wsph.errors import WsphError
from wsph.formulations.one_set import OneSetSystem
from wsph.plugins import integrators
from wsph.protocols import DeviceArray
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition, integrators_of
from wsph.stability.krylov import Moving, Products

AMPLITUDES = {"f64": 1e-5, "f32": 1e-2}
"""Nondimensional changes of a state, by its precision: velocities in wave speeds, displacements in spacings."""

SEEN = 3
"""Steps within which what a method keeps changes the state, if ever."""


def step_matrix(scene: Scene, amplitude: float | None = None) -> np.ndarray:
    """The linear part of a scene's step as a matrix over its flat nondimensional state, column by column from the program.

    (m, m) for m numbers: the states that the bodies go on from, one after the other, then what else of the states that the
    method keeps changes steps to come (an acceleration, variables of its own). Columns are differences about the start,
    of +-`amplitude`, by default a size at which strains are small and rounding is smaller still, the start at rest.
    Prescribed values, which may not depend on time, are imposed on every column first: it acts on the constrained subspace.
    Raises WsphError where a step is not finite.
    """
    return _Step(scene).matrix(amplitude)[0]


def spectral_radius(scene: Scene, amplitude: float | None = None) -> float:
    """Largest |eigenvalue| of a scene's step: above 1 it grows by that factor per step. `amplitude` as of `step_matrix`."""
    matrix, own = _Step(scene).matrix(amplitude)
    # What nothing reads again may stand still for ever, which is no motion: only what reaches the state counts.
    seen = np.zeros(len(matrix), bool)
    seen[:own] = True
    while (more := seen | (matrix[seen] != 0.0).any(0)).sum() > seen.sum():
        seen = more
    return float(np.abs(np.linalg.eigvals(matrix[np.ix_(seen, seen)])).max())


class _Step:
    """A scene's step as a function of numbers."""

    def __init__(self, scene: Scene):
        self._composition = composition = compose(scene)
        composition.compile()
        composition.program.prepare(1)
        systems = [run.system for run in composition.bodies]
        # A method that keeps variables of its own accepts them, and makes the state of them to be read.
        self._held = [(each.accepted or (each.state, 0))[0] for each in systems]
        self._own: list[DeviceArray] = [each.buffer for each in self._held]
        for system in systems:
            # About a body at rest: what moves already turns and stretches within the step.
            system.state.write("velocity", np.zeros((system.count, scene.dim)))
            system.hold(system.state, 0.0)
        for each in integrators_of(composition.bodies):
            integrators.begin(each)
        kept: list[tuple[str, DeviceArray]] = [each for system in systems for each in system.arrays.kept.items()]
        self._kept = [(each, host(each).copy()) for _, each in kept]
        states = [each for name, each in kept if re.fullmatch(r"state\d+", name)]
        others = [each for each in states if all(each is not own for own in self._own)]
        self._buffers = [*self._own, *(each for each in others if self._matters(each))]

    def _matters(self, buffer: DeviceArray) -> bool:
        """Whether steps from the start depend on what stands in a state."""
        found: list[np.ndarray] = []
        for size in (0.0, 1e-3):
            self._restart()
            start = host(buffer)
            buffer.assign(start + size * np.random.default_rng(0).standard_normal(len(start)).astype(start.dtype))
            self._composition.program.run(SEEN)
            found.append(np.concatenate([host(each) for each in self._own]))
        return not np.array_equal(*found, equal_nan=True)

    def _restart(self) -> None:
        for each, start in self._kept:
            each.assign(start)

    def __call__(self, change: np.ndarray) -> np.ndarray:
        """The numbers after a step from the start and a change of it."""
        self._restart()
        sizes = np.cumsum([len(host(each)) for each in self._buffers])[:-1]
        for buffer, part in zip(self._buffers, np.split(change, sizes), strict=True):
            start = host(buffer)
            buffer.assign(start + part.astype(start.dtype))
        for run, held in zip(self._composition.bodies, self._held, strict=True):
            run.system.hold(held, 0.0)
        self._composition.program.run(1)
        return np.concatenate([host(each) for each in self._buffers]).astype(float)

    def matrix(self, amplitude: float | None) -> tuple[np.ndarray, int]:
        """The matrix, and how many of its numbers are of the states that the bodies go on from."""
        size = amplitude or AMPLITUDES[self._composition.space.precision]
        count = sum(len(host(each)) for each in self._buffers)
        steps = [(self(size * each), self(-size * each)) for each in np.eye(count)]
        matrix = np.stack([ahead - behind for ahead, behind in steps], 1) / (2.0 * size)
        if not np.isfinite(matrix).all():
            raise WsphError("a step from the start is not finite, so it has no linear part: take a shorter one")
        return matrix, sum(len(host(each)) for each in self._own)


def whole_spectrum(system: Moving) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping of all free components of a one-set body, (m, m), mass-weighted and nondimensional: a product
    for every column of the operators that `wsph.stability.spectrum` projects. Without viscosity the damping is zero."""
    products = Products(system)
    free = np.flatnonzero(system.free_components)
    units = np.eye(products.count)[free]
    stiffness = np.array([products.stiffness(x)[free] for x in units]).T
    damping = np.array([products.damping(x)[free] for x in units]).T if system.drags else np.zeros_like(stiffness)
    products.restore()
    return stiffness, damping


def drift(composition: Composition, steps: int) -> tuple[float, float, float]:
    """How far linear momentum, angular momentum and energy of a free one-set body go in `steps` steps: the largest of
    ten looks, momentum over the mass times the largest speeds, the others over their own size."""
    run = composition.bodies[0]
    system, mass = cast(OneSetSystem, run.system), run.system.volume * run.system.density
    placed = "displacement" in system.state.widths

    def sums() -> tuple[np.ndarray, np.ndarray, float]:
        composition.publish()
        x = system.position / composition.scales.length
        x = x - x.mean(0) + (system.state.read("displacement") if placed else 0.0)
        v = system.state.read("velocity")
        spin = [mass @ (x[:, i] * v[:, j] - x[:, j] * v[:, i]) for i, j in ((0, 1), (1, 2), (0, 2)) if j < x.shape[1]]
        ledger = run.diagnostics.measure(system.state)
        return ledger.momentum, np.array(spin), ledger.kinetic + ledger.strain + system.held_energy()

    p, L, e = sums()
    size = np.sqrt(mass.sum() * (mass @ (system.state.read("velocity") ** 2).sum(1)))
    worst = [0.0, 0.0, 0.0]
    for _ in range(10):
        composition.program.run(steps // 10)
        now = sums()
        gaps = (np.abs(now[0] - p).max() / size, np.abs(now[1] - L).max() / np.abs(L).max(), abs(now[2] / e - 1.0))
        worst = [max(a, float(b)) for a, b in zip(worst, gaps, strict=True)]
    return worst[0], worst[1], worst[2]
