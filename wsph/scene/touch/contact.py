"""The table of a scene that says how bodies meet."""

# pyright: strict

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from wsph.declarations import example
from wsph.quantities import Model, NumberOrAuto, Unit, as_tuple, file_name

Law = Literal["surface", "pinball", "tie"]

OF_LAWS: dict[str, tuple[Law, ...]] = {
    "friction": ("surface", "pinball"),
    "damping": ("surface",),
    "memory": ("surface",),
    "edges": ("surface",),
    "strength": ("tie",),
    "radius": ("pinball",),
}
"""The laws that a key is of, of keys that are not of all of them."""

HUMS, STICKY = 1.0, 0.6
"""Coefficients of friction beyond which sliding hums whatever the damping, and beyond which it takes twice the impedance."""


def _law(value: object) -> object:
    if value == "penalty":
        raise ValueError(
            '"penalty" between the balls of particles is replaced by law = "surface", which acts between the surfaces'
            ' themselves, without gaps or teeth, and stores energy as it did; law = "pinball" keeps the balls'
        )
    return value


def _called(data: dict[str, Any]) -> str:
    between: tuple[str, ...] | None = data.get("between")
    return "-".join(between) if between else f"{data.get('self_')}-self"


def _stiff(data: dict[str, Any]) -> object:
    return 1.0 if data.get("law") == "pinball" else "auto"


def damping_of(friction: float) -> float:
    """The damping that surfaces with a coefficient of friction have where a table gives none."""
    return 0.0 if friction == 0.0 else 2.0 if friction > STICKY else 1.0


def _damping(data: dict[str, Any]) -> float:
    return damping_of(data.get("friction", 0.0)) if data.get("law") == "surface" else 0.0


class Contact(Model):
    """Contact `between` two bodies, or of `self`: its `law`, its `stiffness` as a multiple of the materials' or "auto", by
    the time step; `friction`, `damping` as a multiple of the impedance, `memory` of the friction [cells that a wave
    crosses], and whether `edges` meet, of surfaces; `strength` of a tie; `radius` of a ball in spacings."""

    model_config = example({"between": ["ball", "plate"], "friction": 0.2})
    between: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] | None = None
    """two bodies"""
    self_: Annotated[str | None, Field(alias="self")] = None
    """a body that touches itself"""
    name: Annotated[str, AfterValidator(file_name)] = Field(default_factory=_called)
    """of its numbers in history.csv"""
    law: Annotated[Law, BeforeValidator(_law)] = "surface"
    """how surfaces meet; tie: they stay together"""
    stiffness: NumberOrAuto = Field(default_factory=_stiff)  # pyright: ignore[reportAssignmentType]
    """a multiple of the materials'; auto: by the time step"""
    friction: Annotated[float, Unit("", ge=0)] = 0.0
    """Coulomb's coefficient"""
    damping: Annotated[float, Unit("", ge=0)] = Field(default_factory=_damping)
    """a multiple of the impedance"""
    memory: Annotated[float, Unit("", ge=0)] | None = None
    """of friction, in cells that a wave crosses"""
    edges: bool = True
    """whether edges meet edges"""
    strength: Annotated[float, Unit("Pa", gt=0)] | None = None
    """of a tie: where it parts"""
    radius: Annotated[float, Unit("", gt=0, le=1)] = 0.5
    """of a ball, in spacings (pinball)"""

    @model_validator(mode="after")
    def _complete(self) -> "Contact":
        if (self.between is None) == (self.self_ is None):
            raise ValueError('exactly one of between = ["a", "b"] and self = "a" is needed')
        if self.between is not None and (len(self.between) != 2 or self.between[0] == self.between[1]):
            raise ValueError('between names two different bodies; for one with itself write self = "a"')
        if self.law == "pinball" and self.stiffness == "auto":
            raise ValueError('stiffness = "auto" is of law = "surface" and "tie"; of pinball it is a number')
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The bodies that take part."""
        return self.between if self.between is not None else (self.self_ or "",)

    @property
    def number(self) -> float | None:
        """The stiffness that the scene gives, None where the time step chooses it."""
        return None if self.stiffness == "auto" else self.stiffness

    @property
    def foreign(self) -> dict[str, str]:
        """Keys that the table gives and that are of other laws, with the fault of each."""
        given = {key: laws for key, laws in OF_LAWS.items() if key in self.model_fields_set and self.law not in laws}
        words = {key: " and ".join(map(_quoted, laws)) for key, laws in given.items()}
        return {key: f"is a key of law = {theirs}, not of {_quoted(self.law)}" for key, theirs in words.items()}

    @property
    def warning(self) -> str:
        """What whoever runs it should know; "" where there is nothing."""
        if self.law == "surface" and self.friction > HUMS:
            return (
                f"contact {self.name!r}: sliding with friction = {self.friction:g} hums: above {HUMS:g} it is faster than it"
                " should be, and takes more energy; what sticks is right"
            )
        return ""


def _quoted(name: str) -> str:
    return f'"{name}"'
