"""Walls that are too thin for a layer on either side and cells between."""

# pyright: strict

import numpy as np

from wsph.geometry.fitted.outline import OFF, Outline
from wsph.geometry.fitted.planning import Plan
from wsph.units import rounded_down

ROWS = 4.0
"""Thickness in spacings that a wall has at least between two surfaces with layers: two layers, and two rows of cells."""

ONE_LAYER = 3.0
"""The same with a layer on one side alone."""

OPPOSITE = -0.95
"""Cosine of the angle between the normals on both sides of a wall, at most: sharper than 18 degrees is a wall, too."""

TOUCH = 0.1
"""Thickness in spacings below which a wall is none: its surfaces touch, or meet at a sharp angle."""

SURE = 0.9
"""Part of the thinnest wall that samples have found that there is surely: round walls are thinner between samples."""

STEP = 0.5
"""Steps in spacings in which the other side is looked for."""


def check_walls(body: Outline, plan: Plan) -> None:
    """Raise ValueError for the thinnest wall with a layer that is thinner than it may be, with its place."""
    worst: tuple[float, str] | None = None
    for patch in np.flatnonzero(plan.layered):
        found = _thinnest(body, plan, int(patch))
        if found is not None and (worst is None or found[0] < worst[0]):
            worst = found
    if worst is not None:
        raise ValueError(worst[1])


def _thinnest(body: Outline, plan: Plan, patch: int) -> tuple[float, str] | None:
    points, normals = _thinned(body, patch)
    thickness = np.full(len(points), np.inf)
    for step in np.arange(STEP, ROWS + STEP, STEP) * body.spacing:
        left = np.flatnonzero(np.isinf(thickness))
        out = ~body.shape.holds(points[left] - step * normals[left])
        thickness[left[out]] = step
    rows = np.flatnonzero(np.isfinite(thickness))
    if not len(rows):
        return None
    points, normals, high = points[rows], normals[rows], thickness[rows]
    low = np.maximum(high - STEP * body.spacing, OFF * body.spacing)
    for _ in range(12):
        middle = 0.5 * (low + high)
        inside = body.shape.holds(points - middle[:, None] * normals)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    ends = points - high[:, None] * normals
    apart = np.stack([body.distance(k, ends, body.spacing) for k in range(len(body.patches))], 1)
    other = apart.argmin(1)
    facing = np.zeros(len(ends))
    for k in range(len(body.patches)):
        there = other == k
        facing[there] = (body.patches[k].surface.height(ends[there])[1] * normals[there]).sum(1)
    needed = np.where(plan.layered[other], ROWS, ONE_LAYER)
    thin = (facing < OPPOSITE) & (high < (needed - 10.0 * OFF) * body.spacing)
    if not thin.any():
        return None
    row = int(np.flatnonzero(thin)[high[thin].argmin()])
    rows_there = high[row] / body.spacing
    where, one = body.place(0.5 * (points[row] + ends[row])), body.patches[patch].name
    two = body.patches[int(other[row])].name
    if rows_there < TOUCH:
        least = np.degrees(np.arccos(-OPPOSITE))
        return float(rows_there), (
            f"{one} and {two} touch or meet at a sharp angle near {where}: a fitted surface needs a wall of {needed[row]:g} "
            f"spacings there, or an edge of at least {least:.0f} degrees, which no spacing gives"
        )
    return float(rows_there), (
        f"the wall at {where}, between {one} and {two}, is {high[row]:.3g} m thick, {rows_there:.2g} spacings, and a fitted "
        f"surface needs {needed[row]:g}: a spacing of {rounded_down(SURE * high[row] / ROWS, 3)} m does for all walls"
    )


def _thinned(body: Outline, patch: int) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a patch about a spacing apart, one for each cube of that size, and their normals."""
    points = body.points[patch]
    cube = np.floor(points / body.spacing + 0.5).astype(np.int64)
    _, first = np.unique(cube, axis=0, return_index=True)
    return points[first], body.normals[patch][first]
