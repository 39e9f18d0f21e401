"""Prescribed values on the device.

A prescribed value is a program for a small stack machine (`wsph.expressions`), a number and a table included, so that one
kernel serves every boundary condition of every scene. An entry of the list is a place in the flat state and a program.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import warp as wp

from wsph.clock import Clock
from wsph.conditions import Conditions, Prescribed
from wsph.expressions import OPERATIONS, Expression
from wsph.space import Space
from wsph.state import State

CONSTANT = -1
"""The program of an entry that never changes: its scale is its value. Most faces are free: thousands of zeros."""

Stack = wp.types.vector(length=16, dtype=wp.float64)


@wp.struct
class Bank:
    """Programs and tables on the device."""

    start: wp.array(dtype=wp.int32)
    code: wp.array(dtype=wp.int32)
    number: wp.array(dtype=wp.float64)
    table_start: wp.array(dtype=wp.int32)
    table_step: wp.array(dtype=wp.int32)
    table_t: wp.array(dtype=wp.float64)
    table_value: wp.array(dtype=wp.float64)


def _op(name: str) -> int:
    return OPERATIONS[name]


@wp.func
def _first_at_or_after(values: wp.array(dtype=wp.float64), begin: int, end: int, t: wp.float64) -> int:
    """First index in [begin, end) whose value is >= t, or `end` (wp.lower_bound returns end - 1 there)."""
    low = begin
    high = end
    while low < high:
        middle = (low + high) // 2
        if values[middle] < t:
            low = middle + 1
        else:
            high = middle
    return low


@wp.func
def _look_up(bank: Bank, table: int, t: wp.float64, slack: wp.float64) -> wp.float64:
    first = bank.table_start[table]
    end = bank.table_start[table + 1]
    if bank.table_step[table] == 1:
        # value[k] holds on (t[k], t[k+1]]; a time a rounding above t[k+1] still counts as t[k+1].
        k = _first_at_or_after(bank.table_t, first, end, t - slack)
        return bank.table_value[wp.max(k - 1, first)]
    k = _first_at_or_after(bank.table_t, first, end, t)
    if k == first:
        return bank.table_value[first]
    if k == end:
        return bank.table_value[end - 1]
    s = (t - bank.table_t[k - 1]) / (bank.table_t[k] - bank.table_t[k - 1])
    return bank.table_value[k - 1] + s * (bank.table_value[k] - bank.table_value[k - 1])


@wp.func
def _truth(holds: bool) -> wp.float64:
    if holds:
        return wp.float64(1.0)
    return wp.float64(0.0)


@wp.func
def _apply_unary(code: int, a: wp.float64) -> wp.float64:
    if code == wp.static(_op("negate")):
        return -a
    if code == wp.static(_op("not")):
        return _truth(a == wp.float64(0.0))
    if code == wp.static(_op("sin")):
        return wp.sin(a)
    if code == wp.static(_op("cos")):
        return wp.cos(a)
    if code == wp.static(_op("tan")):
        return wp.tan(a)
    if code == wp.static(_op("asin")):
        return wp.asin(a)
    if code == wp.static(_op("acos")):
        return wp.acos(a)
    if code == wp.static(_op("atan")):
        return wp.atan(a)
    if code == wp.static(_op("sinh")):
        return wp.sinh(a)
    if code == wp.static(_op("cosh")):
        return wp.cosh(a)
    if code == wp.static(_op("tanh")):
        return wp.tanh(a)
    if code == wp.static(_op("exp")):
        return wp.exp(a)
    if code == wp.static(_op("log")):
        return wp.log(a)
    if code == wp.static(_op("log10")):
        return wp.log10(a)
    if code == wp.static(_op("sqrt")):
        return wp.sqrt(a)
    if code == wp.static(_op("abs")):
        return wp.abs(a)
    if code == wp.static(_op("sign")):
        return _truth(a > wp.float64(0.0)) - _truth(a < wp.float64(0.0))
    if code == wp.static(_op("floor")):
        return wp.floor(a)
    return wp.ceil(a)


@wp.func
def _apply_binary(code: int, a: wp.float64, b: wp.float64) -> wp.float64:
    if code == wp.static(_op("add")):
        return a + b
    if code == wp.static(_op("subtract")):
        return a - b
    if code == wp.static(_op("multiply")):
        return a * b
    if code == wp.static(_op("divide")):
        return a / b
    if code == wp.static(_op("power")):
        return wp.pow(a, b)
    if code == wp.static(_op("min")):
        return wp.min(a, b)
    if code == wp.static(_op("max")):
        return wp.max(a, b)
    if code == wp.static(_op("atan2")):
        return wp.atan2(a, b)
    if code == wp.static(_op("less")):
        return _truth(a < b)
    if code == wp.static(_op("less_equal")):
        return _truth(a <= b)
    if code == wp.static(_op("greater")):
        return _truth(a > b)
    if code == wp.static(_op("greater_equal")):
        return _truth(a >= b)
    if code == wp.static(_op("equal")):
        return _truth(a == b)
    if code == wp.static(_op("not_equal")):
        return _truth(a != b)
    if code == wp.static(_op("and")):
        return _truth(a != wp.float64(0.0) and b != wp.float64(0.0))
    return _truth(a != wp.float64(0.0) or b != wp.float64(0.0))


@wp.func
def _evaluate(bank: Bank, program: int, x: wp.vec3d, t: wp.float64, slack: wp.float64) -> wp.float64:
    stack = Stack()
    top = int(-1)
    for k in range(bank.start[program], bank.start[program + 1]):
        code = bank.code[k]
        if code == wp.static(_op("constant")):
            top += 1
            stack[top] = bank.number[k]
        elif code == wp.static(_op("table")):
            top += 1
            stack[top] = _look_up(bank, int(bank.number[k]), t, slack)
        elif code == wp.static(_op("t")):
            top += 1
            stack[top] = t
        elif code <= wp.static(_op("z")):
            top += 1
            stack[top] = x[code - wp.static(_op("x"))]
        elif code < wp.static(_op("add")):
            stack[top] = _apply_unary(code, stack[top])
        else:
            top -= 1
            stack[top] = _apply_binary(code, stack[top], stack[top + 1])
    return stack[0]


@cache
def _impose_kernel(space: Space) -> wp.Kernel:
    real = space.scalar

    @wp.kernel(module="unique", enable_backward=False)
    def impose(first: int, bank: Bank, clock: wp.array(dtype=wp.float64), from_dt: wp.float64, to_dt: wp.float64, second: wp.float64,
               place: wp.array(dtype=wp.int32), program: wp.array(dtype=wp.int32), scale: wp.array(dtype=wp.float64),
               position: wp.array(dtype=wp.vec3d), state_out: wp.array(dtype=real)):  # fmt: skip
        e = first + wp.tid()
        value = scale[e]
        if program[e] != wp.static(CONSTANT):
            dt = clock[1] * second
            t = clock[0] * second
            slack = wp.float64(1.0e-9) * dt
            now = _evaluate(bank, program[e], position[e], t + from_dt * dt, slack)
            if to_dt != from_dt:
                now = wp.float64(0.5) * (now + _evaluate(bank, program[e], position[e], t + to_dt * dt, slack))
            value = now * value
        state_out[place[e]] = real(value)

    return impose


class BoundaryValues:
    """The prescribed values of a body on the device, and the work they do.

    `impose(state, c)` sets them in a state at t + c dt; c = (a, b) means the mean of both times.
    """

    def __init__(self, space: Space, conditions: Conditions, state: State, position: np.ndarray,
                 units: dict[str, float], second: float, device: str):  # fmt: skip
        self.space, self._second = space, second
        place, program, scale, points, owners = [], [], [], [], []
        programs: dict[int, int] = {}
        kept: list[Prescribed] = []
        for (name, component), values in sorted(conditions.entries.items(), key=lambda item: item[0]):
            for particle, value in sorted(values.items()):
                factor = conditions.scales.get((name, component), {}).get(particle, 1.0) / units[name]
                number = _constant(value)
                if number is None and id(value) not in programs:
                    programs[id(value)] = len(kept)
                    kept.append(value)
                place.append(state.index(name, particle, component))
                program.append(programs[id(value)] if number is None else CONSTANT)
                scale.append(factor if number is None else number * factor)
                points.append(position[particle])
                owners.append(particle)
        self.count = len(place)
        if self.count == 0:
            return
        self._bank = _bank(kept, device)
        padded = np.zeros((self.count, 3))
        padded[:, : position.shape[1]] = points
        self.particle = np.array(owners, np.int32)
        self.place = wp.array(place, dtype=wp.int32, device=device)
        self._program = wp.array(program, dtype=wp.int32, device=device)
        self._scale = wp.array(scale, dtype=wp.float64, device=device)
        self._position = wp.array(padded, dtype=wp.vec3d, device=device)

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the prescribed values in `state` (a launch)."""
        if self.count == 0:
            return
        first, last = c if isinstance(c, tuple) else (c, c)
        inputs = [self._bank, clock.time, wp.float64(first), wp.float64(last), wp.float64(self._second)]
        inputs += [self.place, self._program, self._scale, self._position]
        clock.launch(_impose_kernel(self.space), self.count, inputs, [state.buffer])


def _constant(value: Prescribed) -> float | None:
    """The number that a value always is, if its program says no more."""
    if isinstance(value, Expression) and len(value.program) == 1:
        code, number = value.program[0]
        return number if code == OPERATIONS["constant"] else None
    return None


def _bank(values: list[Prescribed], device: str) -> Bank:
    start, code, number = [0], [], []
    table_start, table_step, table_t, table_value = [0], [], [], []
    for value in values:
        if isinstance(value, Expression):
            code += [c for c, _ in value.program]
            number += [v for _, v in value.program]
        else:
            code.append(OPERATIONS["table"])
            number.append(float(len(table_step)))
            table_step.append(int(value.interp == "step"))
            table_t += value.t or ()
            table_value += value.value or ()
            table_start.append(len(table_t))
        start.append(len(code))
    bank = Bank()
    integers: Callable[[list[int]], wp.array] = lambda v: wp.array(v, dtype=wp.int32, device=device)  # noqa: E731
    doubles: Callable[[list[float]], wp.array] = lambda v: wp.array(v, dtype=wp.float64, device=device)  # noqa: E731
    bank.start, bank.code, bank.number = integers(start), integers(code), doubles(number)
    bank.table_start, bank.table_step = integers(table_start), integers(table_step or [0])
    bank.table_t, bank.table_value = doubles(table_t or [0.0]), doubles([float(v) for v in table_value] or [0.0])
    return bank
