"""Linear combinations of states, over their flat buffers."""

from functools import cache

import warp as wp

from wsph.backend.clock import Clock, dt_of
from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element, placed
from wsph.backend.space import Space

ENTRIES = 64
"""Entries of a buffer that one thread takes on a CPU, where a thread of its own costs more than an entry; on CUDA
neighbouring threads take neighbouring entries."""

Terms = list[tuple[float, wp.array]]
"""Coefficients and buffers."""


@wp.struct
class Span:
    """Entries `start` to `end` of a buffer, `each` a thread."""

    start: int
    end: int
    each: int


@cache
def _span(start: int, end: int, each: int) -> Span:
    found = Span()
    found.start, found.end, found.each = start, end, each
    return found


@cache
def _combine_kernel(space: Space, plain: int, timed: int, squared: int, adds: bool) -> wp.Kernel:
    """sum_out = c0 x0 + c1 x1 + c2 x2 + dt (c3 k0 + c4 k1 + c5 k2 + dt c6 k2), shortened to the terms that are given.
    `adds`: x0 is what `sum_out` holds. Read by that name, it hides no entry from the compiler, which then takes several at
    once."""
    real = space.scalar
    coefficients, at, put = space.vector(7), element(real), placed(real)

    @kernel(ranged=True)
    def combine(
        first: int,
        c: coefficients,
        span: Span,
        clock: wp.array(dtype=wp.float64),
        x0: wp.array(dtype=real),
        x1: wp.array(dtype=real),
        x2: wp.array(dtype=real),
        k0: wp.array(dtype=real),
        k1: wp.array(dtype=real),
        k2: wp.array(dtype=real),
        sum_out: wp.array(dtype=real),
    ):
        i = span.start + (first + wp.tid()) * span.each
        stop = wp.min(i + span.each, span.end)
        dt = real(dt_of(clock))
        while i < stop:
            total = real(0.0)
            if wp.static(adds):
                total = c[0] * at(sum_out, i)
            else:
                total = c[0] * at(x0, i)
            if wp.static(plain > 1):
                total += c[1] * at(x1, i)
            if wp.static(plain > 2):
                total += c[2] * at(x2, i)
            slope = real(0.0)
            if wp.static(timed > 0):
                slope += c[3] * at(k0, i)
            if wp.static(timed > 1):
                slope += c[4] * at(k1, i)
            if wp.static(timed > 2):
                slope += c[5] * at(k2, i)
            if wp.static(squared > 0):
                slope += dt * c[6] * at(k2, i)
            put(sum_out, i, total + dt * slope)
            i += 1

    return combine


def combine(
    space: Space, clock: Clock, plain: Terms, timed: Terms, squared: Terms, span: tuple[int, int], out: wp.array
) -> None:
    """`out` = sum of c x over `plain` + dt times the sum of c k over `timed` + dt^2 c k of `squared`, over the entries of
    `span` (a launch). One to three of `plain`, up to three rates, one of them squared; `out` may be one of all."""
    unused = plain[0][1]
    coefficients, arrays = [0.0] * 7, [unused] * 6
    for k, (c, x) in enumerate(plain):
        coefficients[k], arrays[k] = c, x
    for k, (c, x) in enumerate(timed):
        coefficients[3 + k], arrays[3 + k] = c, x
    if squared:
        coefficients[6], arrays[5] = squared[0]
    start, end = span
    each = 1 if wp.get_device(clock.device).is_cuda else ENTRIES
    inputs = [space.vector(7)(*coefficients), _span(start, end, each), clock.time, *arrays]
    made = _combine_kernel(space, len(plain), len(timed), len(squared), unused.ptr == out.ptr)
    clock.launch(made, -(-(end - start) // each), inputs, [out])


@cache
def clear_kernel(dtype: type) -> wp.Kernel:
    """Every element of an array zero."""

    @kernel(ranged=True)
    def clear(first: int, array_out: wp.array(dtype=dtype)):
        array_out[first + wp.tid()] = dtype()

    return clear
