"""A ring."""

# pyright: strict

from typing import Literal

import numpy as np
from pydantic import model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape, check_coordinates
from wsph.geometry.shapes.surfaces.round import Sphere
from wsph.geometry.shapes.surfaces.surface import Patch, placed
from wsph.quantities import Point, Positive


class Ring(BaseShape):
    """The area between two circles about `center` (2D)."""

    model_config = example({"type": "ring", "center": [0.0, 0.0], "inner": "30 mm", "outer": "40 mm"})
    type: Literal["ring"] = "ring"
    center: Point
    inner: Positive
    outer: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Ring":
        check_coordinates(self, (self.center,), 2)
        if self.inner >= self.outer:
            raise ValueError(f"inner {self.inner:g} m must lie below outer {self.outer:g} m")
        return self

    @property
    def dim(self) -> int:
        return 2

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.center) - self.outer, np.array(self.center) + self.outer

    def holds(self, points: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(points - np.array(self.center), axis=1)
        return (distance >= self.inner) & (distance <= self.outer)

    def surfaces(self) -> tuple[Patch, ...]:
        center = np.array(self.center)
        hole = (Patch("inner", Sphere(center, self.inner)),)
        return (*placed(hole, center, np.eye(2), -1.0), Patch("outer", Sphere(center, self.outer)))
