"""Prescribed values of a scene: expressions and tables, and what is known of them before a run."""

# pyright: strict

from collections.abc import Iterable

from wsph.boundary.programs.functions import Function
from wsph.expressions import OPERATIONS, Expression, constant_program
from wsph.output.fields import AXES

Prescribed = Expression | Function


def nonzero(value: Prescribed) -> bool:
    """Whether a prescribed value is anything but the constant zero."""
    return not (isinstance(value, Expression) and value.program == constant_program(0.0).program)


def varies(value: Prescribed, along: Iterable[str] = AXES) -> bool:
    """Whether a prescribed value differs from place to place, `along` some axes."""
    return isinstance(value, Expression) and any(value.uses(axis) for axis in along)


def constant(value: Prescribed) -> float | None:
    """The number that a value always is, if its program says no more."""
    if isinstance(value, Expression) and len(value.program) == 1:
        code, number = value.program[0]
        return number if code == OPERATIONS["constant"] else None
    return None


def same(one: Prescribed, other: Prescribed) -> bool:
    """Whether two values are written alike, and so always equal."""
    if isinstance(one, Expression) and isinstance(other, Expression):
        return one.program == other.program
    return one == other
