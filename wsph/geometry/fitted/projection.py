"""Points moved onto surfaces: to the intersection of some, by the least motion that lies there."""

# pyright: strict

import numpy as np

from wsph.geometry.shapes.surfaces.surface import Patch

STEPS = 12
"""Gauss-Newton steps: quadratic to a point where surfaces cross, halving where they touch."""

FARTHEST = 0.5
"""Length of a step in spacings, at most."""

SINGULAR = 1e-9
"""Added to squares of gradients, so that surfaces that are the same plane have a least motion, too."""


def least_motion(heights: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """The shortest moves (n, dim) that take `heights` (n, k) with `gradients` (n, k, dim) to zero to first order. A surface
    that says nothing has a gradient of zero."""
    if heights.shape[1] == 1:
        return -gradients[:, 0] * heights / np.maximum((gradients[:, 0] ** 2).sum(1, keepdims=True), SINGULAR)
    squares = np.einsum("nkd,njd->nkj", gradients, gradients) + SINGULAR * np.eye(heights.shape[1])
    parts = np.asarray(np.linalg.solve(squares, heights[..., None]), float)[..., 0]
    return -np.einsum("nkd,nk->nd", gradients, parts)


def to_all(points: np.ndarray, patches: list[Patch], spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """`points` (n, dim) moved to where all `patches` meet, and how far they still are from it, (n,) [m]."""
    points = points.copy()
    for _ in range(STEPS):
        found = [patch.surface.height(points) for patch in patches]
        points += limited(least_motion(np.stack([h for h, _ in found], 1), np.stack([g for _, g in found], 1)), spacing)
    return points, np.max([np.abs(patch.surface.height(points)[0]) for patch in patches], axis=0)


def onto_seam(first: Patch, second: Patch, points: np.ndarray) -> np.ndarray:
    """`points` (n, dim) in the plane of two patches moved to their common border: to one and to the other in turns, which
    is exact where the border is straight and they lie on either side of it."""
    for patch in (first, second, first, second):
        points = patch.surface.nearest(points)
    return points


def limited(moves: np.ndarray, spacing: float) -> np.ndarray:
    """Moves (n, dim), none longer than half a spacing."""
    length = np.linalg.norm(moves, axis=1, keepdims=True)
    return moves * (FARTHEST * spacing / np.maximum(length, FARTHEST * spacing))


class Projection:
    """The motion of nodes onto their patches.

    `labels` (n, patches) bool: a node lies on all patches that it is labelled with, and on the border of those that
    `seams` name, pairs in one plane. Of every patch the heights are found at its own nodes alone.
    """

    def __init__(
        self, labels: np.ndarray, patches: tuple[Patch, ...], spacing: float, seams: list[tuple[int, int]]
    ) -> None:
        pairs = [(patches[a], patches[b], np.flatnonzero(labels[:, a] & labels[:, b])) for a, b in seams]
        self._seams = [(first, second, rows) for first, second, rows in pairs if len(rows)]
        self._patches, self._spacing = patches, spacing
        count = labels.sum(1)
        slot = np.cumsum(labels, axis=1) - 1
        self._groups: list[tuple[np.ndarray, list[tuple[int, np.ndarray, np.ndarray]]]] = []
        # Most nodes have one label: they need no equations.
        for several in (False, True):
            rows = np.flatnonzero((count > 1) if several else (count == 1))
            parts = [(k, np.flatnonzero(labels[rows, k]), slot[rows, k]) for k in range(len(patches))]
            if len(rows):
                self._groups.append((rows, [(k, on, at[on]) for k, on, at in parts if len(on)]))

    def onto(self, points: np.ndarray, steps: int = STEPS) -> None:
        """Move `points` (n, dim) in place."""
        for rows, parts in self._groups:
            for _ in range(steps):
                heights, gradients = self._state(points[rows], parts)
                points[rows] += limited(least_motion(heights, gradients), self._spacing)
        for first, second, rows in self._seams:
            points[rows] = onto_seam(first, second, points[rows])

    def missed(self, points: np.ndarray) -> np.ndarray:
        """How far `points` (n, dim) are from the patches that they are labelled with, (n,) [m]."""
        far = np.zeros(len(points))
        for rows, parts in self._groups:
            far[rows] = np.abs(self._state(points[rows], parts)[0]).max(1)
        return far

    def along(self, points: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """`vectors` (n, dim) without their parts across the patches at `points` (n, dim)."""
        vectors = vectors.copy()
        for rows, parts in self._groups:
            _, gradients = self._state(points[rows], parts)
            vectors[rows] += least_motion(np.einsum("nkd,nd->nk", gradients, vectors[rows]), gradients)
        return vectors

    def _state(
        self, points: np.ndarray, parts: list[tuple[int, np.ndarray, np.ndarray]]
    ) -> tuple[np.ndarray, np.ndarray]:
        most = 1 + max(int(at.max()) for _, _, at in parts)
        heights, gradients = np.zeros((len(points), most)), np.zeros((len(points), most, points.shape[1]))
        for k, on, at in parts:
            heights[on, at], gradients[on, at] = self._patches[k].surface.height(points[on])
        return heights, gradients
