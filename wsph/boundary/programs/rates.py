"""Rates of expressions: the derivative of a postfix program along t, at a fixed place, as another program.

What steps, comparisons among it, has the rate zero; min and max have that of the operand which they take.
"""

# pyright: strict

import math
from collections.abc import Sequence

from wsph.expressions import MAX_STACK, OPERATIONS, Expression, stack_depth

Program = tuple[tuple[int, float], ...]

STEPS = (
    "not",
    "sign",
    "floor",
    "ceil",
    "less",
    "less_equal",
    "greater",
    "greater_equal",
    "equal",
    "not_equal",
    "and",
    "or",
)
"""Operations whose values change in steps."""


def rate_of(value: Expression) -> Expression:
    """The derivative of an expression along t. Raises ValueError where its program is too deep for the stack."""
    names, stack = list(OPERATIONS), list[tuple[Program, Program | None]]()
    for code, number in value.program:
        name = names[code]
        if name == "t":
            stack.append((((code, number),), _constant(1.0)))
        elif code <= OPERATIONS["z"]:
            stack.append((((code, number),), None))
        elif code < OPERATIONS["add"]:
            a, rate = stack.pop()
            stack.append(((*a, (code, 0.0)), None if rate is None else _unary(name, a, rate)))
        else:
            (b, after), (a, before) = stack.pop(), stack.pop()
            stack.append(((*a, *b, (code, 0.0)), _binary(name, (a, before), (b, after))))
    found = stack[0][1] or _constant(0.0)
    if stack_depth(found) > MAX_STACK:
        raise ValueError(f"the rate of {value.text!r} is nested more than {MAX_STACK} deep: prescribe the velocity")
    return Expression(f"the rate of {value.text}", found)


def _constant(number: float) -> Program:
    return ((OPERATIONS["constant"], number),)


def _call(name: str, *arguments: Program) -> Program:
    """An operation on what programs leave."""
    return (*(step for each in arguments for step in each), (OPERATIONS[name], 0.0))


def _times(a: Program, b: Program) -> Program:
    one = _constant(1.0)
    return b if a == one else a if b == one else _call("multiply", a, b)


def _plus(parts: Sequence[Program | None]) -> Program | None:
    """The sum of those that there are."""
    there = [part for part in parts if part is not None]
    if not there:
        return None
    total = there[0]
    for part in there[1:]:
        total = _call("add", total, part)
    return total


def _square(a: Program) -> Program:
    return _call("multiply", a, a)


def _unary(name: str, a: Program, rate: Program) -> Program | None:
    """The rate of a function of `a`, whose own is `rate`."""
    one, two = _constant(1.0), _constant(2.0)
    if name == "negate":
        return _call("negate", rate)
    if name in STEPS:
        return None
    slopes = {
        "sin": lambda: _call("cos", a),
        "cos": lambda: _call("negate", _call("sin", a)),
        "tan": lambda: _call("divide", one, _square(_call("cos", a))),
        "asin": lambda: _call("divide", one, _call("sqrt", _call("subtract", one, _square(a)))),
        "acos": lambda: _call("divide", _constant(-1.0), _call("sqrt", _call("subtract", one, _square(a)))),
        "atan": lambda: _call("divide", one, _call("add", one, _square(a))),
        "sinh": lambda: _call("cosh", a),
        "cosh": lambda: _call("sinh", a),
        "tanh": lambda: _call("subtract", one, _square(_call("tanh", a))),
        "exp": lambda: _call("exp", a),
        "log": lambda: _call("divide", one, a),
        "log10": lambda: _call("divide", _constant(1.0 / math.log(10.0)), a),
        "sqrt": lambda: _call("divide", one, _call("multiply", two, _call("sqrt", a))),
        "abs": lambda: _call("sign", a),
    }
    return _times(slopes[name](), rate)


def _binary(name: str, left: tuple[Program, Program | None], right: tuple[Program, Program | None]) -> Program | None:
    """The rate of an operation on two programs with their rates."""
    (a, da), (b, db) = left, right
    if name in STEPS or (da is None and db is None):
        return None
    if name == "add":
        return _plus([da, db])
    if name == "subtract":
        return _plus([da, None if db is None else _call("negate", db)])
    if name == "multiply":
        return _plus([None if da is None else _times(da, b), None if db is None else _times(a, db)])
    if name == "divide":
        away = None if db is None else _call("divide", _call("multiply", a, db), _square(b))
        return _plus([None if da is None else _call("divide", da, b), None if away is None else _call("negate", away)])
    if name == "power":
        slope = _call("multiply", b, _call("power", a, _call("subtract", b, _constant(1.0))))
        lower = None if da is None else _times(slope, da)
        upper = None if db is None else _times(_call("multiply", _call("power", a, b), _call("log", a)), db)
        return _plus([lower, upper])
    if name == "atan2":
        away = None if db is None else _call("negate", _call("multiply", a, db))
        turning = _plus([None if da is None else _call("multiply", da, b), away])
        return None if turning is None else _call("divide", turning, _call("add", _square(a), _square(b)))
    first, second = ("less", "greater_equal") if name == "min" else ("greater", "less_equal")
    taken = None if da is None else _times(_call(first, a, b), da)
    other = None if db is None else _times(_call(second, a, b), db)
    return _plus([taken, other])
