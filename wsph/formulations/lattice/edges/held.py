"""Energy of the residual at nodes that see each other along edges."""

from functools import cache

import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.formulations.lattice.edges.grid import grid_struct
from wsph.formulations.lattice.edges.lanes import edge_misfit
from wsph.formulations.lattice.lanes import block_of


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
def held_of_nodes(space: Space) -> wp.Function:
    """`held_of` of `wsph.formulations.lattice.held.fade_kernel`, of nodes."""
    Grid, square = grid_struct(space), edge_misfit(space)

    @wp.func
    def held(
        grid: Grid, blocks: wp.array(dtype=wp.int32), block: int, row: int, place: int, u: wp.array(dtype=space.vec)
    ) -> space.scalar:
        return grid.hold * grid.volume[place] * square(blocks, block, row, u, grid.inverse)

    return held
