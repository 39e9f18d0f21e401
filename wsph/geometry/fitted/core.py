"""The cells of the grid that stay: inside, and so far from the surfaces with a layer that the layer has its room."""

# pyright: strict

import numpy as np

from wsph.geometry.fitted.outline import Outline
from wsph.geometry.fitted.planning import Plan, upright_plane

GAP = 0.5
"""Distance in spacings that the centres of cells keep from a curved surface with a layer."""

FLAT_GAP = 0.75
"""The same from a flat one that the grid could have met: of cells in rows along it all or none go."""

TIE = 1e-6
"""Distances that differ by less, in spacings, are equal, so that the same body has the same cells wherever it is."""


def kept_cells(body: Outline, plan: Plan) -> np.ndarray:
    """Which cells of the grid stay, (count) bool."""
    index = np.stack(np.meshgrid(*[np.arange(int(n)) for n in plan.count], indexing="ij"), -1).reshape(
        -1, len(plan.count)
    )
    kept = body.shape.holds(plan.points(index + 0.5)).reshape(plan.count)
    close = kept & near_surface(body, plan)
    rows = np.argwhere(close)
    centres = plan.points(rows + 0.5)
    stays = np.ones(len(rows), bool)
    for patch in np.flatnonzero(plan.layered):
        gap = FLAT_GAP if upright_plane(body.patches[patch]) is not None else GAP
        left = np.flatnonzero(stays)
        distance = body.distance(int(patch), centres[left], 2.0 * plan.spacing)
        stays[left] = distance > (gap + TIE) * plan.spacing
    kept[tuple(rows[~stays].T)] = False
    return kept


def near_surface(body: Outline, plan: Plan, cells: int = 2) -> np.ndarray:
    """The cells of the grid within some cells of one that the surface goes through, (count) bool."""
    near = np.zeros(plan.count, bool)
    for points in body.points:
        index = np.floor((points - plan.low) / plan.spacing).astype(int)
        near[tuple(np.clip(index, 0, plan.count - 1).T)] = True
    for axis in range(near.ndim):
        wide = np.pad(near, [(cells, cells) if k == axis else (0, 0) for k in range(near.ndim)])
        near = np.any(np.lib.stride_tricks.sliding_window_view(wide, 2 * cells + 1, axis), axis=-1)
    return near


def on_met(body: Outline, plan: Plan, index: np.ndarray, axis: int, sign: int) -> np.ndarray:
    """Of cells `index` (n, dim), which have on that side a patch that the grid meets, (n,) bool."""
    middle = index + 0.5
    middle[:, axis] += 0.5 * sign
    points, found = plan.points(middle), np.zeros(len(index), bool)
    for patch in np.flatnonzero(plan.met & ~plan.layered):
        normal = body.patches[patch].surface.normal
        if normal is not None and normal[axis] * sign > 0.5:
            found |= body.distance(int(patch), points, 0.1 * plan.spacing) <= 0.1 * plan.spacing
    return found
