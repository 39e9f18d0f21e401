"""Work of the forces on a surface: on its particles the mean force of a step times the way in it."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.surfaces.attention import Attention
from wsph.contact.surfaces.carriers import Carriers
from wsph.parts.works import Works


@cache
def _work_kernel(space: Space) -> wp.Kernel:
    vec = space.vec

    @kernel(ranged=True)
    def work(
        first: int,
        blocks: wp.array(dtype=wp.int32),
        rows: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32),
        load: wp.array(dtype=vec),
        u: wp.array(dtype=vec),
        before_out: wp.array(dtype=vec),
        place_out: wp.array(dtype=vec),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        for k in range(blocks[block], blocks[block + 1]):
            s = rows[k]
            f = load[s]
            there = u[particle[s]]
            for a in range(wp.static(space.dim)):
                total += (wp.float64(f[a]) + wp.float64(before_out[s][a])) * wp.float64(there[a] - place_out[s][a])
            before_out[s] = f
            place_out[s] = there
        work_out[block, 0] = work_out[block, 0] + wp.float64(0.5) * total

    return work


class SurfaceWork(Works):
    """Work on the s particles that forces on a surface can reach, the `support`. Blocks are those of the support, whichever
    of it is attended to: so sums have the same bits.

    particle  # (s,) int32
    load      # forces of the last evaluation, (s,) vec
    _before   # those at the end of the last step, (s,) vec
    _place    # displacements there, (s,) vec
    """

    columns = 1

    def __init__(self, support: np.ndarray, space: Space, arrays: Arrays, carriers: Carriers):
        super().__init__(len(support), True, arrays.device)
        self._space, self._attention, self._carriers = space, None, carriers
        self.support = support
        arrays.take("work", self._work, kept=True, reset=self._work.zero_)
        self.particle: Array = arrays.of("support", support.astype(np.int32), wp.int32)
        self.load: Array = arrays.zeros("load", len(support), space.vec)
        self._before: Array = arrays.zeros("before_load", len(support), space.vec, kept=True)
        self._place: Array = arrays.zeros("place", len(support), space.vec)

    def attend(self, attention: Attention, u: np.ndarray) -> None:
        """Go over what is pushed alone; the rest feels nothing. `u` (particles, dim), displacements at the end of the last
        step."""
        self._attention = attention
        self._place.assign(u[self.support])
        for array in (self.load, self._before):
            forces = np.zeros((len(self.support), self._space.dim), self._space.numpy)
            forces[attention.pushed.host] = array.numpy()[attention.pushed.host]
            array.assign(forces)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        seen = self._attention
        if seen is None:
            raise RuntimeError("nothing is attended to yet")
        inputs = [seen.blocks, seen.pushed.device, self.particle, self.load, self._carriers.displacement(state)]
        return _work_kernel(self._space), inputs, [self._before, self._place]

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return self._total(0)
