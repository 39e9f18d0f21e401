"""`wsph list`: list what a scene can name (default: installed integrators and materials)."""

# pyright: strict

import argparse
import json

from wsph.cli.command import Command


def _declare(parser: argparse.ArgumentParser) -> None:
    from wsph import catalogue
    from wsph.plugins import registry

    parser.add_argument("group", nargs="?", choices=[*registry.GROUPS, *catalogue.GROUPS])
    parser.add_argument("--json", action="store_true", help="print JSON")


def _act(options: argparse.Namespace) -> int:
    from wsph import catalogue
    from wsph.plugins import registry

    if options.group in catalogue.GROUPS:
        return _list_own(options.group, options.json)
    groups = [options.group] if options.group else list(registry.GROUPS)
    found = [entry for group in groups for entry in registry.described(group)]
    if options.json:
        rows = [
            {
                "group": e.group,
                "name": e.name,
                "distribution": e.distribution,
                "version": e.version,
                "target": e.target,
                "status": e.status,
                "description": e.description,
            }
            for e in found
        ]
        print(json.dumps(rows, indent=2))
        return 0
    for entry in found:
        print(
            f"{entry.group[:-1]:<11} {entry.name:<14} {entry.distribution} {entry.version:<8} {entry.status:<4} {entry.description}"
        )
    return 0


def _list_own(group: str, as_json: bool) -> int:
    """List the entries of wsph itself in a group; no plugin is looked for."""
    from wsph import catalogue

    rows = catalogue.GROUPS[group]()
    if as_json:
        found = [{"group": group, "name": row.name, "description": row.description, **row.data} for row in rows]
        print(json.dumps(found, indent=2))
        return 0
    for row in rows:
        print(f"{group[:-1]:<11} {row.name:<18} {row.description}")
        for words in row.words:
            print(f"{'':<31}{words}")
    return 0


LIST = Command("list", "list what a scene can name (default: installed integrators and materials)", _declare, _act)
