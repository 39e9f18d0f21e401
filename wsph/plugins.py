"""Plugins from a scene's keys: a dataclass's fields declare the unit and the range of every key."""

import dataclasses
import difflib
import math
from typing import Any

from wsph import registry
from wsph.errors import Fault, PluginError
from wsph.units import quantity


def build(group: str, name: str, options: dict[str, Any], key: str, name_key: str) -> tuple[Any, list[Fault]]:
    """Make a plugin's dataclass from a scene's keys: (instance or None, faults).

    Every field may declare `metadata={"unit": ..., "min": ..., "max": ..., "above": ..., "below": ...}`; min and max are
    allowed values, above and below are not.
    """
    try:
        plugin = registry.load(group, name)
    except PluginError as error:
        return None, [Fault(0, f"{key}.{name_key}", str(error))]
    if not dataclasses.is_dataclass(plugin):
        return None, [Fault(0, f"{key}.{name_key}", f"{name!r} from {registry.origin(group, name)} is not a dataclass")]
    fields = {f.name: f for f in dataclasses.fields(plugin)}
    faults, values = [], {}
    for option, value in options.items():
        if option not in fields:
            close = difflib.get_close_matches(option, fields, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"{name} knows {', '.join(fields)}"
            faults.append(Fault(0, f"{key}.{option}", f"unknown key; {hint}"))
            continue
        try:
            values[option] = _checked(value, fields[option])
        except ValueError as error:
            faults.append(Fault(0, f"{key}.{option}", str(error)))
    for option, field in fields.items():
        required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if required and option not in options:
            faults.append(
                Fault(0, f"{key}.{option}", f"is missing: {name} needs it [{field.metadata.get('unit') or '-'}]")
            )
    if faults:
        return None, faults
    try:
        return plugin(**values), []
    except Exception as error:  # whatever a third party's own checks raise is a fault of the scene's values
        return None, [Fault(0, key, f"{name} refuses its fields: {error}")]


def _checked(value: object, field: dataclasses.Field[Any]) -> object:
    rules = field.metadata
    if field.type in (str, "str", bool, "bool"):
        kind = str if field.type in (str, "str") else bool
        if not isinstance(value, kind):
            raise ValueError(f"{value!r} must be {'a string' if kind is str else 'true or false'}")
        return value
    unit = rules.get("unit", "")
    number = quantity(value, unit)
    tests = {
        "above": number > rules.get("above", -math.inf),
        "at least": number >= rules.get("min", -math.inf),
        "below": number < rules.get("below", math.inf),
        "at most": number <= rules.get("max", math.inf),
    }
    for words, holds in tests.items():
        if not holds:
            bound = rules[{"at least": "min", "at most": "max"}.get(words, words)]
            raise ValueError(f"{value!r} must be {words} {bound:g} {unit}".rstrip())
    return number


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
