"""Linear combinations of states: one kernel over their flat buffers."""

from functools import cache

import warp as wp

from wsph.backend.pair_loops import element, placed
from wsph.backend.space import Space

ENTRIES = 64
"""Entries of a buffer that one thread of `combine_kernel` takes on a CPU, where a thread of its own costs more than an
entry; on CUDA neighbouring threads take neighbouring entries."""


@cache
def combine_kernel(space: Space, plain: int, timed: int, squared: int) -> wp.Kernel:
    """out = sum of up to three states, up to three rates times dt, and one times dt^2, over entries `start` to `end` of the
    flat buffer, `entries` a thread."""
    real = space.scalar
    coefficients, at, put = space.vector(7), element(real), placed(real)

    @wp.kernel(module="unique", enable_backward=False)
    def combine(first: int, clock: wp.array(dtype=wp.float64), start: int, end: int, entries: int, c: coefficients, x0: wp.array(dtype=real), x1: wp.array(dtype=real),
                x2: wp.array(dtype=real), k0: wp.array(dtype=real), k1: wp.array(dtype=real), k2: wp.array(dtype=real),
                out: wp.array(dtype=real)):  # fmt: skip
        i = start + (first + wp.tid()) * entries
        stop = wp.min(i + entries, end)
        dt = real(clock[1])
        while i < stop:
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
            put(out, i, total + dt * slope)
            i += 1

    return combine
