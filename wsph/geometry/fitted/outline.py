"""The surface of a shape: what of its patches lies on it, with areas, volume and distances.

Patches of a union reach into its other shapes, those of a difference beyond what they cut. What of them is on the surface is
asked of the shape itself: it is inside just below, and not just above.
"""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.fitted.nearby import nearest_distance
from wsph.geometry.shapes.combined import Shape
from wsph.geometry.shapes.surfaces.surface import Patch

OFF = 1e-3
"""Height above and below the surface, in spacings, at which a shape is asked."""

SAME = 1e-6
"""Distance, in spacings, below which surfaces lie in each other."""

MOST = 4e6
"""Samples of an outline, at most, where it is no more than looked at."""

SAMPLES = 20
"""Samples along a patch, at least."""


@dataclass(frozen=True)
class Outline:
    """The surface of `shape` for a `spacing` [m].

    `patches` are those that have a part on the surface. Of each: `points` (m, dim) [m] all over that part, their outward
    `normals` (m, dim) and `shares` (m,) of its area [m^(dim-1)], their distance `step` [m], and whether it is `whole`: none
    of it is off the surface.
    """

    shape: Shape
    spacing: float
    patches: tuple[Patch, ...]
    points: tuple[np.ndarray, ...]
    normals: tuple[np.ndarray, ...]
    shares: tuple[np.ndarray, ...]
    steps: tuple[float, ...]
    whole: tuple[bool, ...]

    @property
    def areas(self) -> np.ndarray:
        """Areas of the patches, (patches,) [m^(dim-1)]."""
        return np.array([share.sum() for share in self.shares])

    @property
    def volume(self) -> float:
        """The volume [m^dim], by the divergence theorem about the middle: what samples miss of a surface counts by its
        distance from there."""
        middle = self.shape.middle
        total = sum(
            float((share[:, None] * (points - middle) * normals).sum())
            for share, points, normals in zip(self.shares, self.points, self.normals, strict=True)
        )
        return total / self.shape.dim

    def place(self, point: np.ndarray) -> str:
        """A position (dim,) [m], given before the rotation of the shape, as messages tell it, after the rotation."""
        there = self.shape.middle + self.shape.axes @ (point - self.shape.middle)
        # To a hundredth of a spacing, however far from the origin.
        digits = 2 - int(np.floor(np.log10(self.spacing)))
        return f"{[round(float(x), digits) + 0.0 for x in there]} m"

    def distance(self, patch: int, points: np.ndarray, reach: float) -> np.ndarray:
        """Distances (n,) [m] of `points` (n, dim) to the part of a patch on the surface, perhaps infinite beyond `reach`
        [m]."""
        surface = self.patches[patch].surface
        nearest = surface.nearest(points)
        distance = np.linalg.norm(points - nearest, axis=1)
        close = np.flatnonzero(distance <= reach)
        if self.whole[patch] or not len(close):
            return distance
        on = on_surface(self.shape, nearest[close], surface.height(nearest[close])[1], OFF * self.spacing)
        off = close[~on]
        distance[off] = nearest_distance(self.points[patch], points[off], reach)
        return distance


def on_surface(shape: Shape, points: np.ndarray, normals: np.ndarray, off: float) -> np.ndarray:
    """Which points (n, dim) [m] with outward normals (n, dim) lie on the surface of the shape before its rotation, (n,)
    bool."""
    inside = shape.holds(points - off * normals)
    inside[inside] = ~shape.holds(points[inside] + off * normals[inside])
    return inside


def too_fine(shape: Shape, spacing: float) -> bool:
    """Whether an outline of a shape would have more than `MOST` samples: of a patch that is far larger than the body."""
    low, high = shape.bounds()
    far = 1e3 * float((high - low).max())
    area = sum(float(patch.surface.samples(far)[1].sum()) for patch in shape.patches())
    return area > MOST * (0.5 * spacing) ** (shape.dim - 1)


def outline(shape: Shape, spacing: float) -> Outline:
    """The surface of a shape, sampled at half a spacing [m] and finer on small patches."""
    patches: list[Patch] = []
    points: list[np.ndarray] = []
    normals: list[np.ndarray] = []
    shares: list[np.ndarray] = []
    steps: list[float] = []
    whole: list[bool] = []
    for patch in shape.patches():
        area = float(patch.surface.samples(spacing)[1].sum())
        step = min(0.5 * spacing, area ** (1.0 / max(shape.dim - 1, 1)) / SAMPLES)
        found, share = patch.surface.samples(step)
        normal = np.array(patch.surface.height(found)[1])
        on = on_surface(shape, found, normal, OFF * spacing)
        for other, known in zip(patches, points, strict=True):
            # Of two surfaces in each other the first has what they share.
            if (found.min(0) > known.max(0) + spacing).any() or (found.max(0) < known.min(0) - spacing).any():
                continue
            rows = np.flatnonzero(on)
            height, gradient = other.surface.height(found[rows])
            rows = rows[(np.abs(height) <= SAME * spacing) & ((gradient * normal[rows]).sum(1) > 0.99)]
            there = np.linalg.norm(found[rows] - other.surface.nearest(found[rows]), axis=1) <= SAME * spacing
            on[rows[there]] = False
        if on.any():
            patches.append(patch)
            points.append(found[on])
            normals.append(normal[on])
            shares.append(share[on])
            steps.append(step)
            whole.append(bool(on.all()))
    return Outline(
        shape, spacing, tuple(patches), tuple(points), tuple(normals), tuple(shares), tuple(steps), tuple(whole)
    )
