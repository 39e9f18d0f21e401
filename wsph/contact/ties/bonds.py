"""Where two surfaces are glued: which vertices of one to which points on the faces of the other, found once."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.contact.surfaces.meshing.mesh import SurfaceMesh
from wsph.sph.pairs import find_pairs

NEAR, ASIDE = 0.5, 0.25
"""Distance [spacings] from which a vertex is glued to a face, and how much of it may lie along the face: a vertex beside the
edge of the other surface has nothing to be glued to."""

FACING = -0.5
"""Cosine between the normals of two faces that look at each other."""

FLAT = 1e-9
"""Area [spacings] of a face that is none."""


@dataclass(frozen=True)
class Bonds:
    """k vertices of one surface, each glued to a point of a face of another one, in the reference configuration [m].

    vertex   # ascending, (k,)
    corners  # vertices of the face, (k, dim)
    weights  # of the point, at the corners, (k, dim)
    gap      # from the point to the vertex, in the frame of the face (`frames`), (k, dim)
    area     # that the vertex stands for: of the faces around it that look at the face, (k,)
    turning  # what a corner's motion across its edge turns the gap by, over that motion, the sum of all corners, (k,)
    """

    vertex: np.ndarray
    corners: np.ndarray
    weights: np.ndarray
    gap: np.ndarray
    area: np.ndarray
    turning: np.ndarray

    @property
    def count(self) -> int:
        """Their number."""
        return len(self.vertex)

    def answers(self, here: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The other way round: vertices that are corners of any (r,), of those that are `here` (vertices,) bool, where those
        of each begin (r + 1,), and which corners they are, counted through all bonds."""
        at = self.corners.ravel()
        order = np.argsort(at, kind="stable")
        order = order[here[at[order]]]
        which, first = np.unique(at[order], return_index=True)
        return which, np.append(first, len(order)), order


def bonds_between(own: SurfaceMesh, other: SurfaceMesh, spacing: float) -> Bonds:
    """The bonds of vertices of `own` to faces of `other`; `spacing` [m] is the larger of both."""
    dim = own.X.shape[1]
    ends = other.X[other.faces]
    middle = ends.mean(1)
    reach = NEAR * spacing + float(np.linalg.norm(ends - middle[:, None], axis=2).max())
    pairs = find_pairs(own.X / spacing, middle / spacing, reach / spacing)
    row: np.ndarray = pairs.rows()
    column = np.array(pairs.indices.numpy(), np.int64)
    there = other.A[column] > FLAT * spacing ** (dim - 1)
    i, f = row[there], column[there]
    weights = nearest_weights(own.X[i], ends[f])
    away = own.X[i] - np.einsum("kc,kca->ka", weights, ends[f])
    distance = np.linalg.norm(away, axis=1)
    across = np.einsum("ka,ka->k", away, other.N[f])
    aside = np.linalg.norm(away - across[:, None] * other.N[f], axis=1)
    area = facing_area(own, i, other.N[f])
    fits = (distance <= NEAR * spacing) & (aside <= ASIDE * spacing) & (area > 0.0)
    at = np.flatnonzero(fits)
    # Of faces as near as each other the first: rounding of the distance is not to choose.
    rounded = (distance[at] / (1e-6 * spacing)).round()
    order = at[np.lexsort((f[at], rounded, i[at]))]
    chosen = order[np.unique(i[order], return_index=True)[1]]
    corners = other.faces[f[chosen]]
    axes, slopes = frames(other.X[corners])
    gap = np.einsum("kax,ka->kx", axes, away[chosen])
    gap[distance[chosen] < 1e-9 * spacing] = 0.0
    turning = np.linalg.norm(gap, axis=1) * np.linalg.norm(slopes, axis=2).sum(1)
    return Bonds(i[chosen], corners, weights[chosen].reshape(-1, dim), gap, area[chosen], turning)


def facing_area(mesh: SurfaceMesh, vertex: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The area that each `vertex` (k,) stands for of the faces around it that look against `normal` (k, dim), (k,)."""
    count = np.diff(mesh.starts)[vertex]
    whose = np.repeat(np.arange(len(vertex)), count)
    where = np.arange(len(whose)) + np.repeat(mesh.starts[vertex] - (np.cumsum(count) - count), count)
    face = mesh.around[where]
    looks = np.einsum("ka,ka->k", mesh.N[face], normal[whose]) < FACING
    return np.bincount(whose, mesh.A[face] * looks, len(vertex)) / mesh.faces.shape[1]


def frames(ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes of faces with corners `ends` (k, corners, dim), in columns (k, dim, dim): the first edge, what is across it in
    the face, the outward normal; and the slopes of the corners' weights along the face, (k, corners, dim)."""
    k, corners, dim = ends.shape
    if corners == 1:
        return np.ones((k, 1, 1)), np.zeros((k, 1, 1))
    edge = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(edge, axis=1, keepdims=True)
    along = edge / length
    if corners == 2:
        slope = along / length
        return np.stack([along, np.stack([along[:, 1], -along[:, 0]], 1)], 2), np.stack([-slope, slope], 1)
    area = np.cross(edge, ends[:, 2] - ends[:, 0])
    size = np.linalg.norm(area, axis=1, keepdims=True)
    normal = area / size
    opposite = [ends[:, (c + 2) % 3] - ends[:, (c + 1) % 3] for c in range(3)]
    slopes = np.stack([np.cross(normal, way) / size for way in opposite], 1)
    return np.stack([along, np.cross(normal, along), normal], dim - 1), slopes


def nearest_weights(p: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Weights of the corners at the points of faces `ends` (k, corners, dim) that are nearest to places p (k, dim), (k,
    corners)."""
    k, corners, _ = ends.shape
    if corners == 1:
        return np.ones((k, 1))
    if corners == 2:
        return _on_segment(p, ends[:, 0], ends[:, 1])
    slopes = frames(ends)[1]
    inside = 1.0 / 3.0 + np.einsum("kca,ka->kc", slopes, p - ends.mean(1))
    best = np.where((inside >= 0.0).all(1), 0.0, np.inf)
    for c in range(3):
        one, two = c, (c + 1) % 3
        part = _on_segment(p, ends[:, one], ends[:, two])
        weights = np.zeros((k, 3))
        weights[:, one], weights[:, two] = part.T
        away = np.linalg.norm(p - np.einsum("kc,kca->ka", weights, ends), axis=1)
        nearer = away < best
        inside[nearer], best[nearer] = weights[nearer], away[nearer]
    return inside


def _on_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    along = b - a
    square = np.einsum("ka,ka->k", along, along)
    t = np.clip(np.einsum("ka,ka->k", p - a, along) / square, 0.0, 1.0)
    return np.stack([1.0 - t, t], 1)
