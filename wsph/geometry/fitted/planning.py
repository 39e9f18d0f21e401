"""The grid of a fitted body: lines on the planes that it can meet, and the patches that get a layer of their own."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.fitted.junctions import Junction
from wsph.geometry.fitted.outline import Outline, outline
from wsph.geometry.grid import FIT, lines
from wsph.geometry.shapes.combined import Shape

UPRIGHT = 1.0 - 1e-12
"""Component of a unit normal along an axis from which a plane lies across it."""


@dataclass(frozen=True)
class Plan:
    """A grid from `low` (dim,) [m] in steps of `spacing` [m], `count` (dim,) cells. Of every patch (patches,) bool: whether
    it is `flat`, whether the grid has a line on it, `met`, and whether it gets a layer, `layered`."""

    low: np.ndarray
    spacing: float
    count: np.ndarray
    flat: np.ndarray
    met: np.ndarray
    layered: np.ndarray

    def points(self, index: np.ndarray) -> np.ndarray:
        """Positions [m] of grid coordinates (n, dim)."""
        return self.low + index * self.spacing


def on_grid_lines(shape: Shape) -> bool:
    """Whether a shape has only flat patches that a grid along its axes has lines on, so that nothing is to be fitted."""
    known = shape.edges()
    for patch in shape.patches():
        normal = patch.surface.normal
        if normal is None or np.abs(normal).max() < UPRIGHT:
            return False
        axis = int(np.abs(normal).argmax())
        place = -float(patch.surface.height(np.zeros((1, shape.dim)))[0][0]) * np.sign(normal[axis])
        if not np.isclose(known[axis], place, rtol=1e-12).any():
            return False
    return True


def plan_layers(body: Outline, edges: list[Junction]) -> Plan:
    """The grid whose lines are on the planes with the largest area in all along every axis, and the patches that need
    layers: those that it does not meet, and those that a layer next to them goes on along."""
    flat = np.array([patch.surface.normal is not None for patch in body.patches])
    axis, place = _planes(body)
    low, high = body.shape.bounds()
    first, count = np.zeros(len(low)), np.zeros(len(low), int)
    for k in range(len(low)):
        there = np.flatnonzero(axis == k)
        planes = _fitting(place[there], body.areas[there], body.spacing)
        first[k], _, count[k] = lines(k, low[k], high[k], body.spacing, planes)
    across = (np.where(axis >= 0, place, 0.0) - first[axis]) / body.spacing
    met = (axis >= 0) & (np.abs(across - np.rint(across)) <= FIT * np.maximum(np.abs(across), 1.0))
    layered = ~met
    while True:
        before = layered.copy()
        for edge in edges:
            if edge.passes:
                layered[[edge.first, edge.second]] |= layered[edge.first] | layered[edge.second]
        if (layered == before).all():
            return Plan(first, body.spacing, count, flat, met, layered)


def unmet(shape: Shape, spacing: float) -> tuple[str, ...]:
    """The patches of a shape that no line of a grid of this `spacing` [m] lies on: those that a lattice meets in steps."""
    body = outline(shape, spacing)
    met = plan_layers(body, []).met
    return tuple(patch.name for patch, on in zip(body.patches, met, strict=True) if not on)


def _planes(body: Outline) -> tuple[np.ndarray, np.ndarray]:
    """The axis that a patch lies across, or -1, and the coordinate of its plane [m], (patches,) each."""
    axis, place = np.full(len(body.patches), -1), np.zeros(len(body.patches))
    for row, patch in enumerate(body.patches):
        normal = patch.surface.normal
        if normal is not None and np.abs(normal).max() >= UPRIGHT:
            axis[row] = np.abs(normal).argmax()
            height = float(patch.surface.height(np.zeros((1, len(normal))))[0][0])
            place[row] = -height * np.sign(normal[axis[row]])
    return axis, place


def _fitting(planes: np.ndarray, areas: np.ndarray, spacing: float) -> np.ndarray:
    """Of planes (n,) [m] with their areas those, in order and each once, that lie whole spacings apart: of all such sets
    the one of most area, the first of equal ones."""
    if not len(planes):
        return planes
    apart = (planes[:, None] - planes) / spacing
    alike = np.abs(apart - np.rint(apart)) <= FIT * np.maximum(np.abs(apart), 1.0)
    total: np.ndarray = (alike @ areas / areas.sum()).round(9)
    chosen = np.sort(planes[alike[total.argmax()]])
    return chosen[np.diff(chosen, prepend=-np.inf) > 0.5 * spacing]
