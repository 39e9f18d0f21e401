"""Energy of the stabilisation: of the misfit of a linear field to the displacements."""

from collections.abc import Sequence

import warp as wp

from wsph.backend.domain import Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.parts.terms import answers_struct, points_struct
from wsph.ranks.blocks import Blocks
from wsph.sph.misfit import misfit
from wsph.sph.rows import rows_struct


def held_energy_kernel(space: Space, layout: Layout, apart: bool) -> wp.Kernel:
    """The energy of every point from number `low` on. `apart`: points have places of their own."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    Rows, Points, Answers, left_over = rows_struct(space), points_struct(space), answers_struct(space), misfit(space)

    @kernel(ranged=True, pairs=True)
    def held_energy(
        first: int,
        rows: Rows,
        points: Points,
        answers: Answers,
        fields: Fields,
        low: int,
        energy_out: wp.array(dtype=wp.float64),
    ):
        row = first + wp.tid()
        i = low + row
        middle = vec()
        if wp.static(apart):
            middle = answers.mean[i]
        else:
            middle = fields.displacement[i]
        square = left_over(i, middle, points.centre[i], answers.gradient[i], rows, points.node, fields.displacement)
        energy_out[row] = wp.float64(real(0.5) * points.stabilisation * points.share[i] * square)

    return held_energy


def summed_up(kernel: wp.Kernel, inputs: Sequence[object], share: Share, domain: Domain, device: str) -> float:
    """The energy of the points of all processes, of which this one has a `share` (a launch and a copy). A sum inside of the
    kernel would have roundings that depend on where it begins."""
    energies = wp.zeros(share.high - share.low, dtype=wp.float64, device=device)
    wp.launch(kernel, len(energies), inputs=[0, *inputs, share.own.start], outputs=[energies], device=device)
    return float(Blocks.of(share).of_rows(energies.numpy(), domain).sum())
