"""Who imports whom: the edges between modules and between rooms, and the circles in them."""

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

from syntax import Function, Module

Graph = dict[str, set[str]]


@dataclass(frozen=True)
class Import:
    """An import of `target`: a module, or a name in one. `lazy` are those inside of functions."""

    target: str
    line: int
    lazy: bool


@cache
def imports(module: Module) -> tuple[Import, ...]:
    """All imports of a module. Those for type checkers alone count: who reads a file has to follow them as well."""
    return tuple(_found(module))


def _found(module: Module) -> Iterator[Import]:
    pending: list[tuple[ast.AST, bool]] = [(module.tree, False)]
    while pending:
        node, lazy = pending.pop()
        if isinstance(node, ast.Import):
            yield from (Import(alias.name, node.lineno, lazy) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (Import(f"{_base(module, node)}.{alias.name}", node.lineno, lazy) for alias in node.names)
        pending += [(child, lazy or isinstance(node, Function)) for child in ast.iter_child_nodes(node)]


def _base(module: Module, node: ast.ImportFrom) -> str:
    """The absolute name of what `from ... import` names."""
    if not node.level:
        return node.module or ""
    package = module.package.split(".")
    start = package[: len(package) - node.level + 1]
    return ".".join([*start, *([node.module] if node.module else [])])


def module_graph(modules: Iterable[Module], lazy: bool = False) -> Graph:
    """Edges between modules; with `lazy` those of imports inside of functions too."""
    modules = list(modules)
    known = {module.name for module in modules}
    graph: Graph = {name: set() for name in known}
    for module in modules:
        for found in imports(module):
            target = found.target if found.target in known else found.target.rpartition(".")[0]
            if target in known and target != module.name and (lazy or not found.lazy):
                graph[module.name].add(target)
    return graph


def room_graph(modules: Iterable[Module], lazy: bool = False) -> Graph:
    """Edges between rooms: the top-level folders and files of wsph, and the plugin packages."""
    modules = list(modules)
    room = {module.name: module.room for module in modules}
    graph: Graph = {name: set() for name in room.values()}
    for source, targets in module_graph(modules, lazy).items():
        graph[room[source]] |= {room[target] for target in targets} - {room[source]}
    return graph


def circles(graph: Graph) -> list[list[str]]:
    """Groups in which each reaches each, largest first; of each a shortest circle, whose first and last are the same."""
    reached = {name: _reached(graph, name) for name in graph}
    groups = {frozenset(other for other in reached[name] if name in reached[other]) for name in graph}
    ordered = sorted(groups - {frozenset()}, key=lambda group: (-len(group), min(group)))
    return [min((_way_back(graph, name, group) for name in sorted(group)), key=len) for group in ordered]


def _reached(graph: Graph, start: str) -> set[str]:
    """What can be reached from `start` by at least one edge."""
    seen: set[str] = set()
    pending = [start]
    while pending:
        new = graph[pending.pop()] - seen
        seen |= new
        pending += new
    return seen


def _way_back(graph: Graph, start: str, group: frozenset[str]) -> list[str]:
    """A shortest way from `start` back to it, in breadth."""
    ways, seen = [[start]], set()
    for way in ways:
        for name in sorted(graph[way[-1]] & group):
            if name == start:
                return [*way, name]
            if name not in seen:
                seen.add(name)
                ways.append([*way, name])
    raise ValueError(f"{start} is on no circle")
