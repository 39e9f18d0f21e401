"""The references of the methods that a run was made with, as BibTeX: what their docstrings cite, as "Author & Author 2011".

Entries stand in references.bib beside this file; a plugin may bring its own, in `references`.
"""

# pyright: strict

import ast
import importlib.util
import re
from collections.abc import Iterator
from importlib import metadata, resources
from pathlib import Path

from wsph.errors import PluginError
from wsph.plugins import integrators, registry
from wsph.plugins.declared import references
from wsph.plugins.formulations import Formulation, of_sets
from wsph.quantities import Table, is_list, is_table

CITED = re.compile(r"\b([A-Z][a-z]+)(?:,? (?:&|and) [A-Z][a-z]+| et al\.?)?,? \(?((?:19|20)\d\d)\b")
"""An author, perhaps with another, and a year."""

CONTACT = {"surface": "meeting", "pinball": "pinball", "tie": "ties"}
"""Rooms of the laws of contact."""


def bibliography(scene: Table) -> str:
    """The BibTeX entries of a scene's methods, each under what cites it; of wsph and Warp first."""
    entries = _entries()
    version = metadata.version("wsph")
    uses: dict[str, list[str]] = {"wsph": ["wsph"], "warp": ["wsph"]}
    own: dict[str, list[str]] = {}
    for method, said, brought in methods(scene):
        for author, year in CITED.findall(said):
            if (key := f"{author.lower()}{year}") in entries:
                uses.setdefault(key, []).append(method)
        for entry in brought:
            own.setdefault(entry.strip(), []).append(method)
    found = {entries[key].replace("$version", version): who for key, who in uses.items()} | own
    return "\n\n".join(f"% {', '.join(dict.fromkeys(who))}\n{entry}" for entry, who in found.items())


def methods(scene: Table) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """The methods of a scene: what each is called, what its docstrings say, and the entries that it brings."""
    run, bodies = scene.get("run"), scene.get("bodies")
    given = run if is_table(run) else {}
    integrator = given.get("integrator")
    name = str(integrator.get("name") if is_table(integrator) else integrator)
    yield from _plugin("integrators", name)
    if (form := _formulation(name, given.get("formulation"))) is not None:
        yield f"formulation {form.name}", _room(form.target.partition(":")[0].rpartition(".")[0]), ()
        if given.get("kernel") or given.get("support") or not (form.traits.corners or form.traits.edges):
            from wsph.sph.smoothing import DEFAULT, SMOOTHING

            kernel = str(given.get("kernel", DEFAULT))
            yield f"kernel {kernel}", SMOOTHING[kernel].__doc__ or "", ()
    for body in bodies if is_list(bodies) else []:
        if is_table(body):
            yield from _of_body(body)
    yield from _around(scene)


def _of_body(body: Table) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    from wsph.parts.table import PARTS

    material = body.get("material")
    if is_table(material):
        yield from _plugin("materials", str(material.get("model")))
    for key in (key for key in PARTS if body.get(key) not in (None, False)):
        module = PARTS[key].__module__
        room = module.rpartition(".")[0]
        yield key, _room(room) if room != "wsph.parts" else _module(module), ()


def _around(scene: Table) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """What acts on bodies and between them."""
    from wsph.boundary.loads.table import LOADS

    for boundary in _tables(scene.get("boundary")):
        for key in (key for key in LOADS if key in boundary):
            yield key, _module(LOADS[key].__module__), ()
    for contact in _tables(scene.get("contact")):
        law = str(contact.get("law", "surface"))
        yield f"contact, {law}", _room(f"wsph.contact.{CONTACT[law]}"), ()
    if scene.get("tools"):
        yield "tools", _room("wsph.contact.tools"), ()
    if "relax" in scene or any("relax" in step for step in _tables(scene.get("steps"))):
        yield "relax", _room("wsph.simulation.starting"), ()


def _tables(value: object) -> list[Table]:
    return [each for each in value if is_table(each)] if is_list(value) else []


def _plugin(group: str, name: str) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """What a plugin's class and its module say. One that is not installed here says nothing."""
    try:
        plugin, target = registry.load(group, name), registry.find(group, name).target
    except PluginError:
        return
    module = target.partition(":")[0]
    said = [
        _docstring(module),
        *(" ".join((base.__doc__ or "").split()) for base in plugin.__mro__ if base.__module__ == module),
    ]
    yield f"{group[:-1]} {name}", " ".join(said), references(plugin)


def _formulation(integrator: str, named: object) -> Formulation | None:
    """The formulation that a scene names, or the default of its integrator."""
    try:
        plugin = registry.load("integrators", integrator)
    except PluginError:
        return None
    known = of_sets(integrators.sets(plugin))
    name = str(named) if named else integrators.offered(plugin, list(known))[0]
    return known.get(name)


def _room(package: str) -> str:
    """The docstrings of all modules of a room."""
    spec = importlib.util.find_spec(package)
    folders = [Path(folder) for folder in (spec.submodule_search_locations or [])] if spec else []
    return " ".join(_docstrings(path) for folder in folders for path in sorted(folder.glob("*.py")))


def _module(name: str) -> str:
    spec = importlib.util.find_spec(name)
    return _docstrings(Path(spec.origin)) if spec and spec.origin else ""


def _docstring(name: str) -> str:
    """The docstring of a module."""
    spec = importlib.util.find_spec(name)
    path = Path(spec.origin) if spec and spec.origin else None
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "" if path else ""


def _docstrings(path: Path) -> str:
    """All that stands in docstrings of a file, those below attributes included."""
    nodes = (node.value for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Expr))
    said = (node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return " ".join(" ".join(each.split()) for each in said)


def _entries() -> dict[str, str]:
    """The entries of references.bib by their keys."""
    text = (resources.files("wsph.catalogue") / "references.bib").read_text(encoding="utf-8")
    found = (re.match(r"@\w+\{(\w+),", entry) for entry in text.strip().split("\n\n"))
    return {match[1]: match.string for match in found if match}
