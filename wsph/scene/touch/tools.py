"""The table of rigid tools: bodies that do not deform, which press on bodies that do."""

# pyright: strict

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PlainSerializer,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic.config import JsonDict

from wsph.declarations import VALUE, Measured, example, list_of, names_table, number_schema
from wsph.geometry.shapes.shape import Rotation
from wsph.geometry.shapes.stl import Stl
from wsph.quantities import (
    Model,
    NumberOrAuto,
    Point,
    Positive,
    Strings,
    Unit,
    Value,
    as_it_is,
    as_tuple,
    file_name,
    is_sequence,
    is_table,
)
from wsph.scene.touch.contact import HUMS, STICKY, damping_of
from wsph.units import quantity

Numbers = Annotated[tuple[Annotated[float, Unit("")], ...], BeforeValidator(as_tuple)]


def _velocity(value: object, table: Callable[[object], object]) -> object:
    """A table of prescribed components, or the list of the initial ones."""
    return tuple(quantity(v, "m/s") for v in value) if is_sequence(value) else table(value)


def _spin(value: object, number: Callable[[object], object]) -> object:
    return tuple(quantity(v, "1/s") for v in value) if is_sequence(value) else number(value)


def _inertia(value: object, number: Callable[[object], object]) -> object:
    return tuple(number(v) for v in value) if is_sequence(value) else number(value)


def _damping(data: dict[str, Any]) -> float:
    return damping_of(data.get("friction", 0.0))


if TYPE_CHECKING:
    Velocity = dict[str, Value] | tuple[float, ...]
    Spin = float | tuple[float, ...]
    Inertia = Value | tuple[Value, ...]
else:
    _plain = PlainSerializer(as_it_is)
    _speeds = {"anyOf": [names_table(VALUE), list_of(number_schema("m/s"))], "unit": "m/s"}
    _spins = {"anyOf": [number_schema("1/s"), list_of(number_schema("1/s"))], "unit": "1/s"}
    Velocity = Annotated[dict[str, Value], WrapValidator(_velocity), _plain, WithJsonSchema(_speeds)]
    Spin = Annotated[float, Unit("1/s"), WrapValidator(_spin), _plain, WithJsonSchema(_spins)]
    _inertias = WithJsonSchema({"anyOf": [VALUE, list_of(VALUE)], "unit": "kg m2, of 2D kg m"})
    Inertia = Annotated[Value, WrapValidator(_inertia), _plain, _inertias]


class Plane(Model):
    """All that lies below a plane through `point`, whose outward `normal` need not be of length one."""

    model_config = example({"type": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]})
    type: Literal["plane"]
    point: Point
    normal: Numbers


class Sphere(Model):
    """A ball about `center`; in 2D a disc."""

    model_config = example({"type": "sphere", "center": [0.0, 0.0, "10 mm"], "radius": "10 mm"})
    type: Literal["sphere", "disc"]
    center: Point
    radius: Positive


class Cylinder(Model):
    """A round bar about the line through `from` and `to`, without ends (3D)."""

    model_config = example({"type": "cylinder", "from": [0.0, 0.0, 0.0], "to": [0.0, 1.0, 0.0], "radius": "10 mm"})
    type: Literal["cylinder"]
    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    radius: Positive


class Box(Model):
    """A box (a rectangle in 2D) from corner `from` to corner `to`, turned about its middle by `rotate`."""

    model_config = example({"type": "box", "from": [0.0, 0.0], "to": ["10 mm", "20 mm"]})
    type: Literal["box"]
    start: Point = Field(alias="from")
    end: Point = Field(alias="to")
    rotate: Rotation = 0.0


ToolShape = Annotated[Plane | Sphere | Cylinder | Box | Stl, Field(discriminator="type")]
"""Every shape that a tool can have."""


class Turn(Model):
    """A turning at a `rate` [1/s], right-handed about the `axis` (3D; in 2D it is z) through the point `about`."""

    model_config = example({"about": [0.0, 0.0], "rate": 10.0})
    axis: Numbers | None = None
    about: Point
    rate: Annotated[Value, Measured("1/s")]


_EXAMPLE: JsonDict = {
    "name": "punch",
    "shape": {"type": "sphere", "center": [0.0, 0.0, "10 mm"], "radius": "10 mm"},
    "velocity": {"z": -1.0},
    "against": ["plate"],
}


class Tool(Model):
    """A rigid tool, `against` bodies: it stands still, moves with a prescribed `velocity` and `turn`, or, with a `mass`, as
    the forces on it have it, from an initial `velocity` (a list) and `spin`. `inside`: it is a hole that keeps bodies in.

    `mass` is per depth in 2D and per area in 1D, `inertia` that about its centre of mass, in 3D about the axes of the scene;
    without it, that of its shape of uniform density. `stiffness`, `friction`, `damping` and `memory` are those of a contact.
    """

    model_config = example(_EXAMPLE)
    name: Annotated[str, AfterValidator(file_name)]
    """of its numbers in history.csv"""
    shape: ToolShape
    """a plane, ball, cylinder, box or surface of triangles"""
    inside: bool = False
    """it is a hole that keeps bodies in"""
    velocity: Velocity = {}
    """prescribed, by component; a list: the initial one of a tool with a mass"""
    turn: Turn | None = None
    """a prescribed turning"""
    mass: Annotated[Value, Measured("kg, of 2D kg/m, of 1D kg/m2")] | None = None
    """with it the tool moves as the forces on it have it"""
    inertia: Inertia | None = None
    """about its centre of mass; without it that of its shape"""
    spin: Spin | None = None
    """initial, of a tool with a mass [1/s]"""
    against: Annotated[Strings, Field(min_length=1)]
    """the bodies that it touches"""
    friction: Annotated[float, Unit("", ge=0)] = 0.0
    """Coulomb's coefficient"""
    stiffness: NumberOrAuto = "auto"
    """a multiple of the materials'; auto: by the time step"""
    damping: Annotated[float, Unit("", ge=0)] = Field(default_factory=_damping)
    """a multiple of the impedance"""
    memory: Annotated[float, Unit("", ge=0)] | None = None
    """of friction, in cells that a wave crosses"""

    @model_validator(mode="after")
    def _of_one_kind(self) -> "Tool":
        if not self.free and isinstance(self.velocity, tuple):
            raise ValueError(
                "velocity is a list, which is the initial one of a free tool: give its mass, or prescribe the motion,"
                " as in velocity = { x = 1.0 }"
            )
        prescribed = [
            key
            for key, given in (("velocity", is_table(self.velocity) and self.velocity), ("turn", self.turn))
            if given
        ]
        if self.free and prescribed:
            raise ValueError(
                f"mass makes the tool free, and {' and '.join(prescribed)} prescribes its motion: leave one of them out"
                " (the initial velocity of a free tool is a list, velocity = [1.0, 0.0])"
            )
        kept = [key for key in ("inertia", "spin") if getattr(self, key) is not None]
        if kept and not self.free:
            raise ValueError(f"{' and '.join(kept)} is of a free tool, which has a mass")
        return self

    @property
    def number(self) -> float | None:
        """The stiffness that the scene gives, None where the time step chooses it."""
        return None if self.stiffness == "auto" else self.stiffness

    @property
    def soft(self) -> bool:
        """Whether damping gives way where it would need a shorter step; not where sliding would hum without all of it."""
        return self.friction <= STICKY

    @property
    def warning(self) -> str:
        """What whoever runs it should know; "" where there is nothing."""
        if self.friction > HUMS:
            return f"tool {self.name!r}: sliding with friction = {self.friction:g} hums: above {HUMS:g} it is faster than it should be"
        return ""

    @property
    def free(self) -> bool:
        """Whether it moves as the forces on it have it."""
        return self.mass is not None
