"""Prescribed values of a scene: expressions, tables and motions, and what is known of them before a run."""

# pyright: strict

import zlib
from collections.abc import Iterable

from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.windows import Windowed
from wsph.expressions import OPERATIONS, Expression, constant_program
from wsph.output.fields import AXES

Prescribed = Expression | Function | Windowed
Moved = Prescribed | Motion
"""What a component of a velocity is prescribed by."""


def nonzero(value: Moved) -> bool:
    """Whether a prescribed value is anything but the constant zero."""
    if isinstance(value, Windowed):
        return any(nonzero(each) for _, _, each in value.pieces)
    return not (isinstance(value, Expression) and value.program == constant_program(0.0).program)


def varies(value: Moved, along: Iterable[str] = AXES) -> bool:
    """Whether a prescribed value differs from place to place, `along` some axes."""
    if isinstance(value, Motion):
        return varies(value.of, along)
    return isinstance(value, Expression | Windowed) and any(value.uses(axis) for axis in along)


def constant(value: Moved) -> float | None:
    """The number that a value always is, if its program says no more."""
    if isinstance(value, Expression) and len(value.program) == 1:
        code, number = value.program[0]
        return number if code == OPERATIONS["constant"] else None
    return None


def mark(value: Moved) -> int:
    """A number above zero that values which are the `same` have, in every process."""
    return zlib.crc32(_written(value).encode()) + 1


def _written(value: Moved) -> str:
    if isinstance(value, Motion):
        return f"{value.kind} {_written(value.of)}"
    if isinstance(value, Expression):
        return repr(value.program)
    if isinstance(value, Windowed):
        return repr([(*piece[:2], _written(piece[2])) for piece in value.pieces])
    return repr(value)


def same(one: Moved, other: Moved) -> bool:
    """Whether two values are written alike, and so always equal."""
    if isinstance(one, Motion) and isinstance(other, Motion):
        return one.kind == other.kind and same(one.of, other.of)
    if isinstance(one, Expression) and isinstance(other, Expression):
        return one.program == other.program
    if isinstance(one, Windowed) and isinstance(other, Windowed) and len(one.pieces) == len(other.pieces):
        return all(a[:2] == b[:2] and same(a[2], b[2]) for a, b in zip(one.pieces, other.pieces, strict=True))
    return one == other
