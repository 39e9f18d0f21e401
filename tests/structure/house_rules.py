"""Rules for who may know what. Each takes a module and yields its breaches, "path:line: what is wrong"."""

import ast
import sys
from collections.abc import Iterator

from import_graph import imports
from syntax import Function, Module, dotted, nodes

BACKEND = "wsph.backend"
BELOW_BACKEND = (BACKEND, "wsph.errors", "wsph.units", "wsph.protocols", "wsph.reporting")
FOR_PLUGINS = ("wsph.protocols", "wsph.reporting", "wsph.stability.regions", "wsph.testing")
PROBES = "wsph/plugins/"
"""Where plugins are asked what they have: once, so that all others read an answer."""
FORMULATIONS = "wsph/formulations/"
NAMES = frozenset({"small-strain", "total-lagrangian", "stress-points", "updated-lagrangian"})
"""Names of formulations, as scenes write them."""
NAMED_TUPLE = frozenset({"_replace", "_asdict", "_fields", "_make"})
"""Public in spite of their names: Python's own way to keep them apart from fields."""


def no_foreign_private_names(module: Module) -> Iterator[str]:
    """No name that begins with an underscore is imported, or read of anything but self, cls and super(), unless a class of
    the same file declares it: what is private can change without a look at other files."""
    classes = [node for node in nodes(module) if isinstance(node, ast.ClassDef)]
    declared = {name for each in classes for statement in each.body for name in _declared(statement)}
    library = _standard_library(module)
    for node in nodes(module):
        if isinstance(node, ast.Attribute) and _private(node.attr) and node.attr not in declared:
            if dotted(node.value) not in {"self", "cls", "super", *library}:
                yield f"{module.path}:{node.lineno}: reads {ast.unparse(node)}"
        elif isinstance(node, ast.ImportFrom):
            taken = [alias.name for alias in node.names if _private(alias.name)]
            yield from (f"{module.path}:{node.lineno}: imports {name}" for name in taken)


def no_probes(module: Module) -> Iterator[str]:
    """Outside of the room for plugins nothing asks whether an object has a named attribute. What the platform has
    (`os.sched_setaffinity`), and what Python itself adds (`__args__`), may be asked anywhere."""
    library = _standard_library(module)
    for node in nodes(module) if not module.path.startswith(PROBES) else ():
        if isinstance(node, ast.Call) and dotted(node) in ("getattr", "hasattr") and len(node.args) > 1:
            asked, name = node.args[:2]
            named = isinstance(name, ast.Constant) and isinstance(name.value, str) and not name.value.startswith("__")
            if named and dotted(asked).partition(".")[0] not in library:
                yield f"{module.path}:{node.lineno}: {ast.unparse(node)}"


def no_questions_for_the_formulation(module: Module) -> Iterator[str]:
    """Outside of the room for formulations nothing asks which one it has, by the class of a system or by name: it asks
    what it can do. Tables of names and messages compare nothing."""
    if module.path.startswith(FORMULATIONS):
        return
    for node in nodes(module):
        compared: list[ast.expr | ast.pattern] = []
        if isinstance(node, ast.Call) and dotted(node) in ("isinstance", "issubclass") and len(node.args) == 2:
            if any(dotted(kind).endswith("System") for kind in ast.walk(node.args[1])):
                yield f"{module.path}:{node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.Compare):
            compared = [node.left, *node.comparators]
        elif isinstance(node, ast.match_case):
            compared = [node.pattern]
        strings = {n.value for part in compared for n in ast.walk(part) if isinstance(n, ast.Constant)}
        if strings & NAMES:
            yield f"{module.path}:{compared[0].lineno}: asks whether it is {' or '.join(sorted(strings & NAMES))}"


def the_backend_knows_no_other_room(module: Module) -> Iterator[str]:
    """How something runs on a device has no mechanics in it: nothing of the rooms above is imported."""
    if _within(module.name, (BACKEND,)):
        yield from _imports_beyond(module, BELOW_BACKEND)


def plugins_use_public_names(module: Module) -> Iterator[str]:
    """Plugins import of wsph what is promised to them, so that all else can change."""
    yield from _imports_beyond(module, FOR_PLUGINS)


def _imports_beyond(module: Module, allowed: tuple[str, ...]) -> Iterator[str]:
    """Imports of wsph that are not of the modules allowed or of what is in them."""
    for found in imports(module):
        if _within(found.target, ("wsph",)) and not _within(found.target, allowed):
            yield f"{module.path}:{found.line}: imports {found.target}"


def _within(name: str, modules: tuple[str, ...]) -> bool:
    return any(name == module or name.startswith(f"{module}.") for module in modules)


def _declared(statement: ast.stmt) -> list[str]:
    """Names that a statement of a class body gives to the class."""
    if isinstance(statement, ast.AnnAssign | ast.Assign):
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        return [target.id for target in targets if isinstance(target, ast.Name)]
    return [statement.name] if isinstance(statement, Function) else []


def _standard_library(module: Module) -> set[str]:
    """Modules of Python's own library that are imported whole, by the names they have here."""
    names = (alias for node in nodes(module) if isinstance(node, ast.Import) for alias in node.names)
    return {a.asname or a.name for a in names if a.name.partition(".")[0] in sys.stdlib_module_names}


def _private(name: str) -> bool:
    """One underscore in front; `_length_`, of ctypes and of Warp's types, has one on either side and is public."""
    return name.startswith("_") and not name.endswith("_") and not name.startswith("__") and name not in NAMED_TUPLE
