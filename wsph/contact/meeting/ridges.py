"""The sharp convex edges of a surface of triangles: where two of its faces meet in a ridge."""

# pyright: strict

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SMOOTH = 0.64
"""Faces whose normals' product is above this (within 50 degrees) are one smooth surface."""

STRAIGHT = 0.5
"""A ridge goes on in the edge whose direction times its own is above this (within 60 degrees), and ends where there is
none."""


@dataclass(frozen=True)
class Ridges:
    """The r edges, as rows of vertices and faces.

    line   # the vertex before it on the ridge, its two ends, and the vertex behind it, (r, 4); at an end of the ridge the
           # edge's own end in place of the one beyond it
    sides  # its two faces, (r, 2)
    """

    line: NDArray[np.int64]
    sides: NDArray[np.int64]

    @property
    def ends(self) -> NDArray[np.int64]:
        """The two ends of every edge, (r, 2)."""
        return self.line[:, 1:3]


def ridges(places: NDArray[np.float64], faces: NDArray[np.int64], normals: NDArray[np.float64]) -> Ridges:
    """Of a surface's vertices at `places` (n, 3), its `faces` (m, 3) and their `normals` (m, 3), in the reference
    configuration."""
    sides = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
    owner = np.tile(np.arange(len(faces)), 3)
    edges, which, number = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    begin = np.concatenate([[0], np.cumsum(number)])[:-1]
    # An edge of one face, or of more than two, is no ridge.
    two = np.flatnonzero(number == 2)
    pairs = np.stack([owner[order[begin[two]]], owner[order[begin[two] + 1]]], axis=1)
    one, other = pairs.T
    centre = places[faces].mean(1)
    sharp = (normals[one] * normals[other]).sum(1) < SMOOTH
    convex = ((centre[other] - centre[one]) * normals[one]).sum(1) < 0.0
    chosen = sharp & convex
    ends = edges[two[chosen]]
    return Ridges(_lines(places, ends), pairs[chosen])


def _lines(places: NDArray[np.float64], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """Every edge with the vertices that its ridge comes from and goes on to, (r, 4)."""
    line = np.column_stack([ends[:, 0], ends, ends[:, 1]])
    around: dict[int, list[int]] = {}
    for e, pair in enumerate(ends.tolist()):
        for v in pair:
            around.setdefault(v, []).append(e)
    for e in range(len(ends)):
        for at in (0, 1):
            v, from_ = ends[e, at], ends[e, 1 - at]
            way = _unit(places[v] - places[from_])
            best = STRAIGHT
            for k in around[int(v)]:
                if k != e:
                    to = ends[k, 0] if ends[k, 1] == v else ends[k, 1]
                    along = float(way @ _unit(places[to] - places[v]))
                    if along > best:
                        best = along
                        line[e, 3 * at] = to
    return line


def _unit(r: NDArray[np.float64]) -> NDArray[np.float64]:
    return r / np.linalg.norm(r)
