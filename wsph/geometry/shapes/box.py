"""A box."""

# pyright: strict

from typing import Literal

import numpy as np
from pydantic import model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape, Edges
from wsph.geometry.shapes.surfaces.flat import Facet
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.quantities import Point


class Box(BaseShape):
    """An axis-parallel box (a segment in 1D, a rectangle in 2D) from corner `min` to corner `max`."""

    model_config = example({"type": "box", "min": [0.0, 0.0], "max": ["100 mm", "20 mm"]})
    type: Literal["box"] = "box"
    min: Point
    max: Point

    @model_validator(mode="after")
    def _ordered(self) -> "Box":
        if len(self.min) != len(self.max):
            raise ValueError(f"min has {len(self.min)} coordinates and max {len(self.max)}")
        if any(a >= b for a, b in zip(self.min, self.max, strict=True)):
            raise ValueError(f"min {list(self.min)} must lie below max {list(self.max)} on every axis")
        return self

    @property
    def dim(self) -> int:
        return len(self.min)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.min), np.array(self.max)

    def edges(self) -> Edges:
        return [np.array(pair) for pair in zip(self.min, self.max, strict=True)]

    def holds(self, points: np.ndarray) -> np.ndarray:
        low, high = self.bounds()
        return np.all((points >= low) & (points <= high), axis=1)

    def surfaces(self) -> tuple[Patch, ...]:
        low, high = self.bounds()
        found: list[Patch] = []
        for axis in range(self.dim):
            normal = np.eye(self.dim)[axis]
            sides = np.delete(np.diag(high - low), axis, 0)
            found.append(Patch(f"-{'xyz'[axis]}", Facet(low, sides, -normal)))
            found.append(Patch(f"+{'xyz'[axis]}", Facet(np.where(normal == 1.0, high, low), sides, normal)))
        return tuple(found)
