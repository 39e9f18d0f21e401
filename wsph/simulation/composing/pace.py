"""How fast this machine is, by some steps of a scene and by copies of memory."""

# pyright: strict

import time

import numpy as np
import warp as wp

from wsph.simulation.composing.composition import Composition

MEASURED_SECONDS = 0.5
"""Time that is spent on measuring a step [s]."""

COPIED = 2**22
"""Bytes that are copied to measure the rate of memory."""


def measured(composition: Composition) -> float:
    """The time of a step of one thread for a particle [s]."""
    composition.compile()
    program, best, end = composition.program, np.inf, time.perf_counter() + MEASURED_SECONDS
    program.run(2)
    while time.perf_counter() < end:
        began = time.thread_time()
        program.run(4)
        wp.synchronize_device(composition.device)
        best = min(best, (time.thread_time() - began) / 4.0)
    return best / composition.particles


def copied() -> float:
    """The rate at which memory is copied [bytes/s]."""
    here, there, best = np.ones(COPIED // 8), np.zeros(COPIED // 8), np.inf
    for _ in range(5):
        began = time.perf_counter()
        np.copyto(there, here)
        best = min(best, time.perf_counter() - began)
    return COPIED / best
