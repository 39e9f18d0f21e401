"""Descent of the distortion of cells, by nodes that keep to their surfaces: limited-memory BFGS (Nocedal, Math. Comput. 35
(1980) 773) in the planes that touch the surfaces, back onto them after each step."""

# pyright: strict

import numpy as np

from wsph.geometry.fitted.projection import Projection
from wsph.geometry.fitted.relax.distortion import Measure, distortion

REMEMBERED = 8
"""Steps whose change of the gradient is known."""

FARTHEST = 0.3
"""The way that a node goes in a step, in spacings, at most."""

SHORTEST = 1e-3
"""Part of a step at which it is given up."""

ENOUGH = 1e-4
"""Part of the descent by the slope that a step has to bring."""

SETTLED = 0.5
"""The steepest slope at a node, per spacing, below which descent ends: from there on roundings would grow, and cells hardly
change."""

BACK = 2
"""Gauss-Newton steps back onto the surface after a step along it."""


def descend(
    nodes: np.ndarray,
    corners: np.ndarray,
    moving: np.ndarray,
    onto: Projection,
    spacing: float,
    measure: Measure,
    steps: int,
) -> np.ndarray:
    """`nodes` (n, dim) [m] after at most so many steps that make cells with `corners` (c, 2^dim) less distorted; those not
    `moving` (n,) bool stay."""

    def look(at: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = distortion(at / spacing, corners, measure)
        return value, onto.along(at, gradient * moving[:, None])

    value, slope = look(nodes)
    known: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(steps):
        if np.abs(slope).max(initial=0.0) < SETTLED:
            break
        way = onto.along(nodes, _direction(slope, known) * moving[:, None])
        down = float((way * slope).sum())
        if not down < 0.0:
            known.clear()
            continue
        longest = float(np.linalg.norm(way, axis=1).max())
        part = min(1.0, FARTHEST / longest) if known else FARTHEST / longest
        least = SHORTEST * part
        while part >= least:
            there = nodes + part * spacing * way
            onto.onto(there, BACK)
            lower, ahead = look(there)
            if lower <= value + ENOUGH * part * down:
                break
            part *= 0.5
        else:
            if not known:
                break
            known.clear()
            continue
        moved, turned = (there - nodes) / spacing, ahead - slope
        if (moved * turned).sum() > 0.0:
            known = [*known, (moved, turned)][-REMEMBERED:]
        nodes, value, slope = there, lower, ahead
    return nodes


def _direction(slope: np.ndarray, known: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Minus the inverse of the second derivative, as far as it is known, times the slope."""
    way = -slope
    if not known:
        return way
    parts: list[float] = []
    for moved, turned in reversed(known):
        parts.append(float((moved * way).sum() / (moved * turned).sum()))
        way = way - parts[-1] * turned
    moved, turned = known[-1]
    way = way * float((moved * turned).sum() / (turned * turned).sum())
    for (moved, turned), part in zip(known, reversed(parts), strict=True):
        way = way + (part - float((turned * way).sum() / (moved * turned).sum())) * moved
    return way
