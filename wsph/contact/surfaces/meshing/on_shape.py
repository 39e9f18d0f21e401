"""Vertices of a surface in stairs moved onto the shape that the stairs stand for.

A vertex lies on the patches of all its sides: on one it is a projection, where two or three meet the edge or the corner
itself. Newton's steps X <- X - J^T (J J^T)^-1 d, d the heights over the patches, J their gradients.
"""

# pyright: strict

from dataclasses import dataclass, replace

import numpy as np

from wsph.contact.surfaces.meshing.boundary import Boundary
from wsph.contact.surfaces.meshing.shell import Shell, Stairs
from wsph.geometry.fitted.projection import to_all
from wsph.geometry.shapes.surfaces.surface import Patch

ON = 1e-9
"""Height over a patch below which a vertex lies on it [spacings]."""

MISSED = 1e-6
"""Height over one of its patches above which a vertex has not come to where they meet [spacings]."""

FAR = 1.3
"""Way onto patches above which it is not the vertex's own [spacings]: it takes the nearest point of one of them."""

FARTHEST = 2.0
"""Way from its node above which no vertex is [spacings]: how it moves would be a wide guess."""

SAME = 1e-3
"""Distance between the middles of sides that are the two banks of a cut [spacings]."""

NONE = -1
"""The patch of a side that stays in the lattice."""


@dataclass(frozen=True)
class OnShape:
    """Vertices on a shape: their nodes `at` and their places X, (n, dim) [m], and which of the `patches` each lies on, `on`
    (n, patches) bool; and of every side the patch that it stands for, `patch` (s,), NONE for one that stays."""

    at: np.ndarray
    X: np.ndarray
    on: np.ndarray
    patch: np.ndarray
    patches: tuple[Patch, ...]
    spacing: float

    def moved(self, places: np.ndarray) -> "OnShape":
        """Other places, each brought back onto its patches; those that are too far from their nodes then are not taken."""
        patterns, which = np.unique(self.on, axis=0, return_inverse=True)
        places = places.copy()
        for k, pattern in enumerate(patterns):
            rows = np.flatnonzero(which.ravel() == k)
            if pattern.any():
                places[rows] = _moved(places[rows], [self.patches[p] for p in np.flatnonzero(pattern)], self.spacing)
        far = np.linalg.norm(places - self.at, axis=1) > FARTHEST * self.spacing
        places[far] = self.X[far]
        return replace(self, X=places)


def on_shape(shell: Shell, boundary: Boundary) -> OnShape:
    """The vertices of the boundary of a shell on the shape that it stands for; where they are for one that is no stairs."""
    X = shell.nodes[boundary.node]
    none = np.full(len(boundary.cell), NONE)
    if shell.stairs is None:
        return OnShape(X, X, np.zeros((len(X), 0), bool), none, (), shell.spacing)
    patch = _of_sides(shell.stairs, boundary)
    patch[banks(X[boundary.sides].mean(1), shell.spacing)] = NONE
    on = np.zeros((len(X), len(shell.stairs.patches)), bool)
    stays = np.zeros(len(X), bool)
    for corner in boundary.sides.T:
        on[corner[patch >= 0], patch[patch >= 0]] = True
        stays[corner[patch < 0]] = True
    on[stays] = False
    return OnShape(X, X, on, patch, shell.stairs.patches, shell.spacing).moved(X)


def _of_sides(stairs: Stairs, boundary: Boundary) -> np.ndarray:
    """The patch of every side, by that of the face that it is; NONE for one that is no face of the geometry."""
    there = np.sort(np.concatenate([stairs.nodes, boundary.node[boundary.sides]]), axis=1)
    owner = np.concatenate([stairs.cell, boundary.cell])
    _, place = np.unique(np.concatenate([owner[:, None], there], 1), axis=0, return_inverse=True)
    place = place.ravel()
    found = np.full(int(place.max(initial=-1)) + 1, NONE)
    found[place[: len(stairs.cell)]] = stairs.label
    return found[place[len(stairs.cell) :]]


def banks(middles: np.ndarray, spacing: float) -> np.ndarray:
    """Which sides, with these `middles` (s, dim) [m], lie on another: the banks of a cut, (s,) bool."""
    keys = np.round(middles / (SAME * spacing)).astype(np.int64)
    _, place, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    return count[place.ravel()] > 1


def _moved(points: np.ndarray, patches: list[Patch], spacing: float) -> np.ndarray:
    """`points` (n, dim) on all `patches` at once; those that lie there already as they are."""
    heights = np.stack([np.abs(patch.surface.height(points)[0]) for patch in patches])
    off = np.flatnonzero(heights.max(0) > ON * spacing)
    moved = points.copy()
    if not len(off):
        return moved
    moved[off], missed = to_all(points[off], patches, spacing)
    lost = (np.linalg.norm(moved[off] - points[off], axis=1) > FAR * spacing) | (missed > MISSED * spacing)
    if lost.any():
        rows = off[lost]
        nearest = np.stack([patch.surface.nearest(points[rows]) for patch in patches])
        best = np.linalg.norm(nearest - points[rows], axis=2).argmin(0)
        moved[rows] = nearest[best, np.arange(len(rows))]
    return moved
