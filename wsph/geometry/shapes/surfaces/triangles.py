"""Surfaces made of triangles."""

# pyright: strict

from functools import cached_property

import numpy as np

from wsph.geometry.shapes.surfaces.queries import Queries

FLAT = 1e-6
"""Of the cosine between two normals: triangles that are that near to one plane are flat."""


class Triangles:
    """A piece of surface: `faces` (f, 3) of `vertices` (v, 3) [m], counter-clockwise as seen from outside.

    Its height is that over the plane of the nearest triangle, which goes on past the border. Which triangle that is is asked
    in single precision; all else is worked out in double.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        used, index = np.unique(faces, return_inverse=True)
        self._vertices, self._faces = vertices[used], index.reshape(faces.shape)
        self._corners = vertices[faces]
        vectors = area_vectors(self._corners)
        self.areas = np.linalg.norm(vectors, axis=1)
        """Areas of the triangles (f,) [m^2]."""
        self._normals = vectors / self.areas[:, None]
        mean = vectors.sum(0)
        mean /= max(float(np.linalg.norm(mean)), 1e-300)
        self.normal: np.ndarray | None = mean if bool((self._normals @ mean > 1.0 - FLAT).all()) else None

    @cached_property
    def _queries(self) -> Queries:
        return Queries(self._vertices, self._faces, winding=False)

    @cached_property
    def _place(self) -> np.ndarray:
        return self.areas @ self._corners.mean(1) / self.areas.sum()

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.normal is not None:
            return (points - self._place) @ self.normal, np.broadcast_to(self.normal, points.shape)
        face = self._queries.nearest(points)
        return ((points - self._corners[face, 0]) * self._normals[face]).sum(1), self._normals[face]

    def nearest(self, points: np.ndarray) -> np.ndarray:
        face = self._queries.nearest(points)
        return _closest(points, self._corners[face], self._normals[face])

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        corners, areas = self._corners, self.areas
        done: list[tuple[np.ndarray, np.ndarray]] = []
        while len(corners):
            edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
            small = edges.max(1) <= 1.5 * spacing
            done.append((corners[small].mean(1), areas[small]))
            corners, areas, edges = corners[~small], areas[~small], edges[~small]
            # Halved across the longest edge, which is turned to be the first.
            turn = (edges.argmax(1)[:, None] + np.arange(3)) % 3
            a, b, c = (corners[np.arange(len(corners)), turn[:, k]] for k in range(3))
            middle = 0.5 * (a + b)
            corners = np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])
            areas = np.tile(0.5 * areas, 2)
        return np.concatenate([points for points, _ in done]), np.concatenate([area for _, area in done])


def area_vectors(corners: np.ndarray) -> np.ndarray:
    """Outward area vectors (f, 3) [m^2] of triangles (f, 3, 3) [m]."""
    return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _closest(points: np.ndarray, corners: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The points of triangles (n, 3, 3), each with its unit normal (n, 3), nearest to points (n, 3)."""
    foot = points - ((points - corners[:, 0]) * normals).sum(1)[:, None] * normals
    within, found, least = np.ones(len(points), bool), np.empty_like(foot), np.full(len(points), np.inf)
    for k in range(3):
        start, way = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        within &= (np.cross(way, foot - start) * normals).sum(1) >= 0.0
        along = np.clip(((points - start) * way).sum(1) / (way**2).sum(1), 0.0, 1.0)
        on = start + along[:, None] * way
        apart = ((points - on) ** 2).sum(1)
        nearer = apart < least
        found[nearer], least[nearer] = on[nearer], apart[nearer]
    found[within] = foot[within]
    return found
