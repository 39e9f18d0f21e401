"""Plugins by entry point: listed without being imported, loaded only when a scene names them.

A plugin is any installed distribution with an entry point in the group `wsph.integrators` or `wsph.materials`. One that
is broken, or whose name two distributions claim, is listed as such and harms only the scene that names it.
"""

# pyright: strict

import ast
import dataclasses
import difflib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

from wsph.errors import PluginError

GROUPS = {"integrators": "wsph.integrators", "materials": "wsph.materials"}


@dataclass(frozen=True)
class Entry:
    """One registered name. `distribution` and `version` say who ships it; `status` is "ok" or what is wrong with it;
    `description` is the first line of the class's docstring, read from its source."""

    group: str
    name: str
    target: str
    distribution: str
    version: str
    status: str = "ok"
    description: str = ""


def entries(group: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> list[Entry]:
    """Every entry of a group ("integrators", "materials"), sorted by name, without importing a plugin."""
    return list(_entries(group, installed))


@cache
def _entries(group: str, installed: Callable[..., metadata.EntryPoints]) -> tuple[Entry, ...]:
    """Found once a process: reading the metadata of all that is installed takes 10 ms."""
    found: dict[tuple[str, str, str], Entry] = {}
    for point in installed(group=GROUPS[group]):
        distribution = point.dist
        name, version = (distribution.name, distribution.version) if distribution else ("unknown", "?")
        # An editable install and the checkout it points at report the same distribution twice.
        found[point.name, point.value, name] = Entry(group, point.name, point.value, name, version)
    every = sorted(found.values(), key=lambda e: (e.name, e.distribution))
    owners: dict[str, set[str]] = {}
    for entry in every:
        owners.setdefault(entry.name, set()).add(f"{entry.distribution} ({entry.target})")
    return tuple(_with_owners(entry, owners[entry.name]) for entry in every)


def described(group: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> list[Entry]:
    """`entries` with what their sources say: a description, and a status where there is no such module."""
    return [_with_source(entry) for entry in entries(group, installed)]


def _with_source(entry: Entry) -> Entry:
    status, description = _describe(entry.target)
    return dataclasses.replace(entry, status=entry.status if status == "ok" else status, description=description)


def _with_owners(entry: Entry, owners: set[str]) -> Entry:
    others = sorted(owners - {f"{entry.distribution} ({entry.target})"})
    return dataclasses.replace(entry, status="duplicate: also in " + ", ".join(others)) if others else entry


def _describe(target: str) -> tuple[str, str]:
    """Status and docstring of an entry's class from its source file, importing nothing of the plugin."""
    module, _, name = target.partition(":")
    top, *rest = module.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):
        spec = None
    folders = list(spec.submodule_search_locations or []) if spec else []
    stem = Path(*rest) if rest else Path("__init__")
    files = [Path(folder) / f for folder in folders for f in (stem.with_suffix(".py"), stem / "__init__.py")]
    files += [Path(spec.origin)] if spec and spec.origin and not rest else []
    source = next((f for f in files if f.is_file()), None)
    if spec is None or (source is None and folders):
        return f"broken: there is no module {module}", ""
    try:
        tree = ast.parse(source.read_text(encoding="utf-8")) if source else ast.Module([], [])
    except (OSError, SyntaxError, ValueError) as error:
        return f"broken: {source} cannot be read: {error}", ""
    classes = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name.split(".")[0])
    text = next((ast.get_docstring(node) or "" for node in classes), "")
    return "ok", text.strip().splitlines()[0] if text.strip() else ""


def find(group: str, name: str, installed: Callable[..., metadata.EntryPoints] = metadata.entry_points) -> Entry:
    """The one entry of that name. Raises PluginError: unknown (with the nearest names) or claimed twice."""
    every = entries(group, installed)
    matching = [e for e in every if e.name == name]
    if not matching:
        # It may have been installed since.
        _entries.cache_clear()
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
    point = metadata.EntryPoint(entry.name, entry.target, GROUPS[group])
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


def name_of(group: str, plugin: type) -> str:
    """The name that a plugin's class is registered under. Raises PluginError where it is not."""
    target = f"{plugin.__module__}:{plugin.__qualname__}"
    for entry in entries(group):
        if entry.target == target:
            return entry.name
    raise PluginError(f"{target} is not registered in {GROUPS[group]}: its distribution has no entry point for it")


def is_ours(group: str, plugin: type) -> bool:
    """Whether a plugin's class comes with wsph itself."""
    target = f"{plugin.__module__}:{plugin.__qualname__}"
    return any(entry.target == target and entry.distribution == "wsph" for entry in entries(group))


def origin(group: str, name: str) -> str:
    """ "distribution version" of a registered name, for error messages and summaries."""
    entry = find(group, name)
    return f"{entry.distribution} {entry.version}"
