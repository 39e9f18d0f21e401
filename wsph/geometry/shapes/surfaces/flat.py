"""Flat surfaces: sides of boxes and polygons, ends of cylinders."""

# pyright: strict

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Facet:
    """A point, a segment or a rectangle: from a `corner` (dim,) [m] along `sides` (dim - 1, dim) [m] at right angles."""

    corner: np.ndarray
    sides: np.ndarray
    normal: np.ndarray

    @cached_property
    def _duals(self) -> np.ndarray:
        return (self.sides / (self.sides**2).sum(1, keepdims=True)).T

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (points - self.corner) @ self.normal, np.broadcast_to(self.normal, points.shape)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        along = (points - self.corner) @ self._duals
        return self.corner + np.clip(along, 0.0, 1.0) @ self.sides

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        lengths = np.linalg.norm(self.sides, axis=1)
        counts = np.maximum(np.ceil(lengths / spacing), 1.0).astype(int)
        index = np.indices(tuple(counts)).reshape(len(counts), int(counts.prod()))
        along = (index.T + 0.5) / counts
        return self.corner + along @ self.sides, np.full(len(along), lengths.prod() / len(along))


@dataclass(frozen=True)
class Plate:
    """A flat disc about `center` (3,) [m] with its `radius` [m] (3D)."""

    center: np.ndarray
    normal: np.ndarray
    radius: float

    @cached_property
    def _across(self) -> np.ndarray:
        return across(self.normal)

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (points - self.center) @ self.normal, np.broadcast_to(self.normal, points.shape)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        off = points - self.center
        off = off - np.outer(off @ self.normal, self.normal)
        length = np.linalg.norm(off, axis=1, keepdims=True)
        return self.center + off * (self.radius / np.maximum(length, self.radius))

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        rings = max(int(np.ceil(self.radius / spacing)), 1)
        count = np.maximum(np.ceil(2.0 * np.pi * (np.arange(rings) + 0.5)), 6.0).astype(int)
        ring = np.repeat(np.arange(rings), count)
        angle = 2.0 * np.pi * (np.arange(len(ring)) - np.repeat(np.cumsum(count) - count, count)) / count[ring]
        way = np.stack([np.cos(angle), np.sin(angle)], 1) @ self._across
        step = self.radius / rings
        areas = np.pi * step**2 * (2.0 * ring + 1.0) / count[ring]
        return self.center + ((ring + 0.5) * step)[:, None] * way, areas


def across(direction: np.ndarray) -> np.ndarray:
    """Two unit vectors at right angles to a unit vector and to each other, (2, 3)."""
    least = np.eye(3)[np.abs(direction).argmin()]
    first = np.cross(direction, least)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])
