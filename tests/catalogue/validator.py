"""The part of JSON Schema that wsph's schemas use: enough to hold files against them without another package."""

import operator
import re
from collections.abc import Iterator
from typing import Any

BOUNDS = {
    "minimum": operator.ge,
    "maximum": operator.le,
    "exclusiveMinimum": operator.gt,
    "exclusiveMaximum": operator.lt,
}
KINDS = {"object": dict, "array": (list, tuple), "string": str, "boolean": bool}


def faults(value: Any, schema: dict[str, Any], root: dict[str, Any], path: str = "") -> Iterator[str]:
    """What is wrong with a value by a schema, its definitions those of `root`."""
    if "$ref" in schema:
        yield from faults(value, root["$defs"][schema["$ref"].rpartition("/")[2]], root, path)
    for way, fits in (("anyOf", lambda n: n > 0), ("oneOf", lambda n: n == 1)):
        if way in schema and not fits(sum(not any(faults(value, each, root)) for each in schema[way])):
            yield f"{path}: {value!r} is none of {way}"
    if "const" in schema and value != schema["const"]:
        yield f"{path}: {value!r} is not {schema['const']!r}"
    if "enum" in schema and value not in schema["enum"]:
        yield f"{path}: {value!r} is none of {schema['enum']}"
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(_is(value, kind) for kind in kinds):
        yield f"{path}: {value!r} is no {' or '.join(kinds)}"
        return
    if isinstance(value, dict):
        properties, more = schema.get("properties", {}), schema.get("additionalProperties", True)
        yield from (f"{path}.{key}: is missing" for key in schema.get("required", []) if key not in value)
        for key, each in value.items():
            if key in properties:
                yield from faults(each, properties[key], root, f"{path}.{key}")
            elif more is False:
                yield f"{path}.{key}: unknown key"
            elif isinstance(more, dict):
                yield from faults(each, more, root, f"{path}.{key}")
    if isinstance(value, list | tuple):
        for k, each in enumerate(value):
            prefix = schema.get("prefixItems", [])
            yield from faults(each, prefix[k] if k < len(prefix) else schema.get("items", {}), root, f"{path}.{k}")
    if isinstance(value, str) and "pattern" in schema and not re.search(schema["pattern"], value):
        yield f"{path}: {value!r} does not match"
    if isinstance(value, int | float) and not isinstance(value, bool):
        wrong = [key for key, holds in BOUNDS.items() if key in schema and not holds(value, schema[key])]
        yield from (f"{path}: {value} breaks {key}" for key in wrong)


def _is(value: Any, kind: str) -> bool:
    if kind in KINDS:
        return isinstance(value, KINDS[kind])
    return not isinstance(value, bool) and isinstance(value, int if kind == "integer" else int | float)
