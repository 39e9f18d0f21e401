"""Sliding particles on the device (`wsph.boundary.slide` has the rule)."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, total
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.forces import LoadForces
from wsph.boundary.slide import Slides


@cache
def _slide_kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)

    @kernel(ranged=True)
    def slide(
        first: int,
        particle: wp.array(dtype=wp.int32),
        left: wp.array(dtype=mat),
        given: wp.array(dtype=vec),
        fields_out: Fields,
        before_out: wp.array(dtype=vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        v = fields_out.velocity[i]
        before_out[k] = v
        fields_out.velocity[i] = left[k] * v + given[i]

    @kernel()
    def work(
        count: int,
        particle: wp.array(dtype=wp.int32),
        mass: wp.array(dtype=real),
        before: wp.array(dtype=vec),
        fields: Fields,
        old_out: wp.array(dtype=vec),
        work_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        done = wp.float64(0.0)
        for k in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            v = fields.velocity[particle[k]]
            done += wp.float64(real(0.5) * mass[k] * wp.dot(v - before[k], v + old_out[k]))
            old_out[k] = v
        work_out[block] = work_out[block] + done

    return slide, work


class Sliding:
    """Sliding particles on the device, k of n, nondimensional.

    _particle  # (k,) int32
    _free      # (k,) mat, I - N^+ N
    _given     # (n,) vec, N^+ g of the last time imposed
    _still     # (n,) vec, zeros in its place while the clock is still, where it has been
    _before    # (k,) vec, velocities before they were last set
    _mass      # (k,)
    _old       # (k,) vec, velocities at the end of the last step
    _work      # (blocks,) float64, work of setting them so far
    """

    _still: wp.array | None = None

    def __init__(
        self,
        slides: Slides,
        space: Space,
        position: np.ndarray,
        mass: np.ndarray,
        units: tuple[float, float],
        arrays: Arrays,
        layout: Layout,
    ):
        """`units`: of velocity [m/s] and of time [s]."""
        self._count = len(slides.particle)
        self._slide, self._add = _slide_kernels(space, layout)
        self._particle = arrays.of("particle", slides.particle, wp.int32)
        self._free = arrays.of("free", slides.free, space.mat)
        self._given = arrays.zeros("given", len(position), space.vec, kept=True)
        self._values = LoadForces(space, slides.given, self._given, position, *units, arrays.device)
        self._before = arrays.zeros("before", self._count, space.vec)
        self._mass = arrays.of("mass", mass[slides.particle], space.scalar)
        self._old = arrays.zeros("old", self._count, space.vec, kept=True)
        self._work = arrays.zeros("work", blocks(self._count), wp.float64, kept=True)

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the velocities of t + c dt along the normals (launches)."""
        given = self._given
        if clock.still:
            self._still = self._still if self._still is not None else wp.zeros_like(given)
            given = self._still
        else:
            self._values.impose(clock, c)
        inputs = [self._particle, self._free, given]
        clock.launch(self._slide, self._count, inputs, [state.struct, self._before])

    def count_work(self, state: State, clock: Clock) -> None:
        """Add the work of having set them (a launch)."""
        inputs = [self._count, self._particle, self._mass, self._before, state.struct]
        clock.launch(self._add, len(self._work), inputs, [self._old, self._work])

    def start(self, state: State) -> None:
        """Take the velocities at the start of the run."""
        self._old.assign(state.read("velocity")[self._particle.numpy()])

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return total(self._work)
