"""A closed surface of triangles, and its pieces between sharp edges."""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wsph.geometry.connected import connected
from wsph.geometry.shapes.surfaces.queries import Queries
from wsph.geometry.shapes.surfaces.triangles import Triangles, area_vectors
from wsph.units import rounded

ALIKE = 1e-6
"""Distance of corners that are the same, as a part of the size."""

GAP = 0.01
"""Part of the area that may be missing; it is filled."""


@dataclass(frozen=True)
class Triangulation:
    """`vertices` (v, 3) [m], `faces` (f, 3) counter-clockwise as seen from outside, `segment` (f,) the piece of surface that
    a face belongs to, the largest is 0."""

    vertices: np.ndarray
    faces: np.ndarray
    segment: np.ndarray

    @cached_property
    def surfaces(self) -> tuple[Triangles, ...]:
        """The pieces, the largest first."""
        return tuple(Triangles(self.vertices, self.faces[self.segment == k]) for k in range(self.segment.max() + 1))

    @cached_property
    def queries(self) -> Queries:
        """What the whole is asked for whether points are inside."""
        return Queries(self.vertices, self.faces, winding=True)


def triangulate(corners: np.ndarray, angle: float) -> Triangulation:
    """The surface of triangles (f, 3, 3) [m], parted at edges where the normals of its two triangles turn by `angle`
    [degrees] or more.

    Corners at one place become one, gaps of up to 1 % of the area are filled. Raises ValueError for a surface that is not
    closed (with how much is open, and where), whose triangles are not oriented alike, or that has no volume.
    """
    vertices, faces = _merged(corners)
    vertices, faces = _closed(vertices, faces)
    size = float(np.ptp(vertices, axis=0).max())
    faces = faces[np.linalg.norm(area_vectors(vertices[faces]), axis=1) > ALIKE**2 * size**2]
    # About the middle: far from the origin the digits of the volume would be lost.
    about = vertices[faces] - vertices.mean(0)
    volume = float((area_vectors(about) * about[:, 0]).sum()) / 3.0
    if abs(volume) < ALIKE * size**3:
        raise ValueError("has no volume")
    if volume < 0.0:
        faces = faces[:, ::-1]
    return Triangulation(vertices, faces, _segments(vertices, faces, angle))


def _merged(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = corners.reshape(-1, 3)
    size = max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max()))
    if size == 0.0:
        raise ValueError("has all its corners in one point")
    _, first, index = np.unique(np.rint(points / (ALIKE * size)), axis=0, return_index=True, return_inverse=True)
    faces = index.reshape(-1, 3)
    same = (faces == np.roll(faces, 1, axis=1)).any(1)
    return points[first], faces[~same]


def _closed(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface with small gaps filled by triangles about their middles."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end).astype(np.int64) * len(vertices) + np.maximum(start, end)
    edges, where = np.unique(key, return_inverse=True)
    forth = np.bincount(where.ravel(), np.where(start < end, 1.0, -1.0), len(edges))
    if (np.abs(forth) > 1.0).any():
        wrong = np.flatnonzero(np.abs(forth) > 1.0)
        raise ValueError(
            f"has triangles that are not oriented alike: along {len(wrong)} edges both go the same way, one at "
            f"{rounded(vertices[edges[wrong[0]] // len(vertices)])} m"
        )
    low, high = edges // len(vertices), edges % len(vertices)
    open_ = np.flatnonzero(forth != 0.0)
    if not len(open_):
        return vertices, faces
    # An open edge is run through once; what is missing there runs through it the other way.
    a = np.where(forth > 0.0, high, low)[open_]
    b = np.where(forth > 0.0, low, high)[open_]
    _, ends = np.unique(np.concatenate([a, b]), return_inverse=True)
    gap = connected(ends[: len(a)], ends[len(a) :], int(ends.max()) + 1)[ends[: len(a)]]
    middle = np.stack([np.bincount(gap, vertices[a, k]) for k in range(3)], 1) / np.bincount(gap)[:, None]
    missing = area_vectors(np.stack([vertices[a], vertices[b], middle[gap]], 1))
    areas = np.linalg.norm([np.bincount(gap, missing[:, k]) for k in range(3)], axis=0)
    total = float(np.linalg.norm(area_vectors(vertices[faces]), axis=1).sum())
    if areas.sum() > GAP * total or np.bincount(gap).min() < 3:
        raise ValueError(
            f"is not closed: {len(open_)} edges have a triangle on one side alone, about {areas.sum() / total:.2g} of the "
            f"area is missing, most of it near {rounded(middle[areas.argmax()])} m; repair it where it was made"
        )
    filled = np.stack([a, b, len(vertices) + gap], 1)
    return np.concatenate([vertices, middle]), np.concatenate([faces, filled])


def _segments(vertices: np.ndarray, faces: np.ndarray, angle: float) -> np.ndarray:
    """The piece of every face: the largest is 0, of equal ones the one whose middle comes first along the axes."""
    vectors = area_vectors(vertices[faces])
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / areas[:, None]
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    key = np.minimum(start, end).astype(np.int64) * len(vertices) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order][1:] == key[order][:-1])
    first, second = order[pair] // 3, order[pair + 1] // 3
    smooth = (normals[first] * normals[second]).sum(1) > np.cos(np.radians(angle))
    part = connected(first[smooth], second[smooth], len(faces))
    area = np.bincount(part, areas)
    middle = [np.bincount(part, areas * vertices[faces].mean(1)[:, k]) / area for k in range(3)]
    size = float(np.ptp(vertices, axis=0).max())
    rank = np.lexsort([*(np.round(m / (ALIKE * size)) for m in reversed(middle)), -np.round(area / (ALIKE * size**2))])
    place = np.empty(len(rank), int)
    place[rank] = np.arange(len(rank))
    return place[part]
