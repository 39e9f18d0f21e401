"""Arithmetic expressions of a scene: a whitelisted grammar, compiled to a postfix program and never evaluated as Python.

The program is a list of (operation, number) for a stack machine. The same program runs over numpy arrays here (initial
values, selections) and on the device (boundary values that change in time, `wsph.boundary.values`): an expression needs no
kernel of its own, which would cost 0.35 s each to compile.
"""

# pyright: strict

import ast
import difflib
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

MAX_CHARACTERS, MAX_NODES, MAX_STACK, MAX_EXPONENT = 1000, 200, 16, 64
_UNARY = (
    *("negate", "not", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh"),
    *("exp", "log", "log10", "sqrt", "abs", "sign", "floor", "ceil"),
)
_BINARY = (
    *("add", "subtract", "multiply", "divide", "power", "min", "max", "atan2"),
    *("less", "less_equal", "greater", "greater_equal", "equal", "not_equal", "and", "or"),
)

OPERATIONS = {name: code for code, name in enumerate(("constant", "x", "y", "z", "t", *_UNARY, *_BINARY, "table"))}
"""Operation codes, shared with the device's stack machine."""

VARIABLES, FUNCTIONS = ("x", "y", "z", "t"), tuple(n for n in (*_UNARY, *_BINARY[5:8]) if n not in ("negate", "not"))
_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "add",
    ast.Sub: "subtract",
    ast.Mult: "multiply",
    ast.Div: "divide",
    ast.Pow: "power",
}
_COMPARISONS: dict[type[ast.cmpop], str] = {
    ast.Lt: "less",
    ast.LtE: "less_equal",
    ast.Gt: "greater",
    ast.GtE: "greater_equal",
    ast.Eq: "equal",
    ast.NotEq: "not_equal",
}


@dataclass(frozen=True)
class Expression:
    """A compiled expression: its text, its postfix program, and the names beside x, y, z, t that occur in it."""

    text: str
    program: tuple[tuple[int, float], ...]
    names: tuple[str, ...] = ()

    @property
    def logical(self) -> bool:
        """True where the value is a truth: the last operation is a comparison, and, or, not."""
        last = self.program[-1][0]
        return last == OPERATIONS["not"] or OPERATIONS["less"] <= last <= OPERATIONS["or"]

    def uses(self, variable: str) -> bool:
        """Whether x, y, z or t occurs."""
        return any(code == OPERATIONS[variable] for code, _ in self.program)

    def __call__(
        self, position: np.ndarray, time: float = 0.0, tolerance: float = 0.0, values: Sequence[np.ndarray] = ()
    ) -> np.ndarray:
        """Values at `position` (n, dim) [m] and `time` [s], shape (n,). `values` (n,) are those of the `names`.

        `tolerance` widens the comparisons: points that close to equality count as equal.
        """
        n, dim = len(position), position.shape[1]
        axes = [position[:, k] if k < dim else np.zeros(n) for k in range(3)]
        names = list(OPERATIONS)
        stack: list[np.ndarray] = []
        with np.errstate(all="ignore"):
            for code, number in self.program:
                name = names[code] if code < len(names) else ""
                if not name:
                    stack.append(np.asarray(values[code - len(names)], float))
                elif name == "constant":
                    stack.append(np.full(n, number))
                elif name in "xyz":
                    stack.append(axes["xyz".index(name)])
                elif name == "t":
                    stack.append(np.full(n, time))
                elif name in _UNARY:
                    stack.append(_unary(name, stack.pop()))
                else:
                    right, left = stack.pop(), stack.pop()
                    stack.append(_binary(name, left, right, tolerance))
        return stack[0]


def _unary(name: str, a: np.ndarray) -> np.ndarray:
    if name == "negate":
        return -a
    if name == "not":
        return (a == 0.0).astype(float)
    return getattr(np, {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}.get(name, name))(a)


def _binary(name: str, a: np.ndarray, b: np.ndarray, tolerance: float) -> np.ndarray:
    if name in ("add", "subtract", "multiply", "divide", "power"):
        return getattr(np, name)(a, b)
    if name in ("min", "max", "atan2"):
        return {"min": np.minimum, "max": np.maximum, "atan2": np.arctan2}[name](a, b)
    if name in ("and", "or"):
        return getattr(np, f"logical_{name}")(a != 0.0, b != 0.0).astype(float)
    return {
        "less": a < b - tolerance,
        "less_equal": a <= b + tolerance,
        "greater": a > b + tolerance,
        "greater_equal": a >= b - tolerance,
        "equal": np.abs(a - b) <= tolerance,
        "not_equal": np.abs(a - b) > tolerance,
    }[name].astype(float)


def compile_expression(text: str, names: Sequence[str] = ()) -> Expression:
    """Compile arithmetic over x, y, z (reference position), t, and other `names`. `^` and `**` are the power. Raises
    ValueError."""
    program: list[tuple[int, float]] = []
    _emit(_parsed(text), program, text, names)
    if stack_depth(program) > MAX_STACK:
        raise ValueError(f"the expression {text!r} is nested more than {MAX_STACK} deep")
    return Expression(text, tuple(program), tuple(names))


def _parsed(text: str) -> ast.expr:
    """The tree of an expression that is no longer than it may be."""
    if len(text) > MAX_CHARACTERS:
        raise ValueError(f"an expression has at most {MAX_CHARACTERS} characters, not {len(text)}")
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        compares = re.search(r"[^<>=!]=[^=]", text) is not None
        hint = "; write == to compare, and better <= or >=" if compares else ""
        raise ValueError(f"cannot read the expression {text!r}{_foreign(text) or hint}") from None
    if sum(1 for _ in ast.walk(tree)) > MAX_NODES:
        raise ValueError(f"the expression {text!r} has more than {MAX_NODES} parts")
    return tree


_FOREIGN = {r"&&?": "and", r"\|\|?": "or", r"!(?!=)|~": "not"}
"""What other languages write for the words that join comparisons."""


def _foreign(text: str) -> str:
    """What to write in place of the signs of other languages."""
    found = [(match[0], word) for sign, word in _FOREIGN.items() if (match := re.search(sign, text))]
    return "".join(f"; write {word} for {sign}" for sign, word in found)


def names_in(text: str) -> tuple[str, ...]:
    """The names in an expression that are no variable, constant or function, sorted. Raises ValueError as
    `compile_expression` does."""
    nodes = list(ast.walk(_parsed(text)))
    called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    found = {node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called}
    return tuple(sorted(found - {*VARIABLES, "pi"}))


def constant_program(value: float) -> Expression:
    """The expression of a number."""
    return Expression(repr(value), ((OPERATIONS["constant"], value),))


def stack_depth(program: Sequence[tuple[int, float]]) -> int:
    """The most numbers that a program has on its stack."""
    height = highest = 0
    for code, _ in program:
        if code <= OPERATIONS["t"] or code >= len(OPERATIONS):
            height += 1
        elif OPERATIONS["add"] <= code <= OPERATIONS["or"]:
            height -= 1
        highest = max(highest, height)
    return highest


def _emit(node: ast.AST, program: list[tuple[int, float]], text: str, names: Sequence[str]) -> None:
    """Append the postfix code of `node`."""

    def put(name: str, number: float = 0.0) -> None:
        program.append((OPERATIONS[name], number))

    match node:
        case ast.Constant(value=value) if isinstance(value, (int, float)) and not isinstance(value, bool):
            if abs(value) > 1e300:
                raise ValueError(f"{value!r} in {text!r} is no number that can be computed with")
            put("constant", float(value))
        case ast.Name(id=name) if name in VARIABLES:
            put(name)
        case ast.Name(id=name) if name in names:
            program.append((len(OPERATIONS) + list(names).index(name), 0.0))
        case ast.Name(id="pi"):
            put("constant", math.pi)
        case ast.Name(id=name):
            close = difflib.get_close_matches(name, (*VARIABLES, "pi", *FUNCTIONS, *names), 1)
            hint = f"; did you mean {close[0]!r}?" if close else f"; known: {', '.join(VARIABLES)}, pi"
            raise ValueError(f"unknown name {name!r} in {text!r}{hint}")
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            _emit(operand, program, text, names)
            put("negate")
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            _emit(operand, program, text, names)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            _emit(operand, program, text, names)
            put("not")
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            if (
                isinstance(operator, ast.Pow)
                and isinstance(right, ast.Constant)
                and isinstance(right.value, (int, float))
                and abs(right.value) > MAX_EXPONENT
            ):
                raise ValueError(f"an exponent is at most {MAX_EXPONENT}, not {right.value} in {text!r}")
            _emit(left, program, text, names)
            _emit(right, program, text, names)
            put(_OPERATORS[type(operator)])
        case ast.BoolOp(op=operator, values=values):
            _emit(values[0], program, text, names)
            for value in values[1:]:
                _emit(value, program, text, names)
                put("and" if isinstance(operator, ast.And) else "or")
        case ast.Compare(left=left, ops=operators, comparators=comparators):
            for k, (operator, right) in enumerate(zip(operators, comparators, strict=True)):
                if type(operator) not in _COMPARISONS:
                    raise ValueError(f"the comparison in {text!r} is none of <, <=, >, >=, ==, !=")
                _emit(left, program, text, names)
                _emit(right, program, text, names)
                put(_COMPARISONS[type(operator)])
                if k:
                    put("and")
                left = right
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            wanted = 1 if name in _UNARY else 2
            if len(arguments) != wanted:
                raise ValueError(
                    f"{name} in {text!r} takes {wanted} argument{'s' * (wanted > 1)}, not {len(arguments)}"
                )
            for argument in arguments:
                _emit(argument, program, text, names)
            put(name)
        case ast.Call(func=ast.Name(id=name)):
            close = difflib.get_close_matches(name, FUNCTIONS, 1)
            raise ValueError(
                f"unknown function {name!r} in {text!r}; "
                + (f"did you mean {close[0]!r}?" if close else f"known: {', '.join(FUNCTIONS)}")
            )
        case _:
            raise ValueError(f"{text!r} has a part that is not arithmetic over x, y, z, t{_foreign(text)}")
