"""Kernels: the one decorator that makes them.

A kernel's signature is all that a reader of its launch sees, so it is held to what it says. Arguments stand in one order:
where a thread's range begins, parameters, arrays that are read, scalars, and last what is written, whose names end in
`_out`. A kernel that is `ranged` begins with `first: int`: its thread k does row first + k, so that the cores can share a
launch (`wsph.backend.launch`). A kernel that would have more than MOST arguments groups some of them in a struct.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import ast
from collections.abc import Callable, Iterator
from functools import cache
from types import CodeType
from weakref import WeakSet

import warp as wp

from wsph.backend.pair_loops import LANES, PAIR_LOOPS

FIRST = "first"
"""The first argument of a ranged kernel."""

WRITTEN = "_out"
"""Ending of the names of arguments that a kernel writes."""

MOST = 12
"""Arguments of a kernel."""

_ranged: "WeakSet[wp.Kernel]" = WeakSet()


def kernel(
    *, ranged: bool = False, pairs: bool = False, lanes: bool = False, module: wp.Module | str = "unique"
) -> Callable[[Callable[..., None]], wp.Kernel]:
    """Decorator: a Warp kernel, without its adjoint.

    `ranged`: its rows can be split over threads; `pairs`: its loops over pairs are compiled with their sums in vectors
    (`wsph.backend.pair_loops`); `lanes`: its loops are over rows that lie side by side; `module`: that of kernels which
    are always used together (`Space.module`), or one of its own. Raises TypeError where the arguments do not say what the
    kernel does."""

    def make(function: Callable[..., None]) -> wp.Kernel:
        name, code = function.__qualname__, function.__code__
        _check_arguments(name, code.co_varnames[: code.co_argcount], ranged)
        options = LANES if lanes else PAIR_LOOPS if pairs else None
        made: wp.Kernel = wp.kernel(module=module, enable_backward=False, module_options=options)(function)
        if unmarked := _unmarked(code, made.adj.tree):
            raise TypeError(f"kernel {name} writes {', '.join(unmarked)}: what it writes ends in {WRITTEN}")
        if ranged:
            _ranged.add(made)
        return made

    return make


def is_ranged(made: wp.Kernel) -> bool:
    """Whether a kernel's rows can be split over threads."""
    return made in _ranged


def _check_arguments(name: str, arguments: tuple[str, ...], ranged: bool) -> None:
    """Raise TypeError where the names, the order or the number of a kernel's arguments are not what they are to be."""
    if ranged != (arguments[:1] == (FIRST,)):
        says = "is ranged" if ranged else "is not ranged"
        raise TypeError(
            f"kernel {name} {says}, and its first argument is {arguments[:1]}: ranged=True goes with {FIRST!r}"
        )
    marked = [argument.endswith(WRITTEN) for argument in arguments]
    if marked != sorted(marked):
        raise TypeError(f"kernel {name} has an input behind an output: what is written comes last, of {arguments}")
    if len(arguments) > MOST:
        raise TypeError(
            f"kernel {name} has {len(arguments)} arguments, at most {MOST}: what belongs together is a struct"
        )


@cache
def _unmarked(code: CodeType, tree: ast.Module) -> tuple[str, ...]:
    """Arguments that are written without being marked. Kernels of one source share their code and their tree."""
    arguments = set(code.co_varnames[: code.co_argcount])
    statements = list(_statements(tree.body))
    # u = fields.displacement is another name of an array; m = moment[i] is a copy of an element.
    aliases = {
        each.targets[0].id: _root(each.value)
        for each in statements
        if isinstance(each, ast.Assign) and isinstance(each.value, ast.Name | ast.Attribute)
        if isinstance(each.targets[0], ast.Name)
    }
    roots = (_root(target) for each in statements for target in _written(each))
    found = dict.fromkeys(aliases.get(root, root) for root in roots)
    return tuple(name for name in found if name in arguments and not name.endswith(WRITTEN))


def _statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """All statements, those of loops and branches too; expressions are not gone through, which would take ten times as
    long."""
    for each in body:
        yield each
        if isinstance(each, ast.For | ast.While | ast.If | ast.FunctionDef):
            yield from _statements(each.body)
        if isinstance(each, ast.For | ast.While | ast.If):
            yield from _statements(each.orelse)


def _written(statement: ast.stmt) -> Iterator[ast.expr]:
    """The elements of arrays that a statement assigns to, or adds to by an atomic operation."""
    value = statement.value if isinstance(statement, ast.Assign | ast.Expr) else None
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Attribute) and value.func.attr.startswith("atomic_"):
        yield value.args[0]
    targets = statement.targets if isinstance(statement, ast.Assign) else []
    if isinstance(statement, ast.AugAssign | ast.AnnAssign):
        targets = [statement.target]
    for target in targets:
        parts = target.elts if isinstance(target, ast.Tuple | ast.List) else [target]
        yield from (part for part in parts if isinstance(part, ast.Subscript))


def _root(node: ast.expr) -> str:
    """The name that a chain of attributes and indices begins with."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""
