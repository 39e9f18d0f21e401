"""What a material says of itself: whether its law relaxes, turns or dissipates, and its internals."""

import math
from typing import Any


def relaxes(material: Any) -> bool:
    """Whether the stress rate at L = 0 can differ from zero: by default, wherever the law depends on stress."""
    return hasattr(material, "rate") and bool(
        getattr(material, "relaxes", getattr(material, "depends_on_stress", True))
    )


def turns(material: Any) -> bool:
    """Whether it is a rate law alone whose stress turns with the body: one that depends on stress does."""
    return not hasattr(material, "stress") and bool(getattr(material, "depends_on_stress", True))


def dissipates(material: Any) -> bool:
    """Whether a law can take energy: it relaxes, or its stress is brought back to a yield surface."""
    return relaxes(material) or hasattr(material, "project")


def internal_units(material: Any) -> dict[str, str]:
    """Name and unit of a body's internals: the material's own, and the dissipated energy density where its law can
    take energy.

    A material declares `internals = {"name": initial}` for plain numbers, `{"name": (initial, "Pa")}` otherwise.
    """
    units = {
        name: value[1] if isinstance(value, tuple) else "" for name, value in getattr(material, "internals", {}).items()
    }
    return {**units, **({"dissipation": "Pa"} if dissipates(material) else {})}


def internal_values(material: Any) -> dict[str, float]:
    """Name and initial value, in SI, of a body's internals."""
    own = getattr(material, "internals", {}).items()
    values = {name: float(value[0] if isinstance(value, tuple) else value) for name, value in own}
    return {**values, **({"dissipation": 0.0} if dissipates(material) else {})}


def longest_step(material: Any) -> float:
    """The longest time step that a law can take [s], infinite where it names none."""
    return float(material.time_step()) if hasattr(material, "time_step") else math.inf


def has_rate(material: Any) -> bool:
    """Whether it gives a rate law."""
    return hasattr(material, "rate")


def is_linear(material: Any) -> bool:
    """Whether it is linear elasticity with its moduli."""
    return bool(getattr(material, "linear", False))
