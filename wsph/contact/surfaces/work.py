"""Work of the forces on a surface: on its particles the mean force of a step times the way in it."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import total
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.surfaces.attention import Attention


@cache
def _work_kernel(space: Space) -> wp.Kernel:
    vec = space.vec

    @kernel(ranged=True)
    def work(
        first: int,
        rows: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32),
        load: wp.array(dtype=vec),
        u: wp.array(dtype=vec),
        before_out: wp.array(dtype=vec),
        place_out: wp.array(dtype=vec),
        work_out: wp.array(dtype=wp.float64),
    ):
        s = rows[first + wp.tid()]
        f = load[s]
        there = u[particle[s]]
        total = wp.float64(0.0)
        for a in range(wp.static(space.dim)):
            total += (wp.float64(f[a]) + wp.float64(before_out[s][a])) * wp.float64(there[a] - place_out[s][a])
        before_out[s] = f
        place_out[s] = there
        work_out[s] = work_out[s] + wp.float64(0.5) * total

    return work


class SurfaceWork:
    """Work on the s particles here that forces on a surface can reach, the `support`, each by itself: right on those that
    are this process's own, its `share` of all.

    particle  # where they stand among the particles here, (s,) int32
    load      # forces of the last evaluation, (s,) vec
    _work     # so far, (s,) float64, nondimensional
    _before   # forces at the end of the last step, (s,) vec
    _place    # displacements there, (s,) vec
    """

    def __init__(self, support: np.ndarray, share: Share, space: Space, arrays: Arrays, domain: Domain = WHOLE):
        self._space, self._share, self._domain = space, share, domain
        self._attention: Attention | None = None
        self.support = support
        s = len(support)
        self._work = arrays.zeros("work", s, wp.float64, kept=True)
        self.particle: Array = arrays.of("support", support.astype(np.int32), wp.int32)
        self.load: Array = arrays.zeros("load", s, space.vec)
        self._before: Array = arrays.zeros("before_load", s, space.vec, kept=True)
        self._place: Array = arrays.zeros("place", s, space.vec)

    def attend(self, attention: Attention, u: np.ndarray) -> None:
        """Go over what is pushed alone; the rest feels nothing. `u` (n, dim), displacements of the particles here at the
        end of the last step."""
        self._attention = attention
        self._place.assign(u[self.support])
        for array in (self.load, self._before):
            forces = np.zeros((len(self.support), self._space.dim), self._space.numpy)
            forces[attention.pushed.host] = array.numpy()[attention.pushed.host]
            array.assign(forces)

    def add(self, state: State, clock: Clock) -> None:
        """Add the work of a step whose final values stand in `state` (a launch)."""
        seen = self._attention
        if seen is None:
            raise RuntimeError("nothing is attended to yet")
        inputs = [seen.pushed.device, self.particle, self.load, state.struct.displacement]
        outputs = [self._before, self._place, self._work]
        if seen.pushed.count:
            clock.launch(_work_kernel(self._space), seen.pushed.count, inputs, outputs)

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        self.add(state, clock)
        self._work.zero_()

    def shares(self) -> dict[str, Share]:
        """The parts of kept arrays that this process has, by their names."""
        return dict.fromkeys(("work", "before_load"), self._share)

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return total(self._work, self._domain, self._share.own)
