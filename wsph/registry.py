"""Plugins by entry point: listed without being imported, loaded only when a scene names them.

A plugin is any installed distribution with an entry point in the group `wsph.integrators` or `wsph.materials`. One that
is broken, or whose name two distributions claim, is listed as such and harms only the scene that names it.
"""

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata

from wsph.errors import PluginError

GROUPS = {"integrators": "wsph.integrators", "materials": "wsph.materials"}


@dataclass(frozen=True)
class Entry:
    """One registered name. `distribution` and `version` say who ships it; `status` is "ok" or what is wrong with it."""

    group: str
    name: str
    target: str
    distribution: str
    version: str
    status: str = "ok"


def entries(group: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> list[Entry]:
    """Every entry of a group ("integrators", "materials"), sorted by name, without importing a plugin."""
    found: dict[tuple[str, str, str], Entry] = {}
    for point in installed(group=GROUPS[group]):
        distribution = point.dist
        name, version = (distribution.name, distribution.version) if distribution else ("unknown", "?")
        # An editable install and the checkout it points at report the same distribution twice.
        found[point.name, point.value, name] = Entry(group, point.name, point.value, name, version)
    every = sorted(found.values(), key=lambda e: (e.name, e.distribution))
    owners: dict[str, list[Entry]] = {}
    for entry in every:
        owners.setdefault(entry.name, []).append(entry)
    return [
        entry
        if len(owners[entry.name]) == 1
        else Entry(
            *_fields(entry),
            status="duplicate: also in "
            + ", ".join(sorted({o.distribution for o in owners[entry.name] if o is not entry})),
        )
        for entry in every
    ]


def _fields(entry: Entry) -> tuple[str, str, str, str, str]:
    return entry.group, entry.name, entry.target, entry.distribution, entry.version


def find(group: str, name: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> Entry:
    """The one entry of that name. Raises PluginError: unknown (with the nearest names) or claimed twice."""
    every = entries(group, installed)
    matching = [e for e in every if e.name == name]
    if not matching:
        names = sorted({e.name for e in every})
        close = difflib.get_close_matches(name, names, 1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        raise PluginError(f"no entry named {name!r} in {GROUPS[group]}; {hint}Installed: {', '.join(names) or 'none'}")
    if len(matching) > 1:
        who = " and ".join(f"{e.distribution} {e.version} ({e.target})" for e in matching)
        raise PluginError(f"{name!r} in {GROUPS[group]} is claimed by {who}: uninstall one of them")
    return matching[0]


def load(group: str, name: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> type:
    """Import the plugin class registered under `name`. Raises PluginError naming the distribution at fault."""
    entry = find(group, name, installed)
    point = next(p for p in installed(group=GROUPS[group]) if p.name == name)
    try:
        plugin = point.load()
    except (
        Exception,
        SystemExit,
    ) as error:  # whatever a third party's import raises, the scene's author needs to know whose it is
        raise PluginError(
            f"{name!r} in {GROUPS[group]} ({entry.target}, from {entry.distribution} {entry.version}) cannot be imported: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(plugin, type):
        raise PluginError(
            f"{name!r} in {GROUPS[group]} ({entry.target}, from {entry.distribution} {entry.version}) is not a class"
        )
    return plugin


def origin(group: str, name: str) -> str:
    """ "distribution version" of a registered name, for error messages and summaries."""
    entry = find(group, name)
    return f"{entry.distribution} {entry.version}"
