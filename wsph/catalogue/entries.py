"""All that a scene can name or write, by its name: its keys with units, defaults and ranges, its source, an example."""

# pyright: strict

import difflib
import inspect
from collections.abc import Iterator
from dataclasses import dataclass, field

from wsph.catalogue import groups
from wsph.catalogue.examples import example_of, toml
from wsph.catalogue.keys import Key, keys_of
from wsph.catalogue.schema import plugin_schema
from wsph.catalogue.tables import places, root
from wsph.errors import WsphError
from wsph.plugins import registry
from wsph.scene.messages import LISTS_OF_TABLES


@dataclass(frozen=True)
class Described:
    """What has a name: the `group` that it is of, where it comes from, what its docstring says, its keys, what else there is
    to say of it, and an example, as a scene has it."""

    group: str
    name: str
    source: str
    description: str
    keys: tuple[Key, ...] = ()
    words: tuple[str, ...] = ()
    example: str = ""
    data: dict[str, object] = field(default_factory=dict[str, object])


def find(name: str) -> list[Described]:
    """All that has that name: plugins, what wsph itself has, tables of a scene. Raises WsphError where nothing has, with the
    nearest names."""
    found = [*_plugins(name), *_own(name), *_tables(name)]
    if not found:
        near = difflib.get_close_matches(name, names(), 3)
        hint = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
        lists = ", ".join(groups.every())
        raise WsphError(f"nothing that a scene can have is named {name!r}{hint} (lists: {lists})")
    return found


def names() -> list[str]:
    """The names of all that can be described."""
    every = [entry.name for group in registry.GROUPS for entry in registry.entries(group)]
    every += [row.name for make in groups.GROUPS.values() for row in make()]
    return [*every, *(path.rpartition(".")[2] for path, _ in places())]


def _plugins(name: str) -> Iterator[Described]:
    for group, key in (("materials", "bodies.material"), ("integrators", "run.integrator")):
        for entry in registry.described(group):
            if entry.name != name:
                continue
            source = f"{entry.distribution} {entry.version}, {entry.target}"
            if entry.status != "ok":
                yield Described(group, name, source, entry.status)
                continue
            schema = plugin_schema(group, name)
            shown = toml(f"[{key}]", example_of(schema, schema))
            yield Described(group, name, source, str(schema["description"]), tuple(keys_of(schema)), (), shown)


def _own(name: str) -> Iterator[Described]:
    for group, make in groups.GROUPS.items():
        if group in ("parts", "shapes", "tables"):
            continue  # told as tables of the scene
        for row in make():
            if row.name == name:
                source = row.source or f"wsph, {make.__module__}"
                said = row.description if row.described is None else inspect.getdoc(row.described) or ""
                yield Described(group, name, source, said, (), row.words, row.example, dict(row.data))


def _tables(name: str) -> Iterator[Described]:
    schemas = root()
    rows = {row.name: row for row in groups.parts()}
    for path, schema in places():
        if name not in (path, path.rpartition(".")[2]):
            continue
        row = rows.get(name)
        keys, said = tuple(keys_of(schema, schemas)), str(schema.get("description", ""))
        example = example_of(schema, schemas)
        header = path.removesuffix(f".{example['type']}") if "type" in example else path
        words = row.words if row is not None else ()
        group = "parts" if row is not None else "shapes" if ".shape." in path else "tables"
        yield Described(group, name, f"wsph, key {header}", said, keys, words, toml(_header(header), example))


def _header(path: str) -> str:
    """The header of a table at a path: [[bodies]], [bodies.material]."""
    first, _, rest = path.partition(".")
    listed = (first in LISTS_OF_TABLES and not rest) or path in ("bodies.cracks", "bodies.body_force")
    return f"[[{path}]]" if listed else f"[{path}.NAME]" if path == "functions" else f"[{path}]"
