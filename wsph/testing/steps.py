"""A scene's step as a matrix, whole spectra, and how far conserved quantities go."""

# pyright: strict

from typing import cast

import numpy as np

from wsph.formulations.one_set import OneSetSystem
from wsph.protocols import DeviceArray
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.stability.krylov import Moving, Products


def step_matrix(scene: Scene, amplitude: float = 1.0) -> np.ndarray:
    """The linear part of a scene's step as a matrix over its flat nondimensional state, column by column from the program.

    For boundary values that do not depend on time, and linear materials or a small `amplitude` of the columns; (m, m) for a
    state of m numbers, all bodies' states one after the other. Prescribed values are imposed on every column first, so the
    constrained subspace is what it acts on. Of methods that keep nothing else between steps (not leapfrog).
    """
    composition = compose(scene)
    composition.compile()
    composition.program.prepare(1)
    states: list[DeviceArray] = [run.system.state.buffer for run in composition.bodies]
    sizes = [len(run.system.state.buffer) for run in composition.bodies]

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
