"""The declarations of a material: whether its law relaxes, turns or dissipates, its internals, and what is wrong with
them."""

# pyright: strict

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Literal, cast

from wsph.units import unit as unit_named


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


def declaration_faults(material: object) -> Iterator[str]:
    """What is wrong with the declarations of a material, in words; its laws are not asked."""
    for name in ("relaxes", "depends_on_stress", "turns_itself", "linear"):
        if not isinstance(value := getattr(material, name, False), bool):
            yield f"{name} is {value!r}: True or False is expected"
    for check in (_internal_faults, _derived_faults, _flow_faults, _time_step_faults):
        try:
            yield from check(material)
        except (Exception, SystemExit) as error:  # whatever a third party's code raises
            yield f"its declarations cannot be read: {type(error).__name__}: {error}"


def _internal_faults(material: object) -> Iterator[str]:
    given: object = getattr(material, "internals", {})
    if not isinstance(given, Mapping):
        yield f"internals are {given!r}: a mapping of names to initial values is expected"
        return
    for name, value in own_internals(material).items():
        initial, unit = value if isinstance(value, tuple) else (value, "")
        if isinstance(initial, str) or not math.isfinite(float(initial)):
            yield f"the internal {name!r} begins with {initial!r}: a number is expected"
        yield from _unit_faults(f"the internal {name!r}", unit)


def _derived_faults(material: object) -> Iterator[str]:
    for name, unit in derived_units(material).items():
        if not math.isfinite(float(getattr(material, name))):
            yield f"the property {name!r}, which is declared as derived, is not finite"
        yield from _unit_faults(f"the property {name!r}", unit)


def _flow_faults(material: object) -> Iterator[str]:
    given: object = getattr(material, "flows", None)
    if given is None:
        return
    pair = isinstance(given, (tuple, list)) and [str(each) for each in cast(Sequence[object], given)]
    if not pair or len(pair) != 2 or pair[0] not in own_internals(material) or not hasattr(material, pair[1]):
        yield f"it has flows = {given!r}: an internal, the plastic strain, and a field, the yield stress, are expected"


def _time_step_faults(material: object) -> Iterator[str]:
    if not longest_step(material) > 0.0:
        yield f"time_step() gives {longest_step(material)!r}: a time above zero is expected"


def _unit_faults(whose: str, unit: object) -> Iterator[str]:
    try:
        unit_named(str(unit))
    except ValueError as error:
        yield f"{whose}: {error}"
