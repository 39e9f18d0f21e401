"""Forces across a plane of a body in the current configuration, where images hang at its walls.

The part of the forces that comes of one particle's stress, on it and on its neighbours, has no resultant and no moment once
its images are counted. So a plane feels those particles alone that see both of its sides: what those behind it, all of whose
neighbours are there, do by themselves cancels, and beside a wall it does so with images only.
"""

from functools import cache

import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.updated.memory import memory_struct
from wsph.parts.terms import answers_struct
from wsph.sph.images import images_struct
from wsph.sph.rows import rows_struct


@cache
def _astride_kernel(space: Space, form: Form) -> wp.Kernel:
    vec, mat, Rows, remembers = space.vec, space.mat, rows_struct(space), form.remembers

    @kernel(ranged=True)
    def astride(
        first: int,
        rows: Rows,
        side: wp.array(dtype=wp.int32),
        corrected: wp.array(dtype=mat),
        pull: wp.array(dtype=vec),
        corrected_out: wp.array(dtype=mat),
        pull_out: wp.array(dtype=vec),
    ):
        i = first + wp.tid()
        A = mat()
        q = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            if side[rows.indices[k]] != side[i]:
                A = corrected[i]
                if wp.static(remembers):
                    q = pull[i]
        corrected_out[i] = A
        if wp.static(remembers):
            pull_out[i] = q

    return astride


class Cut:
    """What forces take of n particles, of those that see both sides of a plane alone, and without images."""

    def __init__(self, space: Space, form: Form, n: int, clock: Clock, arrays: Arrays):
        self._space, self._form, self._clock = space, form, clock
        self._no_image = arrays.zeros("no image", n + 1, wp.int32)
        self._corrected = arrays.zeros("corrected", n, space.mat)
        self._pull = arrays.zeros("pull", n if form.remembers else 1, space.vec)

    def coefficients(self, whole: object) -> object:
        """The coefficients without images."""
        alone = coefficients_of(self._space, self._form)()
        for name in ("speed", "h", *self._form.numbers):
            setattr(alone, name, getattr(whole, name))
        images = images_struct(self._space)()
        for name in ("indices", "parent", "kind", "turn", "flip", "shift", "going", "drive"):
            setattr(images, name, getattr(whole.images, name))
        images.offsets = self._no_image
        alone.images = images
        return alone

    def answers(
        self, rows: object, side: wp.array, answers: object, memory: object, some: slice
    ) -> tuple[object, object]:
        """Answers and memory of the particles that see both sides, `side` (n,) int32, zero of the others, of `some` in a
        range (a launch)."""
        inputs, made = [rows, side, answers.corrected, memory.pull], _astride_kernel(self._space, self._form)
        self._clock.launch(made, some.stop - some.start, inputs, [self._corrected, self._pull], some.start)
        found, kept = answers_struct(self._space)(), memory_struct(self._space)()
        found.mean, found.extra, found.corrected, kept.pull = answers.mean, answers.extra, self._corrected, self._pull
        return found, kept
