"""Plugins from a scene's keys: a dataclass's fields declare the unit and the range of every key."""

# pyright: strict

import dataclasses
import difflib
import math
from collections.abc import Mapping
from typing import Any

from wsph.errors import Fault, PluginError, SceneError
from wsph.plugins import registry
from wsph.plugins.traits import declaration_faults
from wsph.units import quantity


def build(group: str, name: str, options: Mapping[str, object], key: str, name_key: str) -> tuple[object, list[Fault]]:
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
    faults: list[Fault] = []
    values: dict[str, object] = {}
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
        made = plugin(**values)
    except (Exception, SystemExit) as error:  # whatever a third party's own checks raise is a fault of the values
        return None, [Fault(0, key, f"{name} refuses its fields: {error}")]
    wrong = declaration_faults(made) if group == "materials" else ()
    faults = [
        Fault(0, f"{key}.{name_key}", f"{name!r} from {registry.origin(group, name)}: {words}") for words in wrong
    ]
    return (None if faults else made), faults


def keys_of(group: str, plugin: object) -> dict[str, object]:
    """The keys by which a scene has a plugin's dataclass: its fields, as numbers in SI units. Raises PluginError where it is
    no plugin."""
    if not dataclasses.is_dataclass(plugin) or isinstance(plugin, type):
        raise PluginError(f"{plugin!r} is no object of a plugin's dataclass")
    named = registry.name_of(group, type(plugin))
    return {"model": named, **{f.name: getattr(plugin, f.name) for f in dataclasses.fields(plugin) if f.init}}


def material(name: str, /, **fields: object) -> object:
    """A material by its registered name, its fields as numbers in SI units or with units of their own, "210 GPa". Raises
    SceneError with every fault. Its class, which says what it is, is that of the plugin."""
    made, faults = build("materials", name, fields, name, "model")
    if faults:
        raise SceneError("material", faults)
    return made


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
