"""What docstrings say: their first sentence, and those that stand below the attributes of a class."""

# pyright: strict

import ast
import inspect
import re


def first_sentence(said: str) -> str:
    """The first sentence of a text, on one line."""
    text = " ".join(said.split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s+(?=[A-Z`])", text, maxsplit=1)[0].removesuffix(".")


def attribute_docstrings(cls: type) -> dict[str, str]:
    """The docstrings that stand below the attributes of a class, from its source; of others the attribute's name."""
    body = next(node.body for node in ast.walk(ast.parse(inspect.getsource(cls))) if isinstance(node, ast.ClassDef))
    found: dict[str, str] = {}
    for node, below in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            said = below.value.value if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) else None
            found[node.target.id] = " ".join(said.split()) if isinstance(said, str) else node.target.id
    return found
