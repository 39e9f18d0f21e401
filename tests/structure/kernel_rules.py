"""Rules for kernels. Each takes a module and yields its breaches, "path:line: what is wrong".

A kernel's signature is all that a reader of its launch sees. So it says what is written (`_out`, at the end) and whether the
work is split over threads (`first`, at the beginning), and one decorator alone makes kernels, which can hold to that.
"""

import ast
from collections.abc import Iterator

from syntax import Function, Module, arguments, dotted, kernels, nodes

MAKER = "wsph/backend/kernels.py"
"""The one file that makes kernels."""
WARP = ("wp", "warp")


def writes_are_marked(module: Module) -> Iterator[str]:
    """What a kernel writes ends in `_out`. What it hands to a Warp function is not followed."""
    for kernel in kernels(module):
        taken, names = set(arguments(kernel)), _other_names(kernel)
        for target in _written(kernel):
            root = _root(target)
            root = names.get(root, root)
            if root in taken and not root.endswith("_out"):
                yield f"{module.path}:{target.lineno}: {kernel.name} writes {ast.unparse(target)}, {root} has no _out"


def outputs_come_last(module: Module) -> Iterator[str]:
    """Arguments that are written stand behind all that are only read."""
    for kernel in kernels(module):
        marked = [name.endswith("_out") for name in arguments(kernel)]
        if marked != sorted(marked):
            wrong = [name for name in arguments(kernel)[marked.index(True) :] if not name.endswith("_out")]
            yield f"{module.path}:{kernel.lineno}: {kernel.name} has {', '.join(wrong)} behind an output"


def split_kernels_begin_with_first(module: Module) -> Iterator[str]:
    """The decorator says `ranged=True` if and only if the first argument is `first`, where a thread's range begins."""
    for kernel in kernels(module):
        for decorator in kernel.decorator_list:
            maker, _, name = dotted(decorator).rpartition(".")
            if name == "kernel" and maker not in WARP and _ranged(decorator) != _begins_with_first(kernel):
                says = "is ranged" if _ranged(decorator) else "is not ranged"
                yield f"{module.path}:{kernel.lineno}: {kernel.name} {says}, its arguments are {arguments(kernel)}"


def one_file_makes_kernels(module: Module) -> Iterator[str]:
    """Warp's own decorator is used in one file: every other kernel is made by what stands there."""
    if module.path == MAKER:
        return
    for node in nodes(module):
        direct = isinstance(node, ast.Attribute) and node.attr == "kernel" and dotted(node.value) in WARP
        named = isinstance(node, ast.ImportFrom) and node.module == "warp" and "kernel" in {a.name for a in node.names}
        if direct or named:
            yield f"{module.path}:{node.lineno}: makes a kernel by Warp's own decorator, not by that of {MAKER}"


def _ranged(decorator: ast.expr) -> bool:
    """Whether a decorator says `ranged=True`, as it stands: what is decided elsewhere a reader does not see."""
    keywords = decorator.keywords if isinstance(decorator, ast.Call) else []
    return any(k.arg == "ranged" and isinstance(k.value, ast.Constant) and k.value.value is True for k in keywords)


def _begins_with_first(kernel: Function) -> bool:
    return arguments(kernel)[:1] == ["first"]


def _written(kernel: Function) -> Iterator[ast.expr]:
    """Elements that are assigned to, or added to by an atomic operation."""
    for node in ast.walk(kernel):
        targets: list[ast.expr] = []
        if isinstance(node, ast.Assign):
            targets = node.targets
        elif isinstance(node, ast.AugAssign | ast.AnnAssign):
            targets = [node.target]
        elif isinstance(node, ast.Call) and ".atomic_" in dotted(node) and node.args:
            yield node.args[0]
        for target in targets:
            parts = target.elts if isinstance(target, ast.Tuple | ast.List) else [target]
            yield from (part for part in parts if isinstance(part, ast.Subscript))


def _root(node: ast.expr) -> str:
    """The name that a chain of attributes and indices begins with."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _other_names(kernel: Function) -> dict[str, str]:
    """Local names of whole arrays, `u = fields.displacement`, and the argument that each begins with. An element that was
    read, `m = moment[i]`, is a copy."""
    names: dict[str, str] = {}
    for node in ast.walk(kernel):
        if not (isinstance(node, ast.Assign) and isinstance(node.value, ast.Name | ast.Attribute)):
            continue
        if isinstance(node.targets[0], ast.Name) and dotted(node.value):
            names[node.targets[0].id] = _root(node.value)
    return names
