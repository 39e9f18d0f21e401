"""A cylinder."""

# pyright: strict

from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape, Edges, check_coordinates
from wsph.geometry.shapes.surfaces.flat import Plate
from wsph.geometry.shapes.surfaces.round import Mantle
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.quantities import Point, Positive


class Cylinder(BaseShape):
    """A round bar with its ends' centres at `from` and `to` (3D)."""

    model_config = example({"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 0.0, "30 mm"], "radius": "4 mm"})
    type: Literal["cylinder"] = "cylinder"
    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    radius: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Cylinder":
        check_coordinates(self, (self.start, self.end), 3)
        if self.start == self.end:
            raise ValueError("from and to are the same point")
        return self

    @property
    def dim(self) -> int:
        return 3

    def _along(self) -> tuple[np.ndarray, np.ndarray, float]:
        start, way = np.array(self.start), np.array(self.end) - np.array(self.start)
        length = float(np.linalg.norm(way))
        return start, way / length, length

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        start, direction, _ = self._along()
        reach = self.radius * np.sqrt(np.maximum(1.0 - direction**2, 0.0))
        end = np.array(self.end)
        return np.minimum(start, end) - reach, np.maximum(start, end) + reach

    def edges(self) -> Edges:
        _, direction, _ = self._along()
        ends = np.sort([self.start, self.end], axis=0)
        return [ends[:, k] if abs(direction[k]) == 1.0 else np.zeros(0) for k in range(3)]

    def holds(self, points: np.ndarray) -> np.ndarray:
        start, direction, length = self._along()
        r = points - start
        along = r @ direction
        return (
            (along >= 0.0) & (along <= length) & (np.linalg.norm(r - np.outer(along, direction), axis=1) <= self.radius)
        )

    def surfaces(self) -> tuple[Patch, ...]:
        start, direction, length = self._along()
        return (
            Patch("from", Plate(start, -direction, self.radius)),
            Patch("to", Plate(np.array(self.end), direction, self.radius)),
            Patch("mantle", Mantle(start, direction, length, self.radius), main=True),
        )
