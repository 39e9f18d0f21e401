"""Averages for frames of a body that processes share: they see farther than a process holds for its steps."""

# pyright: strict

import math
from collections.abc import Callable

import numpy as np

from wsph.geometry.geometry import Geometry
from wsph.sph.averages import farthest, outward_weights
from wsph.sph.weights import Weights


class Around:
    """The part of a body that a process has, with as much around it as averages see. All processes make it, and average,
    together."""

    def __init__(self, geometry: Geometry, support: float):
        """`support` in cells, as of `wsph.sph.averages.outward_weights`."""
        self._own = geometry.split
        (low, high), more = self._own.layers, math.ceil(farthest(support))
        wide = geometry.wider((low - more, high + more))
        self._wide, self._weights = wide.split, outward_weights(wide, support)
        self._halo = self._own.domain.halo(self._wide.points)

    def averaged(self, values: np.ndarray, average: Callable[[Weights, np.ndarray], np.ndarray]) -> np.ndarray:
        """Values (m, k) of the points here, averaged at the nodes here, (n, k)."""
        own, wide = self._own.points, self._wide.points
        around = np.zeros((wide.held, values.shape[1]))
        around[own.low - wide.first : own.high - wide.first] = values[own.own]
        self._halo.fill(around)
        first = self._own.nodes.first - self._wide.nodes.first
        return average(self._weights, around)[first : first + self._own.nodes.held]
