"""The grid of a fitted body: lines on the planes that it can meet, and the patches that get a layer of their own."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.fitted.junctions import Junction
from wsph.geometry.fitted.outline import Outline, outline
from wsph.geometry.grid import FIT, lines
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.surfaces.surface import Patch

UPRIGHT = 1.0 - 1e-12
"""Component of a unit normal along an axis from which a plane lies across it."""


@dataclass(frozen=True)
class Plan:
    """A grid from `low` (dim,) [m] in steps of `spacing` [m], `count` (dim,) cells. Of every patch (patches,) bool: whether
    the grid has a line on it, `met`, and whether it gets a layer, `layered`."""

    low: np.ndarray
    spacing: float
    count: np.ndarray
    met: np.ndarray
    layered: np.ndarray

    def points(self, index: np.ndarray) -> np.ndarray:
        """Positions [m] of grid coordinates (n, dim)."""
        return self.low + index * self.spacing


def on_grid_lines(shape: Shape) -> bool:
    """Whether a shape has only flat patches that a grid along its axes has lines on, so that nothing is to be fitted."""
    known = shape.edges()
    planes = [upright_plane(patch) for patch in shape.patches()]
    return all(plane is not None and np.isclose(known[plane[0]], plane[1], rtol=1e-12).any() for plane in planes)


def upright_plane(patch: Patch) -> tuple[int, float] | None:
    """The axis that a flat patch lies across, and the coordinate of its plane [m]; None where it lies across none."""
    normal = patch.surface.normal
    if normal is None or np.abs(normal).max() < UPRIGHT:
        return None
    axis = int(np.abs(normal).argmax())
    height = float(patch.surface.height(np.zeros((1, len(normal))))[0][0])
    return axis, -height * float(np.sign(normal[axis]))


def plan_layers(body: Outline, edges: list[Junction]) -> Plan:
    """The grid whose lines are on the planes with the largest area in all along every axis, and the patches that need
    layers: those that it does not meet, and those that a layer next to them goes on along."""
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
            return Plan(first, body.spacing, count, met, layered)


def unmet(shape: Shape, spacing: float) -> tuple[str, ...]:
    """The patches of a shape that no line of a grid of this `spacing` [m] lies on: those that a lattice meets in steps."""
    body = outline(shape, spacing)
    met = plan_layers(body, []).met
    return tuple(patch.name for patch, on in zip(body.patches, met, strict=True) if not on)


def _planes(body: Outline) -> tuple[np.ndarray, np.ndarray]:
    """The axis that a patch lies across, or -1, and the coordinate of its plane [m], (patches,) each."""
    axis, place = np.full(len(body.patches), -1), np.zeros(len(body.patches))
    for row, patch in enumerate(body.patches):
        plane = upright_plane(patch)
        if plane is not None:
            axis[row], place[row] = plane
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
