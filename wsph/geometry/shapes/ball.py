"""A disc or a sphere."""

# pyright: strict

from typing import Literal

import numpy as np
from pydantic import model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape, check_coordinates
from wsph.geometry.shapes.surfaces.round import Sphere
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.quantities import Point, Positive, Table, is_sequence


class Ball(BaseShape):
    """A disc (2D) or a sphere (3D) about `center`."""

    model_config = example({"type": "disc", "center": [0.0, 0.0], "radius": "10 mm"})
    type: Literal["disc", "sphere"] = "sphere"
    center: Point
    radius: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Ball":
        check_coordinates(self, (self.center,), self.dim)
        return self

    @classmethod
    def own_type(cls, given: Table) -> str:
        center = given.get("center")
        return "disc" if is_sequence(center) and len(center) == 2 else "sphere"

    @property
    def dim(self) -> int:
        return 2 if self.type == "disc" else 3

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.center) - self.radius, np.array(self.center) + self.radius

    def holds(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - np.array(self.center), axis=1) <= self.radius

    def surfaces(self) -> tuple[Patch, ...]:
        return (Patch(self.type, Sphere(np.array(self.center), self.radius), main=True),)
