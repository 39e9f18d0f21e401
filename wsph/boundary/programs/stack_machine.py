"""The stack machine that evaluates a scene's expressions and tables on the device.

A prescribed value is a program for it (`wsph.expressions`), a number and a table included, so that one kernel serves
every boundary condition of every scene.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import dt_of, time_of
from wsph.boundary.programs.prescribed import Prescribed
from wsph.boundary.programs.windows import Windowed
from wsph.expressions import OPERATIONS, Expression

Stack = wp.types.vector(length=16, dtype=wp.float64)


@wp.struct
class Bank:
    """Programs and tables on the device: p programs of c instructions in all, s tables of r rows in all.

    start        # (p + 1,), where the instructions of each program begin
    code         # (c,), operations by their numbers in `wsph.expressions.OPERATIONS`
    number       # (c,), the constant of a "constant", the table of a "table"
    table_start  # (s + 1,), where the rows of each table begin
    table_step   # (s,), 1 where a table is one of steps, 0 where it is linear
    table_t      # (r,) [s]
    table_value  # (r,), in the SI unit of the prescribed quantity
    window_start # (p + 1,), where the windows of each program begin; a program with windows has no instructions of its own
    window_from, window_to  # (w,) [s]
    window_value # (w,), the program that holds there
    """

    start: wp.array(dtype=wp.int32)
    code: wp.array(dtype=wp.int32)
    number: wp.array(dtype=wp.float64)
    table_start: wp.array(dtype=wp.int32)
    table_step: wp.array(dtype=wp.int32)
    table_t: wp.array(dtype=wp.float64)
    table_value: wp.array(dtype=wp.float64)
    window_start: wp.array(dtype=wp.int32)
    window_from: wp.array(dtype=wp.float64)
    window_to: wp.array(dtype=wp.float64)
    window_value: wp.array(dtype=wp.int32)


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
def evaluate(bank: Bank, program: int, x: wp.vec3d, t: wp.float64, slack: wp.float64) -> wp.float64:
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


@wp.func
def knot_after(bank: Bank, program: int, t: wp.float64, end: wp.float64) -> wp.float64:
    """The first entry after t of a program that is a table, or `end` where that comes first."""
    k = bank.start[program]
    if bank.code[k] == wp.static(_op("table")):
        table = int(bank.number[k])
        last = bank.table_start[table + 1]
        row = _first_at_or_after(bank.table_t, bank.table_start[table], last, t)
        if row < last and bank.table_t[wp.min(row, last - 1)] == t:
            row += 1
        if row < last:
            return wp.min(bank.table_t[row], end)
    return end


@wp.func
def holding(bank: Bank, program: int, clock: wp.array(dtype=wp.float64), second: wp.float64, part: wp.float64) -> int:
    """The program that holds at t + part dt in place of one of windows, -1 where none does; else the program itself. A time
    a rounding above the end of a window is still in it."""
    start = bank.window_start[program]
    end = bank.window_start[program + 1]
    if start == end:
        return program
    t = (time_of(clock) + (part - wp.float64(1.0e-9)) * dt_of(clock)) * second
    for k in range(start, end):
        if bank.window_from[k] < t and t <= bank.window_to[k]:
            return bank.window_value[k]
    return -1


@wp.func
def _of_table(bank: Bank, program: int, x: wp.vec3d, t: wp.float64, slack: wp.float64) -> wp.float64:
    """`evaluate` of a program that is a table."""
    return _look_up(bank, int(bank.number[bank.start[program]]), t, slack)


@cache
def between(tables: bool) -> wp.Function:
    """Warp function (bank, program, x, clock, second, from_dt, to_dt) -> a value, of a program without windows, at t +
    from_dt dt, or the mean of that and the one at t + to_dt dt where these differ; t and dt are those of a clock in units of
    `second` [s]. `tables`: all programs are tables, which is half of the compiling."""
    value_at = _of_table if tables else evaluate

    @wp.func
    def evaluate_between(
        bank: Bank,
        program: int,
        x: wp.vec3d,
        clock: wp.array(dtype=wp.float64),
        second: wp.float64,
        from_dt: wp.float64,
        to_dt: wp.float64,
    ) -> wp.float64:
        dt = dt_of(clock) * second
        t = time_of(clock) * second
        value = wp.float64(0.0)
        # A loop, so that the machine is compiled once.
        k = int(0)
        while k < wp.where(from_dt == to_dt, 1, 2):
            each = value_at(bank, program, x, t + wp.where(k == 0, from_dt, to_dt) * dt, wp.float64(1.0e-9) * dt)
            value = wp.where(k == 0, each, wp.float64(0.5) * (value + each))
            k += 1
        return value

    return evaluate_between


_between = between(False)


@wp.func
def evaluate_mean(
    bank: Bank,
    program: int,
    x: wp.vec3d,
    clock: wp.array(dtype=wp.float64),
    second: wp.float64,
    from_dt: wp.float64,
    to_dt: wp.float64,
) -> wp.float64:
    """The value of `between` of any program: zero where it is one of windows, and none is open at the later time."""
    which = holding(bank, program, clock, second, wp.max(from_dt, to_dt))
    if which < 0:
        return wp.float64(0.0)
    return _between(bank, which, x, clock, second, from_dt, to_dt)


def interval(c: float | tuple[float, float]) -> list[wp.float64]:
    """`from_dt` and `to_dt` of a part c of a step, or of c = (a, b), the mean of two."""
    first, last = c if isinstance(c, tuple) else (c, c)
    return [wp.float64(first), wp.float64(last)]


def places(points: np.ndarray) -> np.ndarray:
    """Points (k, dim) [m] as programs take them: (k, 3), zero beyond the dimensions."""
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def are_tables(values: list[Prescribed]) -> bool:
    """Whether the programs of values are all tables, those in windows too."""
    windowed = [each for value in values if isinstance(value, Windowed) for _, _, each in value.pieces]
    return not any(isinstance(value, Expression) for value in (*values, *windowed))


def bank_of(values: list[Prescribed], device: str) -> Bank:
    """Values as programs on the device, in their order; behind them those that hold in windows of theirs."""
    start, code, number = [0], [], []
    table_start, table_step, table_t, table_value = [0], [], [], []
    window_start, window_from, window_to, window_value = [0], [], [], []
    programs = list(values)
    for value in programs:
        if isinstance(value, Windowed):
            for begins, ends, each in value.pieces:
                window_from.append(begins)
                window_to.append(ends)
                window_value.append(len(programs))
                programs.append(each)
        elif isinstance(value, Expression):
            code += [c for c, _ in value.program]
            number += [v for _, v in value.program]
        else:
            code.append(OPERATIONS["table"])
            number.append(float(len(table_step)))
            table_step.append(int(value.interp == "step"))
            table_t += value.t or ()
            table_value += value.column
            table_start.append(len(table_t))
        start.append(len(code))
        window_start.append(len(window_from))
    bank = Bank()
    integers: Callable[[list[int]], wp.array] = lambda v: wp.array(v, dtype=wp.int32, device=device)  # noqa: E731
    doubles: Callable[[list[float]], wp.array] = lambda v: wp.array(v, dtype=wp.float64, device=device)  # noqa: E731
    bank.start, bank.code, bank.number = integers(start), integers(code or [0]), doubles(number or [0.0])
    bank.table_start, bank.table_step = integers(table_start), integers(table_step or [0])
    bank.table_t, bank.table_value = doubles(table_t or [0.0]), doubles([float(v) for v in table_value] or [0.0])
    bank.window_start, bank.window_value = integers(window_start), integers(window_value or [0])
    bank.window_from, bank.window_to = doubles(window_from or [0.0]), doubles(window_to or [0.0])
    return bank
