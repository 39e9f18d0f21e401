"""Energy of the residual at the cells of a lattice: its sum, and what a falling stiffness sets free of it."""

from collections.abc import Callable
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays, host
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.formulations.lattice.cell import cell_struct
from wsph.formulations.lattice.lanes import block_of, corner_misfit, places_of
from wsph.formulations.lattice.runs import HEAD, PLACE
from wsph.parts.fading import faded
from wsph.parts.part import Attached
from wsph.protocols import Entry


@cache
def held_kernel(space: Space, layout: Layout, width: int, fades: bool) -> wp.Kernel:
    """Kernel of the energy of the residual, a sum for every block of cells. `fades`: its stiffness is what they handed
    on."""
    real, Fields, Cells, square = space.scalar, fields_struct(space, layout), cell_struct(space), corner_misfit(space)
    block, at = block_of(space.dim, 2), (space.dim**2 + space.dim) * places_of(width)
    columns = HEAD + 2**space.dim

    @kernel()
    def held(
        cell: Cells,
        blocks: wp.array(dtype=wp.int32),
        chunks: wp.array(dtype=real),
        fields: Fields,
        energy_out: wp.array(dtype=wp.float64),
    ):
        b, _i, _lane, _rows, own = block(blocks, wp.tid())
        total = wp.float64(0.0)
        for e in range(own):
            stiffness = cell.hold * cell.share
            if wp.static(fades):
                stiffness = chunks[at + blocks[b * columns + PLACE] + e]
            total += wp.float64(real(0.5) * stiffness * square(blocks, b, e, fields.displacement))
        energy_out[b] = total

    return held


@cache
def fade_kernel(space: Space, layout: Layout, internal: int, Common: type, held_of: wp.Function) -> wp.Kernel:
    """What the residual of each row has set free in a step. `held_of` (common, blocks, block, row, place, displacement):
    twice the energy that a row's whole stiffness holds, from what all rows have in common."""
    real, zeta, Fields, block = space.scalar, faded(space), fields_struct(space, layout), block_of(space.dim, 2)

    @kernel(ranged=True)
    def fade(
        first: int,
        yields: real,
        common: Common,
        blocks: wp.array(dtype=wp.int32),
        fields: Fields,
        zeta_out: wp.array(dtype=real),
        freed_out: wp.array(dtype=real),
    ):
        b, i0, _lane, _rows, own = block(blocks, first + wp.tid())
        for e in range(own):
            i = i0 + e
            new = zeta(yields * fields.internals[i][wp.static(internal)])
            old = zeta_out[i]
            if new < old:
                held = held_of(common, blocks, b, e, i, fields.displacement)
                freed_out[i] = freed_out[i] + real(0.5) * held * (old - new)
                zeta_out[i] = new

    return fade


@cache
def held_of_cells(space: Space) -> wp.Function:
    """`held_of` of `fade_kernel`, of cells."""
    Cells, square = cell_struct(space), corner_misfit(space)

    @wp.func
    def held(
        cell: Cells, blocks: wp.array(dtype=wp.int32), block: int, row: int, place: int, u: wp.array(dtype=space.vec)
    ) -> space.scalar:
        return cell.hold * cell.share * square(blocks, block, row, u)

    return held


class RowFading(Attached):
    """`wsph.parts.fading.Fading` of the rows of a lattice: evaluations write what is left of the residual themselves."""

    def __init__(
        self,
        fade: wp.Kernel,
        flow: tuple[int, float],
        common: object,
        blocks: Array,
        count: tuple[int, int],
        state: State,
        clock: Clock,
        arrays: Arrays,
        total: Callable[[np.ndarray], float],
    ):
        """`fade`: the kernel of what a step sets free; `flow`: which of the internals is the plastic strain, and E/sigma_y;
        `common` to all rows; `count` blocks and rows; `total` sums up energies of the rows."""
        real = state.space.scalar
        self._fade, self._state, self._clock = fade, state, clock
        self._inputs = [real(flow[1]), common, blocks]
        self._count, m = count
        self._zeta = arrays.changes("zeta", wp.ones(m, dtype=real, device=arrays.device))
        self._freed = arrays.zeros("freed", m, real, kept=True)
        self.kept = self._zeta, self._freed
        """What is left of the residual of every row, and what has been set free."""
        self.ledger = (Entry("dissipated", lambda: total(host(self._freed))),)

    def advance(self) -> None:
        """Book what the step has set free (a launch)."""
        self._clock.launch(self._fade, self._count, [*self._inputs, self._state.struct], [self._zeta, self._freed])
