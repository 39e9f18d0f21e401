"""Plugins from a scene's keys: a dataclass's fields declare the unit and the range of every key."""

import dataclasses
import difflib
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
            values[option] = _checked(value, fields[option].metadata)
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
    except ValueError as error:
        return None, [Fault(0, key, str(error))]


def _checked(value: object, rules: Any) -> float:
    number = quantity(value, rules.get("unit", ""))
    tests = (("above", number > rules.get("above", -float("inf"))), ("min", number >= rules.get("min", -float("inf"))),
             ("below", number < rules.get("below", float("inf"))), ("max", number <= rules.get("max", float("inf"))))  # fmt: skip
    for rule, holds in tests:
        if not holds:
            words = {"above": "above", "min": "at least", "below": "below", "max": "at most"}[rule]
            raise ValueError(f"{value!r} must be {words} {rules[rule]:g} {rules.get('unit', '')}".rstrip())
    return number
