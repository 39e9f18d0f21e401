"""Energy of the residual at nodes that see each other along edges: its sum, and what a falling stiffness sets free of it."""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import edge_misfit
from wsph.formulations.lattice.lanes import block_of
from wsph.parts.fading import faded


@cache
def held_kernel(space: Space, layout: Layout, fades: bool) -> wp.Kernel:
    """Energy of the stabilisation, a sum for every block."""
    real, Fields, Grid, square = space.scalar, fields_struct(space, layout), grid_struct(space), edge_misfit(space)
    block = block_of(space.dim, 2)

    @kernel()
    def held(grid: Grid, blocks: wp.array(dtype=wp.int32), fields: Fields, energy_out: wp.array(dtype=wp.float64)):
        b, i, _lane, _rows, own = block(blocks, wp.tid())
        total = wp.float64(0.0)
        for e in range(own):
            stiffness = real(0.5) * grid.hold * grid.volume[i + e]
            if wp.static(fades):
                stiffness = stiffness * grid.left[i + e]
            total += wp.float64(stiffness * square(blocks, b, e, fields.displacement, grid.inverse))
        energy_out[b] = total

    return held


@cache
def fade_kernel(space: Space, layout: Layout, internal: int) -> wp.Kernel:
    """What the residual of each node has set free in a step."""
    real, zeta, Fields, square = space.scalar, faded(space), fields_struct(space, layout), edge_misfit(space)
    block, Grid = block_of(space.dim, 2), grid_struct(space)

    @kernel(ranged=True)
    def fade(
        first: int,
        yields: real,
        grid: Grid,
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
                held = grid.hold * grid.volume[i] * square(blocks, b, e, fields.displacement, grid.inverse)
                freed_out[i] = freed_out[i] + real(0.5) * held * (old - new)
                zeta_out[i] = new

    return fade
