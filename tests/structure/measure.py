"""What is measured of the packages, each as a number or as a list of places that a reader can go to."""

import ast
import io
import tokenize
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from statistics import median, quantiles

from syntax import Function, Module, arguments, dotted, functions, is_device_code, kernels, length


@dataclass(frozen=True)
class Size:
    """Something that has a size: how much, what, and where."""

    size: int
    what: str

    def __str__(self) -> str:
        return f"{self.size:4d}  {self.what}"


def middle(sizes: list[Size]) -> float:
    """The median."""
    return median(item.size for item in sizes)


def ninetieth(sizes: list[Size]) -> float:
    """What nine of ten do not exceed."""
    return quantiles((item.size for item in sizes), n=10, method="inclusive")[8]


def above(sizes: Iterable[Size], bound: int) -> list[Size]:
    """Those above a bound, largest first."""
    return sorted((item for item in sizes if item.size > bound), key=lambda item: -item.size)


def top_modules(modules: Iterable[Module]) -> list[str]:
    """Files directly in wsph/, its `__init__.py` not counted."""
    return [module.path for module in modules if module.path.count("/") == 1 and not module.initial]


def folders(modules: Iterable[Module]) -> list[Size]:
    """Entries of every folder: its files without `__init__.py`, and its subfolders, whose files are counted there."""
    entries: dict[PurePosixPath, set[str]] = {}
    for module in modules:
        path = PurePosixPath(module.path)
        entries.setdefault(path.parent, set()).update(set() if module.initial else {path.name})
    for folder in list(entries):
        if folder.parent in entries:
            entries[folder.parent].add(folder.name)
    return [Size(len(names), f"{folder}/") for folder, names in sorted(entries.items())]


def file_lengths(modules: Iterable[Module]) -> list[Size]:
    """Lines of every file. An `__init__.py` without code is left out: empty ones would press the median."""
    return [Size(len(m.text.splitlines()), m.path) for m in modules if not m.initial or _statements(m)]


def function_lengths(modules: Iterable[Module]) -> list[Size]:
    """Lines of every function, with those nested in it: one that makes kernels is as long as they are together."""
    return [Size(length(f), _place(m, f)) for m in modules for f in functions(m)]


def kernel_lengths(modules: Iterable[Module]) -> list[Size]:
    """Lines of every kernel, its arguments included."""
    return [Size(length(f), _place(m, f)) for m in modules for f in kernels(m)]


def kernel_arguments(modules: Iterable[Module]) -> list[Size]:
    """Number of arguments of every kernel."""
    return [Size(len(arguments(f)), _place(m, f)) for m in modules for f in kernels(m)]


def unformatted(modules: Iterable[Module]) -> list[Size]:
    """How often each file keeps the formatter out, by `# fmt: skip` or `# fmt: off`."""
    counts = ((m, sum(_comments(m, mark) for mark in ("# fmt: skip", "# fmt: off"))) for m in modules)
    return above((Size(count, m.path) for m, count in counts), 0)


def untyped(modules: Iterable[Module]) -> list[Size]:
    """How often each file says `Any` of a public name: of an argument, a result or an attribute. What is public is what
    another room may use; whether one does is not asked."""
    return above((Size(sum(map(_says_any, _public(m.tree))), m.path) for m in modules), 0)


def checkable(modules: Iterable[Module]) -> list[Module]:
    """Files that a type checker can read to the last line: with code, and without kernels and Warp functions."""
    return [m for m in modules if _statements(m) and not any(map(is_device_code, functions(m)))]


def is_strict(module: Module) -> bool:
    """Whether `# pyright: strict` stands on a line of its own above the first statement."""
    lines = module.text.splitlines()
    statements = _statements(module)
    return "# pyright: strict" in lines[: statements[0].lineno - 1 if statements else len(lines)]


def layers(project: dict[str, object]) -> int:
    """Import layers in the longest contract of that kind in pyproject.toml."""
    found: object = project
    for key in ("tool", "importlinter", "contracts"):
        found = found.get(key, {}) if isinstance(found, dict) else {}
    contracts = found if isinstance(found, list) else []
    return max((len(contract["layers"]) for contract in contracts if contract["type"] == "layers"), default=0)


def _statements(module: Module) -> list[ast.stmt]:
    """The statements of a module without its docstring."""
    return module.tree.body[1:] if ast.get_docstring(module.tree, clean=False) is not None else module.tree.body


def _place(module: Module, function: Function) -> str:
    return f"{module.path}:{function.lineno} {function.name}"


def _comments(module: Module, mark: str) -> int:
    """Comments that begin with `mark`; a string that holds it is none."""
    if mark not in module.text:
        return 0
    tokens = tokenize.generate_tokens(io.StringIO(module.text).readline)
    return sum(token.type == tokenize.COMMENT and token.string.startswith(mark) for token in tokens)


def _public(tree: ast.Module | ast.ClassDef) -> Iterator[ast.expr]:
    """Annotations of public names: of functions, methods, and attributes, in the class or on self."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from _public(node)
        elif isinstance(node, ast.AnnAssign):
            yield from _annotated(node)
        elif isinstance(node, Function) and (not node.name.startswith("_") or node.name.endswith("__")):
            yield from _signature(node)
        if isinstance(node, Function) and isinstance(tree, ast.ClassDef):
            for inner in ast.walk(node):
                if isinstance(inner, ast.AnnAssign) and isinstance(inner.target, ast.Attribute):
                    yield from _annotated(inner)


def _annotated(node: ast.AnnAssign) -> Iterator[ast.expr]:
    name = node.target.attr if isinstance(node.target, ast.Attribute) else getattr(node.target, "id", "")
    if not name.startswith("_"):
        yield node.annotation


def _signature(function: Function) -> Iterator[ast.expr]:
    a = function.args
    every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *(argument for argument in (a.vararg, a.kwarg) if argument)]
    yield from (argument.annotation for argument in every if argument.annotation is not None)
    if function.returns is not None:
        yield function.returns


def _says_any(annotation: ast.expr) -> bool:
    """Whether `Any` stands in it, in an annotation that is a string too."""
    for node in ast.walk(annotation):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            try:
                if _says_any(ast.parse(node.value, mode="eval").body):
                    return True
            except SyntaxError:  # a string in Literal[...] is no annotation
                continue
        if isinstance(node, ast.Name | ast.Attribute) and dotted(node).rpartition(".")[2] == "Any":
            return True
    return False
