"""Round surfaces: circles and spheres, mantles of cylinders."""

# pyright: strict

from dataclasses import dataclass

import numpy as np

from wsph.geometry.shapes.surfaces.flat import across

FEWEST = 16
"""Samples around a circle, at least."""


def _unit(vectors: np.ndarray, default: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (n,) and directions (n, dim), one of its own where the length is nothing."""
    length = np.linalg.norm(vectors, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return length, np.where(length[:, None] > 0.0, vectors / length[:, None], default)


@dataclass(frozen=True)
class Sphere:
    """A circle (2D) or a sphere (3D) about `center` (dim,) [m] with its `radius` [m]."""

    center: np.ndarray
    radius: float

    @property
    def normal(self) -> None:
        return None

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        distance, way = _unit(points - self.center, np.eye(len(self.center))[0])
        return distance - self.radius, way

    def nearest(self, points: np.ndarray) -> np.ndarray:
        return self.center + self.radius * self.height(points)[1]

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        around = max(int(np.ceil(2.0 * np.pi * self.radius / spacing)), FEWEST)
        if len(self.center) == 2:
            angle = 2.0 * np.pi * (np.arange(around) + 0.5) / around
            way = np.stack([np.cos(angle), np.sin(angle)], 1)
            return self.center + self.radius * way, np.full(around, 2.0 * np.pi * self.radius / around)
        bands = max(around // 2, 1)
        ends = np.cos(np.pi * np.arange(bands + 1) / bands)
        polar = np.pi * (np.arange(bands) + 0.5) / bands
        count = np.maximum(np.ceil(around * np.sin(polar)), 4.0).astype(int)
        band = np.repeat(np.arange(bands), count)
        angle = 2.0 * np.pi * (np.arange(len(band)) - np.repeat(np.cumsum(count) - count, count)) / count[band]
        out = np.sin(polar)[band]
        way = np.stack([out * np.cos(angle), out * np.sin(angle), np.cos(polar)[band]], 1)
        areas = 2.0 * np.pi * self.radius**2 * (ends[:-1] - ends[1:])[band] / count[band]
        return self.center + self.radius * way, areas


@dataclass(frozen=True)
class Mantle:
    """The side of a cylinder from `start` (3,) [m] along `direction` (3,) over its `length` [m], with its `radius` [m]."""

    start: np.ndarray
    direction: np.ndarray
    length: float
    radius: float

    @property
    def normal(self) -> None:
        return None

    def _split(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        off = points - self.start
        along = off @ self.direction
        distance, way = _unit(off - np.outer(along, self.direction), across(self.direction)[0])
        return along, distance, way

    def height(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        _, distance, way = self._split(points)
        return distance - self.radius, way

    def nearest(self, points: np.ndarray) -> np.ndarray:
        along, _, way = self._split(points)
        return self.start + np.outer(np.clip(along, 0.0, self.length), self.direction) + self.radius * way

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        around = max(int(np.ceil(2.0 * np.pi * self.radius / spacing)), FEWEST)
        rows = max(int(np.ceil(self.length / spacing)), 1)
        angle = 2.0 * np.pi * (np.tile(np.arange(around), rows) + 0.5) / around
        along = np.repeat((np.arange(rows) + 0.5) / rows * self.length, around)
        way = np.stack([np.cos(angle), np.sin(angle)], 1) @ across(self.direction)
        points = self.start + np.outer(along, self.direction) + self.radius * way
        return points, np.full(len(points), 2.0 * np.pi * self.radius * self.length / len(points))
