"""The keys of a table in words: what each is, its unit, default and range, read off the table's JSON schema."""

# pyright: strict

import json
from collections.abc import Iterator
from dataclasses import dataclass

from wsph.catalogue.docstrings import first_sentence
from wsph.declarations import QUANTITY
from wsph.quantities import Table, is_list, is_sequence, is_table

BOUNDS = {">": "exclusiveMinimum", ">=": "minimum", "<": "exclusiveMaximum", "<=": "maximum"}
"""Keys of a schema by what they say of a number."""


@dataclass(frozen=True)
class Key:
    """A key of a table: what it is, in which unit, what it is where it is left out ("needed" where it may not be), its
    range, and what its declaration says of it; "" where there is nothing to say."""

    name: str
    kind: str
    unit: str
    default: str
    range: str
    said: str = ""

    @property
    def words(self) -> str:
        """What it is, and what its declaration says."""
        return f"{self.kind}: {self.said}" if self.said else self.kind


def keys_of(schema: Table, root: Table | None = None) -> list[Key]:
    """The keys of a table by its schema; definitions are those of `root`."""
    properties, needed = schema.get("properties"), schema.get("required", [])
    if not is_table(properties) or not is_list(needed):
        return []
    found: list[Key] = []
    for name, given in properties.items():
        part = given if is_table(given) else {}
        default = "needed" if name in needed else written(part["default"]) if "default" in part else ""
        kind, said = kind_of(part), said_of(part, root or {})
        # What keys of a table are in, its own rows say.
        unit, bounds = ("", "") if kind == "table" else (unit_of(part), range_of(part))
        found.append(Key(name, kind, unit, default, bounds, said))
    return found


def resolved(part: Table, root: Table) -> Table:
    """A schema, or the definition that it refers to."""
    definitions = root.get("$defs")
    if isinstance(name := part.get("$ref"), str) and is_table(definitions):
        found = definitions.get(name.rpartition("/")[2])
        return found if is_table(found) else part
    return part


def said_of(part: Table, root: Table) -> str:
    """What the declaration of a key says, or that of the table that it is, in a sentence."""
    for each in _choices(part) if "description" not in part else [part]:
        said = resolved(each, root).get("description")
        if isinstance(said, str):
            return first_sentence(said)
    return ""


def kind_of(part: Table) -> str:
    """What a value is, in words."""
    if "const" in part:
        return written(part["const"])
    if is_list(names := part.get("enum")):
        return ", ".join(map(written, names))
    if isinstance(part.get("$ref"), str):
        return "table"
    for way in ("anyOf", "oneOf"):
        if is_list(choices := part.get(way)):
            return _either([kind_of(each) for each in choices if is_table(each)])
    kind = part.get("type")
    if is_list(kind):
        return "number, expression or function"
    if kind == "array":
        items = part.get("items")
        return f"list of {_plural(kind_of(items))}" if is_table(items) else "list"
    if kind == "object":
        values = part.get("additionalProperties")
        return f"table of {_plural(kind_of(values))}" if is_table(values) and values else "table"
    if kind == "string" and part.get("pattern") == QUANTITY and "unit" not in part:
        return ""  # a number with its unit, which the number beside it stands for
    words = {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "string"}
    return words.get(str(kind), "anything")


def unit_of(part: object) -> str:
    """The first unit that stands in a schema."""
    return next((unit for unit in _found(part, "unit") if isinstance(unit, str)), "")


def range_of(part: Table) -> str:
    """The bounds of a number, in words."""
    return ", ".join(f"{sign} {bound:g}" for sign, bound in bounds_of(part))


def bounds_of(part: Table) -> list[tuple[str, float]]:
    """The bounds of a number, each with its sign, as > and <=."""
    part = next((each for each in _choices(part) if each.get("type") in ("number", "integer", "array")), part)
    found = ((sign, next(_numbers(part, key), None)) for sign, key in BOUNDS.items())
    return [(sign, bound) for sign, bound in found if bound is not None]


def written(value: object) -> str:
    """A value as TOML has it."""
    if is_table(value):
        value = {
            key: value[key]
            for key in sorted(value, key=lambda key: key not in ("type", "model", "name", "min", "from"))
        }
        return "{ " + ", ".join(f"{key} = {written(each)}" for key, each in value.items()) + " }" if value else "{}"
    if is_sequence(value):
        return "[" + ", ".join(map(written, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _choices(part: Table) -> Iterator[Table]:
    """A schema, or the members of a union of them."""
    if not is_list(choices := part.get("anyOf")):
        yield part
        return
    for each in choices:
        yield from _choices(each) if is_table(each) else ()


def _either(kinds: list[str]) -> str:
    words = list(dict.fromkeys(kind for kind in kinds if kind))
    return " or ".join(words) if words else "anything"


def _plural(kind: str) -> str:
    if " or " in kind:
        return f"({kind})"
    first, _, rest = kind.partition(" of ")
    plural = f"{first}s" if first in ("number", "whole number", "string", "table", "list") else first
    return f"{plural} of {rest}" if rest else plural


def _numbers(part: object, key: str) -> Iterator[float]:
    return (float(value) for value in _found(part, key) if isinstance(value, (int, float)))


def _found(part: object, key: str) -> Iterator[object]:
    """What stands under a key, at any depth."""
    if is_list(part):
        for each in part:
            yield from _found(each, key)
    elif is_table(part):
        if key in part:
            yield part[key]
        for each in part.values():
            yield from _found(each, key)
