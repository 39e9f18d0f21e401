"""A formulation of its own: bond forces between particles (Silling 2000), in one dimension.

Every pair is a spring along its line, f_ij = c V_i V_j (u_j - u_i)/|X_j - X_i|, with c such that a uniform strain has the
energy of the material: sum_j c V_j |X_j - X_i|/2 = E about every particle, ends included. A bond carries a force and no
stress: the stress of this formulation stays zero, and the energy of the bonds is an entry of the ledger.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.errors import Refused
from wsph.formulations.lagrangian.flow import drift_kernel
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Setup
from wsph.parts.part import Attached
from wsph.protocols import Entry
from wsph.sph.pairs import find_pairs
from wsph.sph.rows import rows_of, rows_struct


@cache
def _bond_kernel(space: Space, layout: Layout) -> wp.Kernel:
    """Accelerations, sum_j k_ij (u_j - u_i) with the loads over the mass, and du/dt = v."""
    vec, Fields, Rows = space.vec, fields_struct(space, layout), rows_struct(space)

    @kernel(ranged=True)
    def bonds(
        first: int,
        rows: Rows,
        mass: wp.array(dtype=space.scalar),
        loads: wp.array(dtype=vec),
        loaded: int,
        fields: Fields,
        rate_out: Fields,
    ):
        i = first + wp.tid()
        force = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            force += rows.weight[k] * (fields.displacement[rows.indices[k]] - fields.displacement[i])
        if loaded != 0:
            force += loads[i]
        rate_out.velocity[i] = force / mass[i]

    return bonds


_drift_kernel = cache(drift_kernel)
"""Of du/dt = v."""


class BondRates:
    """The right-hand sides of a bar of bonds."""

    seen = None

    def __init__(self, made: RateSetup, state: State):
        host, placement, space = made.host, made.placement, made.host.space
        if space.dim != 1 or made.loads.acting:
            raise Refused(f"body {host.name!r}: bond forces are for bars, without loads that follow the state")
        self._space, self._clock, self._state, self._loads = space, made.setup.clock, state, made.loads
        self.form = made.form(loaded=made.loads.count > 0)
        arrays, device, scale = made.arrays.part("rates"), made.setup.device, host.scales
        place = placement.position / scale.length
        self.neighbours = find_pairs(place, place, host.support, device, same=True)
        rows, indices = self.neighbours.rows(), self.neighbours.indices.numpy()
        length, volume = np.abs(place[indices] - place[rows])[:, 0], placement.volume
        modulus = host.youngs_modulus / scale.stress
        # Each end of a bond wants its own c: the mean keeps momentum.
        c = 2.0 * modulus / np.bincount(rows, volume[indices] * length, placement.count)
        self._stiffness = 0.5 * (c[rows] + c[indices]) * volume[rows] * volume[indices] / length
        self._rows = rows_of(space, self.neighbours, arrays.of("stiffness", self._stiffness, space.scalar))
        self._mass = arrays.of("mass", made.density * volume, space.scalar)
        self.holding = arrays.zeros("holding", 1, space.vec)
        for name in ("offsets", "indices", "reach"):
            arrays.take(name, getattr(self.neighbours, name))

    @property
    def pairs(self) -> int:
        return self.neighbours.count

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        if part != "rest":
            inputs = [self._rows, self._mass, self._loads.vectors, int(self.form.loaded), state.struct]
            self._clock.launch(_bond_kernel(self._space, state.layout), state.n, inputs, [out.struct])
        if part != "velocity":
            self._clock.launch(_drift_kernel(self._space, state.layout), state.n, [state.struct], [out.struct])

    def refresh(self, state: State) -> None:
        """Nothing is derived."""

    def held_energy(self, state: State) -> float:
        return 0.0

    def bond_energy(self) -> float:
        """sum over bonds of k |u_j - u_i|^2/2, nondimensional."""
        u, rows = self._state.read("displacement")[:, 0], self.neighbours.rows()
        return 0.25 * float(self._stiffness @ (u[self.neighbours.indices.numpy()] - u[rows]) ** 2)

    def attach(self, parts: list[Attached]) -> None:
        """No part has anything here."""

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """Nor has it itself."""
        return {}

    def follow(self) -> bool:
        return False

    def restored(self) -> None:
        """Nothing follows from what is kept."""


class BondSystem(OneSetSystem):
    """A bar of bonds, with their energy on the ledger."""

    @property
    def ledger(self) -> tuple[Entry, ...]:
        return (*super().ledger, Entry("strain", self.rates.bond_energy))


def build(setup: Setup) -> OneSetSystem:
    """A body of bonds."""
    return BondSystem(setup, BondRates)
