"""A spring foundation: a load that follows the state.

Every particle of the selected faces is held by a spring of `stiffness` k [Pa/m, written "N/m3"] per area A: f = -k A u, with
the energy k A |u|^2/2 on the ledger as strain.
"""

from functools import cache
from typing import Annotated, ClassVar

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.acting import ActingLoad, Load
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.protocols import Entry
from wsph.quantities import Unit
from wsph.units import Scales


class Spring(Load):
    """Springs to the ground: `stiffness` per area [N/m3]."""

    key: ClassVar[str] = "foundation"
    stiffness: Annotated[float, Unit("N/m3", gt=0)]

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        return Springs(
            self.stiffness * scales.length / scales.stress * faces.area, faces.particle, space, clock, arrays
        )


@cache
def _pull_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """f -= k u, over the particles that are held."""
    Fields = fields_struct(space, layout)

    @kernel(ranged=True)
    def pull(
        first: int,
        particle: wp.array(dtype=wp.int32),
        stiffness: wp.array(dtype=space.scalar),
        fields: Fields,
        force_out: wp.array(dtype=space.vec),
    ):
        k = first + wp.tid()
        i = particle[k]
        force_out[i] = force_out[i] - stiffness[k] * fields.displacement[i]

    return pull


class Springs(ActingLoad):
    """Springs on the device; `stiffness` (k,) nondimensional."""

    def __init__(self, stiffness: np.ndarray, particle: np.ndarray, space: Space, clock: Clock, arrays: Arrays):
        self._space, self._clock, self._state = space, clock, None
        self._held, self._k = particle, stiffness
        self._particle = arrays.of("particle", particle, wp.int32)
        self._stiffness = arrays.of("stiffness", stiffness, space.scalar)
        self.ledger = (Entry("strain", lambda: self.energy),)

    def act(self, state: State, forces: wp.array) -> None:
        pull = _pull_kernel(self._space, state.layout)
        self._clock.launch(pull, len(self._held), [self._particle, self._stiffness, state.struct], [forces])

    def advance(self, state: State) -> None:
        self._state = state

    @property
    def energy(self) -> float:
        """k A |u|^2/2, nondimensional."""
        if self._state is None:
            return 0.0
        return 0.5 * float(self._k @ (self._state.read("displacement")[self._held] ** 2).sum(1))
