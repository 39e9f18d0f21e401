"""Springs and dashpots between particles and the ground, on the device: forces -K u and -C v, K and C symmetric matrices of
the area that each particle stands for.

Springs store u.K u/2, which the ledger counts as strain. Dashpots resist: integrators sum up what they change of the
velocities, so that what they dissipate is exact however long the step is beside the time in which they act.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, total
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.acting import ActingLoad
from wsph.protocols import Entry


@cache
def _kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)

    @kernel(ranged=True)
    def pull(
        first: int,
        particle: wp.array(dtype=wp.int32),
        matrix: wp.array(dtype=mat),
        field: wp.array(dtype=vec),
        force_out: wp.array(dtype=vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        force_out[i] = force_out[i] - matrix[k] * field[i]

    @kernel()
    def energy(
        count: int,
        particle: wp.array(dtype=wp.int32),
        stiffness: wp.array(dtype=mat),
        fields: Fields,
        energy_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        stored = wp.float64(0.0)
        for k in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            u = fields.displacement[particle[k]]
            stored += wp.float64(real(0.5) * wp.dot(u, stiffness[k] * u))
        energy_out[block] = stored

    return pull, energy


class Ground(ActingLoad):
    """Springs and dashpots of k particles, nondimensional.

    _particle   # (k,) int32
    _stiffness  # (k,) mat, where there are springs
    _damping    # (k,) mat, where there are dashpots
    _energy     # (blocks,) float64, at the end of the last step
    """

    def __init__(
        self,
        particle: np.ndarray,
        stiffness: np.ndarray | None,
        damping: np.ndarray | None,
        space: Space,
        clock: Clock,
        arrays: Arrays,
    ):
        """Of the particles `particle` (k,), with matrices (k, dim, dim)."""
        self._space, self._clock, self._count = space, clock, len(particle)
        self._particle = arrays.of("particle", particle, wp.int32)
        self._stiffness = self._damping = None
        if damping is not None:
            self._damping = arrays.of("damping", damping, space.mat)
        if stiffness is not None:
            self._stiffness = arrays.of("stiffness", stiffness, space.mat)
            self._energy = arrays.zeros("energy", blocks(self._count), wp.float64, kept=True)
            self.ledger = (Entry("strain", lambda: total(self._energy)),)

    def act(self, state: State, forces: wp.array) -> None:
        if self._stiffness is not None:
            pull, _ = _kernels(self._space, state.layout)
            inputs = [self._particle, self._stiffness, state.struct.displacement]
            self._clock.launch(pull, self._count, inputs, [forces])

    def resist(self, state: State, drags: wp.array) -> None:
        if self._damping is not None:
            pull, _ = _kernels(self._space, state.layout)
            inputs = [self._particle, self._damping, state.struct.velocity]
            self._clock.launch(pull, self._count, inputs, [drags])

    def start(self, state: State) -> None:
        self.advance(state)

    def advance(self, state: State) -> None:
        if self._stiffness is not None:
            _, energy = _kernels(self._space, state.layout)
            inputs = [self._count, self._particle, self._stiffness, state.struct]
            self._clock.launch(energy, len(self._energy), inputs, [self._energy])
