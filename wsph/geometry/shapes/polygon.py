"""A polygon."""

# pyright: strict

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from wsph.declarations import example
from wsph.geometry.shapes.shape import BaseShape, Edges, check_coordinates
from wsph.geometry.shapes.surfaces.flat import Facet
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.quantities import Point, as_tuple

FLAT = 1e-12
"""Part of the area around its points below which a polygon has none."""

INSIDE = 1e-9
"""Part of a side from its ends in which another touches it and does not cross it."""

AT_ONCE = 100_000
"""Points times sides that are looked at together."""


class Polygon(BaseShape):
    """The inside of a closed line through `points` in order, the last joined to the first (2D)."""

    model_config = example(
        {"type": "polygon", "points": [[0.0, 0.0], ["48 mm", "44 mm"], ["48 mm", "60 mm"], [0.0, "44 mm"]]}
    )
    type: Literal["polygon"] = "polygon"
    points: Annotated[tuple[Point, ...], BeforeValidator(as_tuple), Field(min_length=3)]

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Polygon":
        check_coordinates(self, self.points, 2)
        points = np.array(self.points)
        if crossing := _crossing(points):
            first, second = (f"side {k + 1} from {list(self.points[k])}" for k in crossing)
            raise ValueError(
                f"it crosses itself: {first} meets {second}; give its points in the order of a walk around it"
            )
        with np.errstate(all="ignore"):  # coordinates whose differences overflow are refused with the grid
            sides = np.ptp(points, axis=0)
            x, y = ((points - points.min(0)) / sides).T
            area = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        if (sides == 0.0).any() or area < FLAT:
            raise ValueError("its points enclose no area")
        return self

    @property
    def dim(self) -> int:
        return 2

    def _sides(self) -> list[tuple[Point, Point]]:
        return list(pairwise((*self.points, self.points[0])))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.min(self.points, axis=0), np.max(self.points, axis=0)

    def edges(self) -> Edges:
        return [np.unique([a[k] for a, b in self._sides() if a[k] == b[k]]) for k in range(2)]

    def holds(self, points: np.ndarray) -> np.ndarray:
        many = max(AT_ONCE // len(self.points), 1)
        parts = [self._hold(points[first : first + many]) for first in range(0, len(points), many)]
        return np.concatenate(parts) if parts else np.zeros(0, bool)

    def _hold(self, points: np.ndarray) -> np.ndarray:
        x, y = points.T[:, :, None]
        low, high = self.bounds()
        slack = 1e-12 * float((high - low).max())
        (ax, ay), (bx, by) = np.moveaxis(np.array(self._sides()), 0, -1)
        # A ray to +x crosses the sides that reach above and below it.
        spans = (ay > y) != (by > y)
        length = np.hypot(bx - ax, by - ay)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = spans & (x < ax + (y - ay) * (bx - ax) / (by - ay))
            along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
            off = np.abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length
        on = (off <= slack) & (along >= -slack) & (along <= length + slack)
        return np.logical_xor.reduce(crossed, axis=1) | on.any(1)

    def surfaces(self) -> tuple[Patch, ...]:
        x, y = np.array(self.points).T
        clockwise = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0.0
        found: list[Patch] = []
        for number, (a, b) in enumerate(self._sides(), 1):
            if a == b:
                continue
            start, way = np.array(a), np.array(b) - np.array(a)
            normal = np.array([way[1], -way[0]]) / np.hypot(way[0], way[1])
            found.append(Patch(f"side-{number}", Facet(start, way[None], -normal if clockwise else normal)))
        return tuple(found)


def _crossing(points: np.ndarray) -> tuple[int, int] | None:
    """Two sides of a closed line through `points` (n, 2) that cross inside of both, or None: sides that touch do not."""
    with np.errstate(over="ignore"):
        start, way = points, np.roll(points, -1, axis=0) - points
    for k in range(len(points) - 1):
        with np.errstate(all="ignore"):
            apart = start[k + 1 :] - start[k]
            turn = way[k, 0] * way[k + 1 :, 1] - way[k, 1] * way[k + 1 :, 0]
            mine = (apart[:, 0] * way[k + 1 :, 1] - apart[:, 1] * way[k + 1 :, 0]) / turn
            theirs = (apart[:, 0] * way[k, 1] - apart[:, 1] * way[k, 0]) / turn
        inner = (mine > INSIDE) & (mine < 1.0 - INSIDE) & (theirs > INSIDE) & (theirs < 1.0 - INSIDE)
        if inner.any():
            return k, k + 1 + int(inner.argmax())
    return None
