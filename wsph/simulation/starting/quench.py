"""Kinetic damping of a body: its velocities are set to zero where its kinetic energy has passed a peak.

A body that swings about its equilibrium has most kinetic energy where it passes that. Stopped there it goes on from the
least elastic energy of the way, and falls towards the equilibrium again from nearer (Cundall 1976; Barnes 1999): it comes to
rest without a rate of damping to choose. A peak is known a step later, when motions that take few steps are as far beyond
the equilibrium as they were before it: so a body goes back to the step of the peak, with all that a checkpoint would hold of
it. The kinetic energy is summed up in blocks of fixed size, so that a peak is found at the same step for any number of
threads. All of it are launches: steps are captured in blocks.

Peaks that are as low as asked of a body at rest are left alone: what is fast would keep what is slow from showing.
"""

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.ranks.kept import Piece, Rows

KINETIC, FELL, FLOOR, HIGHEST, TAKEN, PEAKS, SINCE, LONGEST, AGO = range(9)
"""Entries of the memory: kinetic energy after the last step; whether it passed a peak there, 1 or 0; the kinetic energy up
to which a peak is none; the largest since the memory was last read; the energy taken so far; the number of peaks; steps
since the last one; the longest way between two, in steps; and steps so far."""

WORDS = 64
"""Words that one thread copies."""


@cache
def quench_kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    """Kernels: the kinetic energy in blocks, the judgement of a peak by one thread, and the stop of every particle."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def kinetic(
        first: int,
        mass: wp.array(dtype=real),
        fields: Fields,
        low: int,
        end: int,
        kinetic_out: wp.array(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            v = fields.velocity[i]
            total += wp.float64(real(0.5) * mass[i] * wp.dot(v, v))
        kinetic_out[block] = total

    @kernel()
    def judge(parts: wp.array(dtype=wp.float64), count: int, memory_out: wp.array(dtype=wp.float64)):
        now = wp.float64(0.0)
        for block in range(count):
            now += parts[block]
        before = memory_out[KINETIC]
        memory_out[SINCE] = memory_out[SINCE] + wp.float64(1.0)
        memory_out[AGO] = memory_out[AGO] + wp.float64(1.0)
        memory_out[HIGHEST] = wp.max(memory_out[HIGHEST], now)
        memory_out[KINETIC] = now
        memory_out[FELL] = wp.float64(0.0)
        if now < before and before > memory_out[FLOOR]:
            memory_out[LONGEST] = wp.max(memory_out[LONGEST], memory_out[SINCE])
            memory_out[TAKEN] = memory_out[TAKEN] + before
            memory_out[PEAKS] = memory_out[PEAKS] + wp.float64(1.0)
            memory_out[FELL] = wp.float64(1.0)
            memory_out[SINCE] = wp.float64(0.0)
            memory_out[KINETIC] = wp.float64(0.0)

    @kernel(ranged=True)
    def stop(first: int, memory: wp.array(dtype=wp.float64), fields_out: Fields):
        if memory[FELL] > wp.float64(0.0):
            fields_out.velocity[first + wp.tid()] = vec()

    return kinetic, judge, stop


def _words(array: wp.array) -> wp.array:
    """An array as words of 8 bytes, or of 4."""
    size = array.size * wp.types.type_size_in_bytes(array.dtype)
    word, width = (wp.int64, 8) if size % 8 == 0 else (wp.int32, 4)
    return wp.array(ptr=array.ptr, dtype=word, shape=size // width, device=array.device, copy=False)


@cache
def _back_kernel(word: type) -> wp.Kernel:
    """Words of an array as they were a step ago where a peak was passed; else the copy of them as they are now."""

    @kernel(ranged=True)
    def back(
        first: int,
        memory: wp.array(dtype=wp.float64),
        count: int,
        now_out: wp.array(dtype=word),
        before_out: wp.array(dtype=word),
    ):
        start = (first + wp.tid()) * wp.static(WORDS)
        fell = memory[FELL] > wp.float64(0.0)
        for i in range(start, wp.min(start + wp.static(WORDS), count)):
            if fell:
                now_out[i] = before_out[i]
            else:
                before_out[i] = now_out[i]

    return back


class Quench:
    """Kinetic damping of a body of n particles, on the device. Processes that share the body find its peaks together.

    _mass    # (n,) scalar
    _parts   # (blocks,) float64, the kinetic energy of the last step, of the particles that a process owns
    _whole   # (all blocks,) float64, the same of all processes
    _kept    # arrays that the body goes on from, as words, and what they held a step ago
    _before  # by their names, what those arrays held a step ago
    memory   # (AGO + 1,) float64, entries as KINETIC to AGO say, energies nondimensional
    """

    def __init__(
        self,
        space: Space,
        layout: Layout,
        mass: np.ndarray,
        body: Arrays,
        arrays: Arrays,
        share: Share,
        domain: Domain = WHOLE,
        bring: Callable[[], None] | None = None,
    ):
        """Of the mass (n,) of its particles, nondimensional, and the arrays of the `body`; `share`: the particles that it
        has; `bring`: brings copies up to date, where those of a step ago may be none that this step needs."""
        self._kernels, self._count = quench_kernels(space, layout), len(mass)
        self._share, self._domain, self._bring = share, domain, bring
        self._mass = arrays.of("mass", mass, space.scalar)
        self._parts = arrays.zeros("parts", blocks(share.high - share.low), wp.float64)
        self._whole = self._parts if domain.size == 1 else arrays.zeros("whole", blocks(share.whole), wp.float64)
        self.memory = arrays.zeros("memory", AGO + 1, wp.float64)
        # Where pairs were last found is the host's, which does not go back.
        kept = {name: array for name, array in body.kept.items() if not name.endswith("skin.found")}
        self._before = {name: arrays.zeros(f"before.{name}", each.shape, each.dtype) for name, each in kept.items()}
        self._kept = [(_words(kept[name]), _words(each)) for name, each in self._before.items() if each.size]

    @property
    def kernels(self) -> tuple[wp.Kernel, ...]:
        """All that it launches."""
        return (*self._kernels, *{_back_kernel(now.dtype) for now, _ in self._kept})

    def kept(self) -> dict[str, wp.array]:
        """The arrays that a checkpoint holds of it, by name."""
        return {"memory": self.memory, **{f"before.{name}": before for name, before in self._before.items()}}

    def pieces(self, body: Mapping[str, list[Piece]]) -> dict[str, list[Piece]]:
        """Where they stand in those of all processes; `body`: the same of the arrays of the body."""
        memory = Piece(0, 0, Rows.alike(len(self.memory), self._domain))
        return {"memory": [memory], **{f"before.{name}": body[name] for name in self._before}}

    def act(self, state: State, clock: Clock) -> None:
        """After a step: stop what has passed a peak (launches). `state` is what the step has advanced."""
        kinetic, judge, stop = self._kernels
        own = self._share.own
        clock.launch(kinetic, len(self._parts), [self._mass, state.struct, own.start, own.stop], [self._parts])
        if self._domain.size > 1:
            clock.host(self._put_together)
        clock.launch(judge, 1, [self._whole, len(self._whole)], [self.memory])
        for now, before in self._kept:
            inputs = [self.memory, len(now)]
            clock.launch(_back_kernel(now.dtype), -(-len(now) // WORDS), inputs, [now, before])
        clock.launch(stop, self._count, [self.memory], [state.struct])
        if self._bring is not None and self._domain.size > 1:
            clock.host(self._up_to_date)

    def _up_to_date(self) -> None:
        """Have what others own as they have gone back to it."""
        if self._bring is not None and self.memory.numpy()[FELL] > 0.0:
            self._bring()

    def _put_together(self) -> None:
        """Have the parts of all processes, in their order."""
        self._whole.assign(self._domain.joined(self._parts.numpy()))

    def read(self, floor: float) -> np.ndarray:
        """The memory, (AGO + 1,) (a copy). From now on the largest kinetic energy is of the steps to come, and a peak one
        above `floor`."""
        found = self.memory.numpy().copy()
        again = found.copy()
        again[HIGHEST], again[FLOOR] = 0.0, floor
        self.memory.assign(again)
        return found
