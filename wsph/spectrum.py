"""The fastest wave and the strongest damping of a one-set body, from its own right-hand sides: what limits its time step."""

from typing import Any

import numpy as np

LANCZOS = 20
"""Products of Lanczos' method for the largest frequency."""


def extremes(system: Any) -> tuple[float, float]:
    """The largest frequency of the undamped body about its current state, nondimensional, an upper estimate; and the largest
    growth rate of a mode that does not oscillate, zero where none is sure.

    Lanczos on K w = -(a(u + eps w) - a(u))/eps, mass-weighted, prescribed components held: LANCZOS products, the outermost
    Ritz values and their residuals. A start vector at random in both signs has its share of the fastest mode.
    """
    base, moved, change = system.state, system.temporary(), system.temporary()
    mass = np.sqrt(np.repeat(system.volume, system.space.dim))
    free = system.free_components
    if not free.any():
        return 0.0, 0.0
    split, eps = len(free), 1e-6 if system.space.precision == "f64" else 1e-2
    start = base.buffer.numpy().copy()
    place = base.start["displacement"]
    evolved = not system.form.total or system.form.moving

    def changes(w: np.ndarray) -> np.ndarray:
        """How what is integrated follows the strain of velocities eps w, and whatever it does at rest."""
        moved.buffer.assign(np.concatenate([eps * w, start[split:]]).astype(system.space.numpy))
        system.rate(base, change, "velocity")
        system.rate(moved, change, "rest")
        return change.buffer.numpy().astype(np.float64)

    def accelerations(w: np.ndarray) -> np.ndarray:
        """a(u + eps w) with the velocities at rest."""
        shifted = start.astype(np.float64)
        if evolved:
            increment = changes(w) - resting
            for name in (name for name in ("stress", "deformation") if name in base.start):
                a = base.start[name]
                b = a + base.counts[name] * base.widths[name]
                shifted[a:b] += increment[a:b]
        shifted[:split] = 0.0
        shifted[place : place + split] += eps * w
        moved.buffer.assign(shifted.astype(system.space.numpy))
        system.rate(moved, change, "velocity")
        return change.buffer.numpy()[:split].astype(np.float64)

    resting = changes(np.zeros(split)) if evolved else None
    rest = accelerations(np.zeros(split))
    x = np.random.default_rng(0).standard_normal(split) * free
    basis, diagonal, beside = [x / np.linalg.norm(x)], [], []
    for _ in range(LANCZOS):
        w = -(accelerations(basis[-1] / mass) - rest) / eps * mass * free
        diagonal.append(float(w @ basis[-1]))
        for _ in range(2):
            for b in basis:
                w -= (w @ b) * b
        beside.append(float(np.linalg.norm(w)))
        if not np.isfinite(beside[-1]):
            return np.inf, 0.0
        if beside[-1] < 1e-12 * max(abs(diagonal[0]), 1e-300):
            break
        basis.append(w / beside[-1])
    n = len(diagonal)
    ritz = np.diag(diagonal) + np.diag(beside[: n - 1], 1) + np.diag(beside[: n - 1], -1)
    values, vectors = np.linalg.eigh(ritz)
    residuals = beside[n - 1] * np.abs(vectors[-1]) if n == LANCZOS else np.zeros(n)
    base.buffer.assign(start)
    system.refresh(base)
    return float(np.sqrt(max(values[-1] + residuals[-1], 0.0))), float(np.sqrt(max(-values[0] - residuals[0], 0.0)))


def largest_damping(system: Any) -> float:
    """The largest damping rate nu of the viscosity about the current state, nondimensional.

    Power iteration on the drag of small velocities, switched as it is: 10 products, and 2 % for what they miss.
    """
    free = system.free_components
    if not system.viscous or not free.any():
        return 0.0
    moved, change = system.temporary(), system.temporary()
    start = system.state.buffer.numpy().copy()
    split, growth = len(free), 0.0
    # Alternating from particle to particle: the mode that pairs damp most; the switch passes half of its pairs. Points see
    # what moves along an axis and alternates along that.
    index = np.rint(system.grid_index)
    along = index if system.points else np.repeat(index.sum(1)[:, None], system.space.dim, 1)
    x = ((-1.0) ** along).ravel() * free
    for _ in range(10):
        x /= np.linalg.norm(x)
        state = start.astype(np.float64)
        state[:split] = 1e-9 * x
        moved.buffer.assign(state.astype(system.space.numpy))
        system.rate(moved, change, "velocity")
        x = -system.drag.numpy().reshape(-1)[:split].astype(np.float64) / 1e-9 * free
        growth = float(np.linalg.norm(x))
        if growth == 0.0:
            break
    system.state.buffer.assign(start)
    system.refresh(system.state)
    return 1.02 * growth
