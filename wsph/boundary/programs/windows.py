"""Prescribed values that hold in some steps of a run, and others in other steps.

A step of [[steps]] is a window of time, (from, to]; the first begins before all times, and the last has no end. What
nothing holds in a window is free there: a load is zero, and a velocity is whatever the motion makes it.
"""

# pyright: strict

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import Motion
from wsph.expressions import Expression

Window = tuple[float, float]
"""From when, and up to when, something holds [s]."""

ALWAYS: tuple[Window, ...] = ((-np.inf, np.inf),)

Held = TypeVar("Held")


@dataclass(frozen=True)
class Windowed:
    """Values by the windows in which they hold: ascending, and none at a time in two."""

    pieces: tuple[tuple[float, float, Expression | Function], ...]

    def uses(self, variable: str) -> bool:
        """Whether x, y, z or t occurs."""
        return variable == "t" or any(isinstance(v, Expression) and v.uses(variable) for _, _, v in self.pieces)

    def __call__(self, position: np.ndarray, time: float = 0.0) -> np.ndarray:
        """Values at `position` (n, dim) [m] and `time` [s], shape (n,): zero where nothing holds."""
        for start, end, value in self.pieces:
            if start < time <= end:
                return np.full(len(position), value.at(time)) if isinstance(value, Function) else value(position, time)
        return np.zeros(len(position))


def windows_of(value: Expression | Function | Windowed | Motion) -> tuple[Window, ...]:
    """The windows in which a value holds."""
    return tuple((start, end) for start, end, _ in value.pieces) if isinstance(value, Windowed) else ALWAYS


def within(value: Expression | Function | Windowed, windows: Iterable[Window]) -> Expression | Function | Windowed:
    """A value that holds in some windows alone."""
    found = tuple(windows)
    if found == ALWAYS:
        return value
    pieces = value.pieces if isinstance(value, Windowed) else ((-np.inf, np.inf, value),)
    cut = [(max(a, start), min(b, end), each) for start, end in found for a, b, each in pieces]
    return Windowed(tuple(sorted((piece for piece in cut if piece[0] < piece[1]), key=lambda piece: piece[0])))


def meet(one: Expression | Function | Windowed | Motion, other: Expression | Function | Windowed | Motion) -> bool:
    """Whether two values hold at some time both."""
    pairs = ((a, b) for a in windows_of(one) for b in windows_of(other))
    return any(max(a[0], b[0]) < min(a[1], b[1]) for a, b in pairs)


def _beside(windows: Iterable[Window]) -> list[Window]:
    """The times in none of some windows, which ascend."""
    left = list[Window]()
    before = -np.inf
    for start, end in windows:
        left.append((before, start))
        before = end
    left.append((before, np.inf))
    return [window for window in left if window[0] < window[1]]


def outside(
    pieces: Iterable[tuple[float, float, Held]], windows: Iterable[Window]
) -> tuple[tuple[float, float, Held], ...]:
    """What pieces (from, to, what holds there) leave outside of some windows, which ascend."""
    cut = [(max(a, start), min(b, end), each) for start, end in _beside(windows) for a, b, each in pieces]
    return tuple(piece for piece in cut if piece[0] < piece[1])


def over(
    earlier: Expression | Function | Windowed, later: Expression | Function | Windowed
) -> Expression | Function | Windowed:
    """Of two values the later where it holds, and else the earlier."""
    if not isinstance(later, Windowed):
        return later
    kept = within(earlier, _beside(windows_of(later)))
    pieces = (*later.pieces, *(kept.pieces if isinstance(kept, Windowed) else ()))
    return Windowed(tuple(sorted(pieces, key=lambda piece: piece[0])))


def holds(value: Expression | Function | Windowed | Motion, time: float | None = None) -> bool:
    """Whether a value holds at a time [s]; without one, at all times."""
    windows = windows_of(value)
    if time is not None:
        return any(start < time <= end for start, end in windows)
    ends = [end for _, end in windows]
    return windows[0][0] == -np.inf and ends[-1] == np.inf and ends[:-1] == [start for start, _ in windows[1:]]
