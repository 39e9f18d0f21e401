"""Cells between prescribed particles: they move as their corners do.

A virtual particle all of whose corners have a component of the velocity prescribed cannot move otherwise. Were it
accelerated in the half step, by gravity or by stresses that the corners do not answer, the one-sided gradients at the faces
of the patch would take dt/2 times that acceleration for a strain rate, and stress would build up that nobody does work on.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.conditions import Conditions
from wsph.geometry.lattice import Lattice


@cache
def _carry_kernel(space: Space, virtual: Layout, real_layout: Layout) -> wp.Kernel:
    real, dim, corners = space.scalar, space.dim, 2**space.dim
    Real, Virtual = fields_struct(space, real_layout), fields_struct(space, virtual)

    @kernel(ranged=True)
    def carry(
        first: int,
        cells: wp.array(dtype=wp.int32),
        held: wp.array(dtype=wp.int32),
        corner: wp.array2d(dtype=wp.int32),
        imposed: Real,
        fields_out: Virtual,
    ):
        e = first + wp.tid()
        v = fields_out.velocity[cells[e]]
        for c in range(wp.static(dim)):
            if (held[e] >> c) & 1 == 1:
                v[c] = real(0.0)
                for k in range(wp.static(corners)):
                    v[c] = v[c] + real(wp.static(1.0 / corners)) * imposed.velocity[corner[e, k]][c]
        fields_out.velocity[cells[e]] = v

    return carry


class CarriedCells:
    """The cells of a body that have a component of the velocity prescribed at all their corners. Of k cells:

    _cells   # (k,) int32
    _held    # (k,) int32, bit c where component c is prescribed
    _corner  # (k, 2^dim) int32, the real particles at the corners, whose mean place is the cell's
    """

    def __init__(self, space: Space, conditions: Conditions, lattice: Lattice, device: str):
        held = conditions.prescribed("velocity", space.dim, len(lattice.nodes))
        bits = (held[lattice.corners].all(1) << np.arange(space.dim)).sum(1)
        cells = np.flatnonzero(bits)
        self.count = len(cells)
        if self.count:
            self._space = space
            self._cells: Array = wp.array(cells, dtype=wp.int32, device=device)
            self._held: Array = wp.array(bits[cells], dtype=wp.int32, device=device)
            self._corner: Array = wp.array(lattice.corners[cells], dtype=wp.int32, device=device)

    def carry(self, clock: Clock, imposed: State, virtual: State) -> None:
        """Give them the prescribed velocities of `imposed`, means of both ends of the step (a launch, if there are any)."""
        if self.count:
            kernel = _carry_kernel(self._space, virtual.layout, imposed.layout)
            clock.launch(kernel, self.count, [self._cells, self._held, self._corner, imposed.struct], [virtual.struct])
