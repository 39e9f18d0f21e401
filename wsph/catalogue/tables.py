"""The tables of a scene by their paths, with their schemas: those of shapes by their types too."""

# pyright: strict

from collections.abc import Iterator
from functools import cache
from typing import cast

from wsph.catalogue.keys import resolved
from wsph.catalogue.schema import bare_scene_schema
from wsph.quantities import Table, is_list, is_table


@cache
def root() -> Table:
    """The schema that tables are read off, made once a process."""
    return bare_scene_schema()


@cache
def places() -> tuple[tuple[str, Table], ...]:
    """Every table of a scene by its path, those of shapes by their types."""
    found: dict[str, Table] = {}
    _walk(root(), "", found)
    return tuple(found.items())


def _walk(schema: Table, path: str, found: dict[str, Table]) -> None:
    properties = schema.get("properties")
    for key, part in (properties if is_table(properties) else {}).items():
        place = f"{path}.{key}" if path else key
        for each in _within(part):
            table = resolved(each, root())
            if "description" not in table or "properties" not in table or place.count(".") > 3:
                continue
            for name in _types(table):
                at = f"{place}.{name}" if name else place
                if at not in found and key not in ("material", "integrator", "shapes"):
                    found[at] = table
                    _walk(table, at, found)


def _within(part: object) -> Iterator[Table]:
    """The tables in a schema: itself, the members of a union, the items of a list, the values of a table by names."""
    if not is_table(part):
        return
    yield part
    for way in ("anyOf", "oneOf"):
        for each in cast(list[object], part.get(way, [])):
            yield from _within(each)
    yield from _within(part.get("items"))
    yield from _within(part.get("additionalProperties"))


def _types(table: Table) -> list[str]:
    """The types that a table can have, where it has a key for them."""
    properties = table.get("properties")
    kind = properties.get("type") if is_table(properties) else None
    if not is_table(kind):
        return [""]
    many = kind.get("enum")
    return [str(each) for each in many] if is_list(many) else [str(kind["const"])]
