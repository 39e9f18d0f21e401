"""The residual of points that flow: what holds spurious modes is elastic, and must not hold a plastic hinge.

A point that has flowed by a plastic strain e keeps of its residual zeta = max(0.02, 1/(1 + E e/sigma_y)): the share that the
secant stiffness has of the elastic one. What a falling zeta sets free of the residual's energy is dissipated, on the ledger.
A material says by its `flows` which of its internals is e, and which of its numbers sigma_y.
"""

from collections.abc import Callable
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays, host
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space, Struct
from wsph.backend.state import Layout, fields_struct
from wsph.parts.part import Attached, Neighbourhood
from wsph.parts.terms import Points, points_struct
from wsph.protocols import Entry
from wsph.sph.misfit import misfit
from wsph.sph.rows import rows_of, rows_struct

LEAST = 0.02
"""What is left of a residual at most faded: enough to hold modes that no gradient sees."""


@cache
def faded(space: Space) -> wp.Function:
    """Warp function E e/sigma_y -> zeta."""
    real = space.scalar

    @wp.func
    def zeta(flowed: real) -> real:
        return wp.max(real(LEAST), real(1.0) / (real(1.0) + flowed))

    return zeta


@cache
def row_of(space: Space, beside: bool) -> wp.Function:
    """Warp function (points, i) -> where the fields of point i stand in those of the state: of some points of a body,
    `beside` others, in rows of their own."""
    Points = points_struct(space)

    @wp.func
    def row(points: Points, i: int) -> int:
        if wp.static(beside):
            return points.row[i]
        return i

    return row


@cache
def _advance_kernel(space: Space, layout: Layout, apart: bool, beside: bool, internal: int) -> wp.Kernel:
    """What the residual of each point has set free in a step; `apart`: points have places of their own; `beside`: they are
    some of a body's."""
    real, vec, mat, left_over, zeta = space.scalar, space.vec, space.mat, misfit(space), faded(space)
    Rows, Points, Fields = rows_struct(space), points_struct(space), fields_struct(space, layout)
    row = row_of(space, beside)

    @kernel(ranged=True)
    def fade(
        first: int,
        yields: real,
        rows: Rows,
        points: Points,
        mean: wp.array(dtype=vec),
        gradient: wp.array(dtype=mat),
        fields: Fields,
        zeta_out: wp.array(dtype=real),
        freed_out: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        k = row(points, i)
        new = zeta(yields * fields.internals[k][wp.static(internal)])
        old = zeta_out[k]
        if new < old:
            u = vec()
            if wp.static(apart):
                u = mean[i]
            else:
                u = fields.displacement[i]
            square = left_over(i, u, points.centre[i], gradient[i], rows, points.node, fields.displacement)
            freed_out[k] = freed_out[k] + real(0.5) * points.stabilisation * points.share[i] * square * (old - new)
            zeta_out[k] = new

    return fade


class Fading(Attached):
    """The residual of a body that flows. Evaluations write `share`, what is left of every point's. Beside it the device has,
    of the points of the body and nondimensional,

    _zeta   # what is left of the residual's stiffness at the end of the last step
    _freed  # energy set free so far
    """

    def __init__(
        self,
        flow: tuple[int, float],
        space: Space,
        seen: Neighbourhood,
        layout: Layout,
        fields: Struct,
        clock: Clock,
        arrays: Arrays,
        total: Callable[[np.ndarray], float] | tuple[Array, Array],
    ):
        """`flow`: which of the internals is the plastic strain, and E/sigma_y; `fields`: those of a state; `total` sums up
        energies of the points, or is, where those that are `seen` are some of a body's, its two arrays of all points, which
        stand on the ledger already."""
        self._space, self._clock, self._layout, self._fields, self._seen = space, clock, layout, fields, seen
        self._internal, self._yields = flow[0], space.scalar(flow[1])
        self._rows = rows_of(space, seen.pairs, seen.weight)
        changed: Points = points_struct(space)()
        for name in ("node", "centre", "moment", "volume", "row", "stabilisation"):
            setattr(changed, name, getattr(seen.points, name))
        changed.share = arrays.of("share", host(seen.points.share), space.scalar)
        self.response, self.share = changed, changed.share
        self._beside, self._count = isinstance(total, tuple), len(seen.volume)
        if isinstance(total, tuple):
            self._zeta, self._freed = total
            return
        self._zeta = arrays.changes("zeta", wp.ones(self._count, dtype=space.scalar, device=arrays.device))
        self._freed = arrays.zeros("freed", self._count, space.scalar, kept=True)
        self.ledger = (Entry("dissipated", lambda: total(host(self._freed))),)

    def advance(self) -> None:
        """Book what the step has set free (a launch)."""
        seen = self._seen
        kernel = _advance_kernel(self._space, self._layout, seen.back is not None, self._beside, self._internal)
        inputs = [self._yields, self._rows, seen.points, seen.mean, seen.gradient, self._fields]
        self._clock.launch(kernel, self._count, inputs, [self._zeta, self._freed])
