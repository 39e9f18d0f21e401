"""The declarations of a material: whether its law relaxes, turns or dissipates, and its internals."""

# pyright: strict

import math
from collections.abc import Mapping
from typing import Literal


def relaxes(material: object) -> bool:
    """Whether the stress rate at L = 0 can differ from zero: by default, wherever the law depends on stress."""
    return hasattr(material, "rate") and bool(getattr(material, "relaxes", depends_on_stress(material)))


def depends_on_stress(material: object) -> bool:
    """Whether the rate depends on the stress: it does unless the material declares otherwise."""
    return bool(getattr(material, "depends_on_stress", True))


def turns(material: object) -> bool:
    """Whether it is a rate law alone, whose stress turns with the body."""
    return not hasattr(material, "stress")


def turns_itself(material: object) -> bool:
    """Whether its rate has the spin in it already, as Jaumann's has: the stress of any other is turned by the driver."""
    return bool(getattr(material, "turns_itself", False))


def dissipates(material: object) -> bool:
    """Whether a law can take energy: it relaxes, or its stress is brought back to a yield surface."""
    return relaxes(material) or hasattr(material, "project")


def own_internals(material: object) -> Mapping[str, float | tuple[float, str]]:
    """The internals that a material declares: plain numbers by their initial values, others as (initial, "Pa")."""
    return getattr(material, "internals", {})


def internal_units(material: object) -> dict[str, str]:
    """Name and unit of a body's internals: the material's own, and the dissipated energy density where its law can
    take energy."""
    own = own_internals(material).items()
    units = {name: value[1] if isinstance(value, tuple) else "" for name, value in own}
    return {**units, **({"dissipation": "Pa"} if dissipates(material) else {})}


def internal_values(material: object) -> dict[str, float]:
    """Name and initial value, in SI, of a body's internals."""
    own = own_internals(material).items()
    values = {name: float(value[0] if isinstance(value, tuple) else value) for name, value in own}
    return {**values, **({"dissipation": 0.0} if dissipates(material) else {})}


def flows(material: object) -> tuple[str, str] | None:
    """The internal that is its plastic strain and the field that is its yield stress, where it declares them: what holds
    spurious modes is then as soft as the secant of its flow."""
    return getattr(material, "flows", None)


def longest_step(material: object) -> float:
    """The longest time step that a law can take [s], infinite where it names none."""
    return float(getattr(material, "time_step")()) if hasattr(material, "time_step") else math.inf  # noqa: B009


def gives(material: object, member: Literal["rate", "stress", "piola", "energy", "project", "objective"]) -> bool:
    """Whether it has that member of a law."""
    return hasattr(material, member)


def derived_units(material: object) -> Mapping[str, str]:
    """The properties that join the numbers of its fields, with their units."""
    return getattr(material, "derived", {})


def is_linear(material: object) -> bool:
    """Whether it is linear elasticity with its moduli."""
    return bool(getattr(material, "linear", False))
