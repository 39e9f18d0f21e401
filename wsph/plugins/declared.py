"""The keys that a plugin takes from a scene, as JSON schemas: a material's fields and an integrator's options."""

# pyright: strict

import dataclasses
import inspect
import types
import typing
from collections.abc import Iterator
from typing import Any, Literal, cast

from pydantic.json_schema import JsonSchemaValue

from wsph.declarations import number_schema

_KINDS: dict[object, JsonSchemaValue] = {
    str: {"type": "string"},
    "str": {"type": "string"},
    bool: {"type": "boolean"},
    "bool": {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
}


def material_schema(plugin: type, name: str) -> JsonSchemaValue:
    """The table of a material: `model` and the fields of its dataclass, with their units, bounds and defaults. A field's
    metadata may have an "example", and a "help" that says what it is."""
    fields = dataclasses.fields(cast(Any, plugin)) if dataclasses.is_dataclass(plugin) else ()
    keys = {field.name: _field_schema(field) for field in fields if field.init}
    needed = [field.name for field in fields if field.init and field.name in keys and "default" not in keys[field.name]]
    return _table("model", name, keys, needed, inspect.getdoc(cast(object, plugin)))


def integrator_schema(plugin: type, name: str) -> JsonSchemaValue:
    """The table of an integrator: `name` and the options of its constructor."""
    _, *options = list(inspect.signature(plugin).parameters.values()) or [None]
    named = [each for each in options if each is not None and each.kind not in (each.VAR_KEYWORD, each.VAR_POSITIONAL)]
    keys = {each.name: _option_schema(each) for each in named}
    needed = [each.name for each in named if each.default is each.empty]
    return _table("name", name, keys, needed, inspect.getdoc(plugin))


def strengths(material: object) -> dict[str, float]:
    """The fields of a material that are stresses and no moduli: by their units, and by their names."""
    fields = (
        dataclasses.fields(material) if dataclasses.is_dataclass(material) and not isinstance(material, type) else ()
    )
    named = [field.name for field in fields if field.metadata.get("unit") == "Pa" and "modul" not in field.name]
    return {name: float(value) for name in named if isinstance(value := getattr(material, name), (int, float))}


def references(plugin: type) -> tuple[str, ...]:
    """The BibTeX entries that a plugin brings, in `references`: a text, or a tuple of texts."""
    given: object = getattr(plugin, "references", ())
    return (given,) if isinstance(given, str) else tuple(map(str, cast(Any, given)))


def _table(
    key: str, name: str, keys: dict[str, JsonSchemaValue], needed: list[str], said: str | None
) -> JsonSchemaValue:
    return {
        "type": "object",
        "description": said or "",
        "properties": {key: {"const": name}, **keys},
        "required": [key, *needed],
        "additionalProperties": False,
    }


def _field_schema(field: dataclasses.Field[Any]) -> JsonSchemaValue:
    rules = field.metadata
    if field.type in (str, "str", bool, "bool"):
        schema = dict(_KINDS[field.type])
    else:
        bounds = (rules.get(key) for key in ("above", "min", "below", "max"))
        schema = number_schema(str(rules.get("unit", "")), *bounds)
    if field.default is not dataclasses.MISSING:
        schema["default"] = field.default
    elif field.default_factory is not dataclasses.MISSING:
        schema["default"] = field.default_factory()
    said = {"description": str(rules["help"])} if "help" in rules else {}
    return schema | said | ({"examples": [rules["example"]]} if "example" in rules else {})


def _option_schema(option: inspect.Parameter) -> JsonSchemaValue:
    given = (option.annotation, option.default)
    members = list(_members(given[0] if given[0] not in (option.empty, object) else cast(Any, type(given[1]))))
    kinds = [_KINDS[each] for each in members if each in _KINDS]
    names = [each for each in members if isinstance(each, str) and each not in _KINDS]
    kinds += [{"enum": names}] if names else []
    schema: JsonSchemaValue = {} if not kinds else dict(kinds[0]) if len(kinds) == 1 else {"anyOf": kinds}
    return schema if option.default is option.empty else {**schema, "default": option.default}


def _members(annotation: object) -> Iterator[object]:
    """The types of a union, and the values of a Literal."""
    if typing.get_origin(annotation) in (typing.Union, types.UnionType):
        for each in typing.get_args(annotation):
            yield from _members(each)
    elif typing.get_origin(annotation) is Literal:
        yield from typing.get_args(annotation)
    else:
        yield annotation
