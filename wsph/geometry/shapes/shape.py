"""The base of all shapes: bounds, membership of points, and rotation. Coordinates are metres, arrays (n, dim).

A shape names the planes that a lattice has to meet (`edges`): those of its boxes and of its axis-parallel sides. Curved
and slanted sides are met in steps of a cell. `rotate` turns a shape, and the lattice in it, about the middle of its bounds.
"""

# pyright: strict

import math
import re
from itertools import product
from typing import Annotated, Protocol, get_args

import numpy as np
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, WithJsonSchema, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from wsph.declarations import list_of
from wsph.geometry.shapes.surfaces.surface import Patch
from wsph.quantities import Model, Point, Table, is_sequence, is_table
from wsph.units import quantity

Edges = list[np.ndarray]
"""Per axis, the coordinates of planes that the lattice has to meet [m]."""


MOST_DEGREES = 3600.0
"""Ten turns: of much larger angles the rounding is an angle itself."""


def _degrees(value: object) -> float:
    if isinstance(value, str):
        turn = re.fullmatch(r"\s*([-+.\deE]+?)\s*(°|deg|degrees?|rad)\s*", value)
        if not turn:
            raise ValueError(f"{value!r} is a string; an angle is a plain number, in degrees")
        degrees = quantity(f"{turn[1]} rad", "") * (math.degrees(1.0) if turn[2] == "rad" else 1.0)
        raise ValueError(f"{value!r} is a string; an angle is a plain number, in degrees: write {degrees:.12g}")
    degrees = quantity(value, "")
    if abs(degrees) > MOST_DEGREES:
        raise ValueError(f"{value!r} is beyond {MOST_DEGREES:g} degrees: whole turns change nothing")
    return degrees


def read_rotation(value: object) -> float | tuple[tuple[float, ...], float]:
    """Degrees in 2D; [axis, degrees] in 3D, the axis "x", "y", "z" or a vector."""
    if is_sequence(value):
        if len(value) != 2:
            raise ValueError(f"{value!r}: write [axis, degrees], as in [[0, 0, 1], 30]")
        axis, degrees = value
        if isinstance(axis, str) and axis in ("x", "y", "z"):
            axis = [float(axis == a) for a in "xyz"]
        numbers = [quantity(x, "") for x in axis] if is_sequence(axis) else []
        if len(numbers) != 3 or not any(numbers):
            raise ValueError(f"{axis!r} is no axis: write a vector of three numbers that is not zero, or x, y or z")
        return (tuple(numbers), _degrees(degrees))
    return _degrees(value)


_TURN = {
    "type": "array",
    "prefixItems": [{"anyOf": [{"enum": ["x", "y", "z"]}, list_of({"type": "number"})]}, {"type": "number"}],
    "minItems": 2,
    "maxItems": 2,
}
_ROTATION = WithJsonSchema({"anyOf": [{"type": "number"}, _TURN], "unit": "degrees"})

Rotation = Annotated[float | tuple[tuple[float, ...], float], BeforeValidator(read_rotation), _ROTATION]


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


class BaseShape(Model):
    """What all shapes have. Of a scene file's tables the `type` says the class; of an object the class says the type."""

    rotate: Rotation = 0.0
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=100)] | None = None

    @model_validator(mode="before")
    @classmethod
    def _by_its_class(cls, given: object) -> object:
        if is_table(given) and "type" not in given and (own := cls.own_type(given)):
            return {"type": own, **given}
        return given

    @classmethod
    def own_type(cls, given: Table) -> str:
        """The `type` of a shape of this class with those keys; empty where there are several."""
        types = get_args(cls.model_fields["type"].annotation)
        return types[0] if len(types) == 1 else ""

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        # A file has to say the type: it tells the shapes apart.
        found = handler.resolve_ref_schema(handler(schema))
        if "type" not in found.get("properties", {}):
            return found
        found["properties"]["type"].pop("default", None)
        found["required"] = ["type", *(key for key in found.get("required", ()) if key != "type")]
        return found

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

    def surfaces(self) -> tuple[Patch, ...]:
        """The patches of its surface before rotation, by names within the shape."""
        raise NotImplementedError

    def patches(self) -> tuple[Patch, ...]:
        """The patches of its surface before rotation, under the name of the shape if it has one."""
        return tuple(p.within(self.name) for p in self.surfaces()) if self.name is not None else self.surfaces()

    @property
    def unscaled(self) -> bool:
        """Whether lengths are those of a file, in metres because no `scale` says otherwise."""
        return False

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
        middle, ends = 0.5 * (low + high), np.array(list(product(*zip(low, high, strict=True))))
        return middle + (ends - middle) @ self.axes.T


class Typed(Protocol):
    """A shape, by the name that scenes know it by."""

    @property
    def type(self) -> str:
        """Its `type` in a scene."""
        ...


def check_coordinates(shape: Typed, points: tuple[Point, ...], dim: int) -> None:
    for point in points:
        if len(point) != dim:
            raise ValueError(f"a {shape.type} is of {dim} dimensions; {list(point)} has {len(point)} coordinates")
