"""Flat patches too small for the spacing, joined to those beside them that they meet at a blunt angle.

A polygon may follow a curve by many short sides: none of them has a cell of its own, but together they are a surface.
"""

# pyright: strict

from dataclasses import dataclass, replace

import numpy as np

from wsph.geometry.connected import connected
from wsph.geometry.fitted.junctions import Junction
from wsph.geometry.fitted.outline import Outline
from wsph.geometry.shapes.surfaces.surface import Patch

SHORT = 2.0
"""Size of a patch, in spacings, below which it is joined to its neighbours."""


@dataclass(frozen=True)
class Chain:
    """The surface of flat patches beside each other: that of the nearest one, wherever a point is."""

    parts: tuple[Patch, ...]

    @property
    def normal(self) -> None:
        return None

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        height, gradient = np.zeros(len(points)), np.zeros(points.shape)
        for k, rows in self._rows(points):
            height[rows], gradient[rows] = self.parts[k].surface.height(points[rows])
        return height, gradient

    def nearest(self, points: np.ndarray) -> np.ndarray:
        found = np.zeros(points.shape)
        for k, rows in self._rows(points):
            found[rows] = self.parts[k].surface.nearest(points[rows])
        return found

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        each = [part.surface.samples(spacing) for part in self.parts]
        return np.concatenate([points for points, _ in each]), np.concatenate([areas for _, areas in each])

    def part(self, points: np.ndarray) -> np.ndarray:
        """The nearest of the parts, (n,) int."""
        apart = [((points - part.surface.nearest(points)) ** 2).sum(1) for part in self.parts]
        return np.asarray(np.argmin(apart, axis=0), int)

    def _rows(self, points: np.ndarray) -> list[tuple[int, np.ndarray]]:
        part = self.part(points)
        return [(int(k), np.flatnonzero(part == k)) for k in np.unique(part)]


def joined(body: Outline, edges: list[Junction]) -> tuple[Outline, list[Junction]]:
    """The body with chains in the place of patches that are too small, and the edges that are left."""
    flat = [patch.surface.normal is not None for patch in body.patches]
    pairs = [(e.first, e.second) for e in edges if e.blunt and flat[e.first] and flat[e.second]]
    first, second = np.reshape(pairs, (-1, 2)).astype(int).T
    joins = np.zeros(len(first), bool)
    # Small ones with each other; then what is still small with the large ones beside it, so that those keep their borders.
    for together in (np.logical_and, np.logical_or):
        group = connected(first[joins], second[joins], len(body.patches))
        size = np.bincount(group, body.areas)[group] ** (1.0 / (body.shape.dim - 1))
        small = size < SHORT * body.spacing
        joins |= together(small[first], small[second])
    if not joins.any():
        return body, edges
    group = connected(first[joins], second[joins], len(body.patches))
    rows = [np.flatnonzero(group == k) for k in range(int(group.max()) + 1)]
    whole = Outline(
        body.shape,
        body.spacing,
        tuple(_one([body.patches[i] for i in ids]) for ids in rows),
        tuple(np.concatenate([body.points[i] for i in ids]) for ids in rows),
        tuple(np.concatenate([body.normals[i] for i in ids]) for ids in rows),
        tuple(np.concatenate([body.shares[i] for i in ids]) for ids in rows),
        tuple(max(body.steps[i] for i in ids) for ids in rows),
        tuple(all(body.whole[i] for i in ids) for ids in rows),
    )
    left: list[Junction] = []
    for edge in edges:
        ends = sorted((int(group[edge.first]), int(group[edge.second])))
        if ends[0] != ends[1]:
            seam = edge.seam and all(len(rows[end]) == 1 for end in ends)
            left.append(replace(edge, first=ends[0], second=ends[1], seam=seam))
    return whole, left


def _one(patches: list[Patch]) -> Patch:
    if len(patches) == 1:
        return patches[0]
    return Patch(f"{patches[0].name}, ... {patches[-1].name}", Chain(tuple(patches)))


def side_names(body: Outline, label: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """The patches of sides of a `label` (m,), of a chain by their `centres` (m, dim) [m]: indices (m,), and the names."""
    number, names = np.zeros(len(label), int), list[str]()
    for k, patch in enumerate(body.patches):
        rows = np.flatnonzero(label == k)
        parts = patch.surface.parts if isinstance(patch.surface, Chain) else (patch,)
        nearest = patch.surface.part(centres[rows]) if isinstance(patch.surface, Chain) else np.zeros(len(rows), int)
        for part in np.unique(nearest):
            name = parts[int(part)].name
            if name not in names:
                names.append(name)
            number[rows[nearest == part]] = names.index(name)
    return number, tuple(names)
