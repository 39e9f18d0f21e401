"""`wsph list`: what a scene can name, by groups; and one of them, with all that there is to say of it."""

# pyright: strict

import argparse
import dataclasses
import json
import textwrap
from typing import TYPE_CHECKING

from wsph.cli.command import Command

if TYPE_CHECKING:
    from wsph.catalogue.entries import Described
    from wsph.catalogue.keys import Key

WIDTH = 120


def _declare(parser: argparse.ArgumentParser) -> None:
    from wsph.catalogue import groups

    known = ", ".join(groups.every())
    parser.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help=f"a group ({known}), or the name of anything in one, or of a scene's table",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")


def _act(options: argparse.Namespace) -> int:
    from wsph.catalogue import groups
    from wsph.plugins import registry

    if options.name in groups.GROUPS:
        return _list_own(options.name, options.json)
    if options.name is not None and options.name not in registry.GROUPS:
        return _describe(options.name, options.json)
    chosen = [options.name] if options.name else list(registry.GROUPS)
    found = [entry for group in chosen for entry in registry.described(group)]
    if options.json:
        print(json.dumps([dataclasses.asdict(entry) for entry in found], indent=2))
        return 0
    for entry in found:
        print(
            f"{entry.group[:-1]:<11} {entry.name:<14} {entry.distribution} {entry.version:<8} {entry.status:<4} {entry.description}"
        )
    return 0


def _list_own(group: str, as_json: bool) -> int:
    """List the entries of wsph itself in a group; no plugin is looked for."""
    from wsph.catalogue import groups

    rows = groups.GROUPS[group]()
    if as_json:
        found = [{"group": group, "name": row.name, "description": row.description, **row.data} for row in rows]
        print(json.dumps(found, indent=2))
        return 0
    for row in rows:
        print(f"{group[:-1]:<11} {row.name:<18} {row.description}")
        for words in row.words:
            print(f"{'':<31}{words}")
    return 0


def _describe(name: str, as_json: bool) -> int:
    """Say all that there is to say of what has a name."""
    from wsph.catalogue.entries import find

    found = find(name)
    if as_json:
        print(json.dumps([dataclasses.asdict(each) for each in found], indent=2))
        return 0
    print("\n\n".join("\n".join(_told(each)) for each in found))
    return 0


def _told(each: "Described") -> list[str]:
    lines = [f"{each.name} ({each.group}): {each.source}"]
    for paragraph in each.description.split("\n\n"):
        lines += textwrap.wrap(" ".join(paragraph.split()), WIDTH, initial_indent="  ", subsequent_indent="  ")
    lines += [
        line
        for words in each.words
        for line in textwrap.wrap(words, WIDTH, initial_indent="  ", subsequent_indent="    ")
    ]
    lines += _table(each.keys)
    return lines + (["", *each.example.splitlines()] if each.example else [])


def _table(keys: "tuple[Key, ...]") -> list[str]:
    """Keys as a table, as wide as it has to be."""
    if not keys:
        return []
    rows = [
        ("key", "unit", "default", "range", "what it is"),
        *((k.name, k.unit, k.default, k.range, k.words) for k in keys),
    ]
    widths = [max(len(row[column]) for row in rows) for column in range(4)]
    return [
        "",
        *(
            "  ".join([*(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=False)), row[4]]).rstrip()
            for row in rows
        ),
    ]


LIST = Command(
    "list", "list what a scene can name (default: installed integrators and materials), or describe it", _declare, _act
)
