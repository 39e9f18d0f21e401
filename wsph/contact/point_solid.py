"""Which points lie inside of a body of particles alone: nearer to one of them than half a spacing."""

# pyright: strict

import numpy as np

from wsph.backend.domain import anywhere
from wsph.geometry.meshes.scattered import Scattered
from wsph.sph.pairs import find_pairs


class PointSolid:
    """A body of particles as something that takes up room."""

    at_nodes = False

    def __init__(self, geometry: Scattered):
        self.geometry = geometry
        self.domain, self.share = geometry.split.domain, geometry.split.nodes

    @property
    def places(self) -> np.ndarray:
        """Of its particles here at the start, (n, dim) [m]."""
        return self.geometry.nodes

    def inside(self, points: np.ndarray, places: np.ndarray, depth: float) -> np.ndarray:
        """Which points (k, dim) [m], the same in all processes, lie inside where the particles here are at `places` (n, dim)
        [m], `depth` [spacings] below the surface, which is half a spacing around them, (k,) bool."""
        found = np.zeros(len(points), bool)
        reach, unit = 0.5 * (1.0 - depth), self.geometry.spacing
        if reach > 0.0:
            found[find_pairs(points / unit, places[self.share.own] / unit, reach).rows()] = True
        return anywhere(self.domain, found)
