"""Shapes of bodies: what is inside, and the box that encloses it. Coordinates are metres, arrays (n, dim).

A shape names the planes that a lattice has to meet (`edges`): those of its boxes and of its axis-parallel sides. Curved
and slanted sides are met in steps of a cell. `rotate` turns a shape, and the lattice in it, about the middle of its bounds.
"""

from itertools import pairwise, product
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from wsph.units import quantity


def _length(value: object) -> float:
    return quantity(value, "m")


def as_tuple(value: Any) -> Any:
    """A list of a scene as the tuple that its model holds."""
    return tuple(value) if isinstance(value, list) else value


Length = Annotated[float, BeforeValidator(_length)]
Positive = Annotated[float, BeforeValidator(_length), Field(gt=0)]
Point = Annotated[tuple[Length, ...], BeforeValidator(as_tuple), Field(min_length=1, max_length=3)]
Edges = list[np.ndarray]
"""Per axis, the coordinates of planes that the lattice has to meet [m]."""


def _rotation(value: Any) -> Any:
    """Degrees in 2D; [axis, degrees] in 3D, the axis "x", "y", "z" or a vector."""
    if isinstance(value, (list, tuple)):
        if len(value) != 2:
            raise ValueError(f"{value!r}: write [axis, degrees], as in [[0, 0, 1], 30]")
        axis, degrees = value
        if isinstance(axis, str) and axis in ("x", "y", "z"):
            axis = [float(axis == a) for a in "xyz"]
        numbers = [quantity(x, "") for x in axis] if isinstance(axis, (list, tuple)) else []
        if len(numbers) != 3 or not any(numbers):
            raise ValueError(f"{axis!r} is no axis: write a vector of three numbers that is not zero, or x, y or z")
        return (tuple(numbers), quantity(degrees, ""))
    return quantity(value, "")


Rotation = Annotated[float | tuple[tuple[float, ...], float], BeforeValidator(_rotation)]


def rotation_matrix(rotation: Rotation, dim: int) -> np.ndarray:
    """The rotation as a (dim, dim) matrix. Raises ValueError where its form is not that of the dimension."""
    if rotation == 0.0:
        return np.eye(dim)
    if isinstance(rotation, tuple) != (dim == 3) or dim == 1:
        wanted = {1: "has no place in 1D", 2: "is a number of degrees in 2D", 3: "is [axis, degrees] in 3D"}[dim]
        raise ValueError(f"a rotation {wanted}")
    if isinstance(rotation, tuple):
        n = np.array(rotation[0]) / np.linalg.norm(rotation[0])
        cosine, sine = _cosine_sine(rotation[1])
        cross = np.array([[0.0, -n[2], n[1]], [n[2], 0.0, -n[0]], [-n[1], n[0], 0.0]])
        return cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(n, n)
    cosine, sine = _cosine_sine(rotation)
    return np.array([[cosine, -sine], [sine, cosine]])


def _cosine_sine(degrees: float) -> tuple[float, float]:
    """Exact at quarter turns."""
    quarter, rest = divmod(degrees, 90.0)
    c, s = np.cos(np.radians(rest)), np.sin(np.radians(rest))
    return ((c, s), (-s, c), (-c, -s), (s, -c))[int(quarter) % 4]


class _Shape(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    rotate: Rotation = 0.0

    @property
    def dim(self) -> int:
        """Number of coordinates."""
        raise NotImplementedError

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner before rotation [m]."""
        raise NotImplementedError

    def edges(self) -> Edges:
        """Per axis, the coordinates of planes that the lattice has to meet, before rotation [m]."""
        return [np.zeros(0)] * self.dim

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (n, dim) lie inside or on the surface of the shape before rotation, (n,) bool."""
        raise NotImplementedError

    @property
    def axes(self) -> np.ndarray:
        """The rotation, (dim, dim): columns are the shape's own axes. Raises ValueError where its form is wrong."""
        return rotation_matrix(self.rotate, self.dim)

    @property
    def middle(self) -> np.ndarray:
        """The middle of the bounds, about which the shape turns [m]."""
        low, high = self.bounds()
        return 0.5 * (low + high)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which of `points` (n, dim) lie inside or on the surface, (n,) bool."""
        return self.holds(self._back(points))

    def covers(self, points: np.ndarray) -> np.ndarray:
        """The same with the holes of a difference filled, (n,) bool."""
        return self.holds(self._back(points))

    def _back(self, points: np.ndarray) -> np.ndarray:
        """Where `points` were before the rotation."""
        if self.rotate == 0.0:
            return points
        # Drawn to the middle by more than a rounding, so that a point on the surface does not fall out by its rotation.
        return self.middle + (1.0 - 1e-12) * (points - self.middle) @ self.axes

    def corners(self) -> np.ndarray:
        """Corners of the bounds after rotation, (2^dim, dim) [m]."""
        low, high = self.bounds()
        ends = np.array(list(product(*zip(low, high, strict=True))))
        return self.middle + (ends - self.middle) @ self.axes.T


class Box(_Shape):
    """An axis-parallel box (a segment in 1D, a rectangle in 2D) from corner `min` to corner `max`."""

    type: Literal["box"]
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


def _coordinates(shape: Any, points: tuple[Point, ...], dim: int) -> None:
    for point in points:
        if len(point) != dim:
            raise ValueError(f"a {shape.type} is of {dim} dimensions; {list(point)} has {len(point)} coordinates")


class Ball(_Shape):
    """A disc (2D) or a sphere (3D) about `center`."""

    type: Literal["disc", "sphere"]
    center: Point
    radius: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Ball":
        _coordinates(self, (self.center,), self.dim)
        return self

    @property
    def dim(self) -> int:
        return 2 if self.type == "disc" else 3

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.center) - self.radius, np.array(self.center) + self.radius

    def holds(self, points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - np.array(self.center), axis=1) <= self.radius


class Ring(_Shape):
    """The area between two circles about `center` (2D)."""

    type: Literal["ring"]
    center: Point
    inner: Positive
    outer: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Ring":
        _coordinates(self, (self.center,), 2)
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


class Cylinder(_Shape):
    """A round bar with its ends' centres at `from` and `to` (3D)."""

    type: Literal["cylinder"]
    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    radius: Positive

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Cylinder":
        _coordinates(self, (self.start, self.end), 3)
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


class Polygon(_Shape):
    """The inside of a closed line through `points` in order, the last joined to the first (2D)."""

    type: Literal["polygon"]
    points: Annotated[tuple[Point, ...], BeforeValidator(as_tuple), Field(min_length=3)]

    @model_validator(mode="after")
    def _of_its_dimension(self) -> "Polygon":
        _coordinates(self, self.points, 2)
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
        x, y = points.T
        inside, on = np.zeros(len(points), bool), np.zeros(len(points), bool)
        low, high = self.bounds()
        slack = 1e-12 * float((high - low).max())
        for (ax, ay), (bx, by) in self._sides():
            # A ray to +x crosses the sides that reach above and below it.
            spans = (ay > y) != (by > y)
            with np.errstate(divide="ignore", invalid="ignore"):
                inside ^= spans & (x < ax + (y - ay) * (bx - ax) / (by - ay))
            length = np.hypot(bx - ax, by - ay)
            along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
            off = np.abs((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length
            on |= (off <= slack) & (along >= -slack) & (along <= length + slack)
        return inside | on


class Combined(_Shape):
    """`difference`: the first of `shapes` without the others; `union`: all of them together."""

    type: Literal["difference", "union"]
    shapes: Annotated[tuple["Shape", ...], BeforeValidator(as_tuple), Field(min_length=2)]

    @model_validator(mode="after")
    def _of_one_dimension(self) -> "Combined":
        if len({shape.dim for shape in self.shapes}) > 1:
            raise ValueError(f"its shapes have {', '.join(str(s.dim) for s in self.shapes)} coordinates: not the same")
        return self

    @property
    def dim(self) -> int:
        return self.shapes[0].dim

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        corners = np.concatenate([s.corners() for s in (self.shapes if self.type == "union" else self.shapes[:1])])
        return corners.min(0), corners.max(0)

    def edges(self) -> Edges:
        upright = [shape.edges() for shape in self.shapes if shape.rotate == 0.0]
        return [np.unique(np.concatenate([np.zeros(0), *(e[k] for e in upright)])) for k in range(self.dim)]

    def holds(self, points: np.ndarray) -> np.ndarray:
        first, *rest = (shape.contains(points) for shape in self.shapes)
        others = np.any(rest, axis=0)
        return first | others if self.type == "union" else first & ~others

    def covers(self, points: np.ndarray) -> np.ndarray:
        back = self._back(points)
        return self.shapes[0].covers(back) if self.type == "difference" else self.holds(back)


Shape = Annotated[Box | Ball | Ring | Cylinder | Polygon | Combined, Field(discriminator="type")]
"""Every shape that a body can have."""
Combined.model_rebuild()
