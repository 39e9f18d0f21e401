"""Springs between faces and the ground: a traction -k u, k [N/m3], in every direction.

Every particle of the selected faces is held by the area A that it stands for, f = -k A u, with the energy k A |u|^2/2, which
the ledger counts as strain.
"""

from functools import cache
from typing import Annotated, ClassVar

import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, total
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.acting import ActingLoad, Load, LoadedFaces
from wsph.protocols import Entry
from wsph.quantities import Unit
from wsph.units import Scales


class Spring(Load):
    """Springs to the ground, of `stiffness` per area [N/m3]."""

    key: ClassVar[str] = "spring"
    stiffness: Annotated[float, Unit("N/m3", gt=0)]

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        return Springs(self.stiffness * scales.length / scales.stress, faces, space, clock, arrays)


@cache
def _kernels(space: Space, layout: Layout) -> tuple[wp.Kernel, wp.Kernel]:
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def pull(
        first: int,
        particle: wp.array(dtype=wp.int32),
        stiffness: wp.array(dtype=real),
        fields: Fields,
        force_out: wp.array(dtype=vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        force_out[i] = force_out[i] - stiffness[k] * fields.displacement[i]

    @kernel()
    def energy(
        count: int,
        particle: wp.array(dtype=wp.int32),
        stiffness: wp.array(dtype=real),
        fields: Fields,
        energy_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        stored = wp.float64(0.0)
        for k in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            u = fields.displacement[particle[k]]
            stored += wp.float64(real(0.5) * stiffness[k] * wp.dot(u, u))
        energy_out[block] = stored

    return pull, energy


class Springs(ActingLoad):
    """Springs on the device, k of them, nondimensional.

    _particle   # (k,) int32
    _stiffness  # (k,), of the area that each particle stands for
    _energy     # (blocks,) float64, at the end of the last step
    """

    def __init__(self, stiffness: float, faces: LoadedFaces, space: Space, clock: Clock, arrays: Arrays):
        self._space, self._clock, self._count = space, clock, len(faces.particle)
        self._particle = arrays.of("particle", faces.particle, wp.int32)
        self._stiffness = arrays.of("stiffness", stiffness * faces.area, space.scalar)
        self._energy = arrays.zeros("energy", blocks(self._count), wp.float64, kept=True)
        self.ledger = (Entry("strain", lambda: total(self._energy)),)

    def act(self, state: State, forces: wp.array) -> None:
        pull, _ = _kernels(self._space, state.layout)
        self._clock.launch(pull, self._count, [self._particle, self._stiffness, state.struct], [forces])

    def advance(self, state: State) -> None:
        _, energy = _kernels(self._space, state.layout)
        inputs = [self._count, self._particle, self._stiffness, state.struct]
        self._clock.launch(energy, len(self._energy), inputs, [self._energy])
