"""Which files name a part of physics in code.

A part that a body may have or not (viscosity, a phase field, ...) should be in one place. Here its words are looked for in
identifiers, names of attributes, keywords and strings; docstrings and comments may say what they like.
"""

import ast
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

from syntax import Function, Module, nodes, prose

ROOM = "wsph/parts/"
"""Where parts live: all files in it count as one, which is not counted."""
CONTRACT = "wsph/protocols.py"
"""What plugins see; it may say which parts a system has."""
USERS = ("validation", "wsph_integrators", "wsph_materials")
"""Rooms whose mentions are listed, not counted: validation writes scenes, in the words of any author of one; plugins can
only repeat what the contract says."""


@dataclass(frozen=True)
class Part:
    """A part of physics: its words, and what of the same words means something else. `elsewhere` are phrases, `inside`
    names of functions."""

    name: str
    words: frozenset[str]
    elsewhere: tuple[str, ...] = ()
    inside: tuple[str, ...] = ()


PARTS = (
    # Drag is the sum of all forces that depend on velocities: any part may add to it.
    Part("viscosity", frozenset({"viscosity", "viscous"})),
    Part("hourglass", frozenset({"hourglass"})),
    Part(
        "residual",
        frozenset({"residual"}),
        # A study's column: what the energy ledger does not explain.
        elsewhere=("energy residual",),
        # Arnoldi's: how well an eigenvalue of the growth of a step is resolved.
        inside=("largest_growth",),
    ),
    # What opposes tension is the artificial stress itself. Artificial viscosity is viscosity.
    Part("artificial stress", frozenset({"artificial", "opposing"}), elsewhere=("artificial viscosity",)),
    # Links of a file system.
    Part("links", frozenset({"link", "links"}), elsewhere=("symbolic link",)),
    # AT1 and AT2 are the models of a phase field.
    Part("phase field", frozenset({"phase", "phases", "phased", "at1", "at2"})),
)

COLUMNS = frozenset({"hourglass", "residual"})
"""Columns of the energy ledger that are called as parts are. "hourglass" is the work of whatever holds spurious modes,
"residual" the external work less all other columns: neither is the part."""
BESIDE = frozenset({"kinetic", "external_work"})
"""Columns of the ledger that are nothing else: a string in one list, dict or call with one of them is a column as well."""
LEDGERS = frozenset({"energy", "last"})
"""Names of what is read by column: energy["residual"]."""

_WORD = re.compile(r"[A-Z]+\d*(?![a-z])|[A-Z]?[a-z]+\d*")


def words(text: str) -> list[str]:
    """Words of an identifier or a sentence: PhaseField, phase_field and "phase-field" are all phase, field."""
    return [word.lower() for word in _WORD.findall(text)]


def mentioned(module: Module, part: Part) -> list[int]:
    """Lines on which a module names a part in code."""
    found = set()
    for said, line, inside in _code(module):
        for phrase in part.elsewhere:
            said = said.replace(phrase, "")
        if part.words.intersection(said.split()) and not inside.intersection(part.inside):
            found.add(line)
    return sorted(found)


def mentions(modules: Iterable[Module], part: Part) -> tuple[list[str], list[str]]:
    """Files that name a part, other than its room and the contract; and, apart, those of users."""
    counted, users = [], []
    for module in modules:
        if not module.path.startswith(ROOM) and module.path != CONTRACT and (lines := mentioned(module, part)):
            (users if module.room in USERS else counted).append(f"{module.path}: {len(lines)} lines, first {lines[0]}")
    return counted, users


@cache
def _code(module: Module) -> tuple[tuple[str, int, frozenset[str]], ...]:
    """Every name and string in code that has to do with some part, in small words; its line, and the names of the
    functions around it."""
    every = frozenset().union(*(part.words for part in PARTS))
    said = ((" ".join(words(text)), line, inside) for text, line, inside in _texts(module))
    return tuple(item for item in said if every.intersection(item[0].split()))


def _texts(module: Module) -> Iterator[tuple[str, int, frozenset[str]]]:
    left_out = prose(module) | _columns(module)
    pending: list[tuple[ast.AST, int, frozenset[str]]] = [(module.tree, 1, frozenset())]
    while pending:
        node, line, inside = pending.pop()
        line = getattr(node, "lineno", line)
        if isinstance(node, Function):
            inside = inside | {node.name}
        # Names stand in fields of text, whatever the kind of node; so do strings.
        for _, value in ast.iter_fields(node) if id(node) not in left_out else ():
            values = value if isinstance(value, list) else [value]
            yield from ((text, line, inside) for text in values if isinstance(text, str))
        pending += [(child, line, inside) for child in ast.iter_child_nodes(node)]


def _columns(module: Module) -> set[int]:
    """Ids of the strings and keywords that are columns of the energy ledger."""
    found: set[int] = set()
    for node in nodes(module):
        if isinstance(node, ast.Subscript):
            last = node.value.attr if isinstance(node.value, ast.Attribute) else getattr(node.value, "id", "")
            group: list[ast.AST | None] = [node.slice] if last in LEDGERS else []
            known = True
        else:
            group = _beside(node)
            known = any(_text(item) in BESIDE for item in group)
        found |= {id(item) for item in group if known and _text(item) in COLUMNS}
    return found


def _beside(node: ast.AST) -> list[ast.AST | None]:
    """What stands side by side in a list, a tuple, a set, the keys of a dict, or the keywords of a call."""
    if isinstance(node, ast.List | ast.Tuple | ast.Set):
        return list(node.elts)
    if isinstance(node, ast.Dict):
        return list(node.keys)
    return list(node.keywords) if isinstance(node, ast.Call) else []


def _text(node: ast.AST | None) -> str:
    if isinstance(node, ast.keyword):
        return node.arg or ""
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
