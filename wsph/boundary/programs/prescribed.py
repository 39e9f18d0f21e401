"""Prescribed values of a scene: expressions, tables and motions, and what is known of them before a run."""

# pyright: strict

from collections.abc import Iterable

from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import Motion
from wsph.expressions import OPERATIONS, Expression, constant_program
from wsph.output.fields import AXES

Prescribed = Expression | Function
Moved = Prescribed | Motion
"""What a component of a velocity is prescribed by."""


def nonzero(value: Moved) -> bool:
    """Whether a prescribed value is anything but the constant zero."""
    return not (isinstance(value, Expression) and value.program == constant_program(0.0).program)


def varies(value: Moved, along: Iterable[str] = AXES) -> bool:
    """Whether a prescribed value differs from place to place, `along` some axes."""
    if isinstance(value, Motion):
        return varies(value.of, along)
    return isinstance(value, Expression) and any(value.uses(axis) for axis in along)


def constant(value: Moved) -> float | None:
    """The number that a value always is, if its program says no more."""
    if isinstance(value, Expression) and len(value.program) == 1:
        code, number = value.program[0]
        return number if code == OPERATIONS["constant"] else None
    return None


def same(one: Moved, other: Moved) -> bool:
    """Whether two values are written alike, and so always equal."""
    if isinstance(one, Motion) and isinstance(other, Motion):
        return one.kind == other.kind and same(one.of, other.of)
    if isinstance(one, Expression) and isinstance(other, Expression):
        return one.program == other.program
    return one == other
