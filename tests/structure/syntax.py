"""The packages as syntax trees: what the figures and the rules read.

Nothing is imported and nothing is run, so a check of the whole tree takes seconds and needs no device. No name of a file is
known here: the folders are walked, so a file that moves is found where it has gone.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {
    "wsph": ROOT / "wsph",
    "wsph_integrators": ROOT / "integrators" / "wsph_integrators",
    "wsph_materials": ROOT / "materials" / "wsph_materials",
}
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, eq=False)
class Module:
    """A file of a package: its dotted name, its path from the root of the project, and what stands in it."""

    name: str
    path: str
    text: str
    tree: ast.Module

    @property
    def initial(self) -> bool:
        """Whether it is the `__init__.py` of a package."""
        return self.path.endswith("__init__.py")

    @property
    def room(self) -> str:
        """The top-level folder or file of wsph that it is in; a plugin package is one room."""
        package, *rest = self.name.split(".")
        return rest[0] if package == "wsph" and rest else package

    @property
    def package(self) -> str:
        """What relative imports in it start from."""
        return self.name if self.initial else self.name.rpartition(".")[0]


def module(text: str, path: str) -> Module:
    """A module from its text. `path` is from the folder that the package lies in; the name follows from it."""
    name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return Module(name, path, text, ast.parse(text))


@cache
def modules_in(folder: Path) -> tuple[Module, ...]:
    """All modules of the package in `folder`."""
    found = []
    for file in sorted(folder.rglob("*.py")):
        read = module(file.read_text(encoding="utf-8"), file.relative_to(folder.parent).as_posix())
        found.append(replace(read, path=file.relative_to(ROOT).as_posix()))
    return tuple(found)


def modules(*packages: str) -> tuple[Module, ...]:
    """The modules of the packages named, of all three where none is."""
    return tuple(found for name in packages or PACKAGES for found in modules_in(PACKAGES[name]))


def dotted(node: ast.AST) -> str:
    """`a.b.c` of a name or an attribute, and of what is called; "" of anything else."""
    if isinstance(node, ast.Call):
        return dotted(node.func)
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@cache
def nodes(module: Module) -> tuple[ast.AST, ...]:
    """All nodes of a module. Walking the trees costs more than all that is asked of them: it is done once."""
    return tuple(ast.walk(module.tree))


@cache
def functions(module: Module) -> tuple[Function, ...]:
    """All functions and methods, nested ones too."""
    return tuple(node for node in nodes(module) if isinstance(node, Function))


def decorators(function: Function) -> list[str]:
    """Dotted names of its decorators."""
    return [dotted(decorator) for decorator in function.decorator_list]


def is_kernel(function: Function) -> bool:
    """Whether it is decorated with something whose name ends in "kernel"."""
    return any(name.endswith("kernel") for name in decorators(function))


def is_device_code(function: Function) -> bool:
    """Whether it is a kernel or a Warp function."""
    last = {name.rpartition(".")[2] for name in decorators(function)}
    return is_kernel(function) or bool(last & {"func", "func_native", "func_grad", "func_replay"})


def kernels(module: Module) -> Iterator[Function]:
    """All kernels, wherever they are nested."""
    return (function for function in functions(module) if is_kernel(function))


def arguments(function: Function) -> list[str]:
    """Names of its arguments, in order."""
    a = function.args
    return [argument.arg for argument in (*a.posonlyargs, *a.args, *a.kwonlyargs)]


def length(function: Function) -> int:
    """Lines from `def` to the end; decorators are not counted."""
    return (function.end_lineno or function.lineno) - function.lineno + 1


def prose(module: Module) -> set[int]:
    """Ids of the strings that are statements: docstrings, and what stands below a name to describe it."""
    statements = (node.value for node in nodes(module) if isinstance(node, ast.Expr))
    return {id(value) for value in statements if isinstance(value, ast.Constant) and isinstance(value.value, str)}
