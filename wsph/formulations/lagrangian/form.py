"""What the kernels of a Lagrangian composition are made for, and what a point gathers from its pairs."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.pair_loops import PAIR_LOOPS, element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.parts.pair_forces import PairParts, pair_struct
from wsph.sph.smoothing import SMOOTHING


@dataclass(frozen=True)
class Form:
    """What the kernels of a composition are made for. `moving`: pairs are seen in the current configuration."""

    points: bool
    total: bool
    residual: bool
    loaded: bool
    paper: bool
    parts: PairParts
    moving: bool = False
    damage: str = ""
    """How a body breaks: the model of its phase field, or "links"."""


@cache
def seen_pair(space: Space, layout: Layout, form: Form, smoothing: str) -> wp.Function:
    """Warp function (pair, weight, node, fields, i, j, k) -> (r, w) of pair k, from i to j: from the reference configuration
    as stored, or from the current one."""
    real, vec, Fields, Pair = space.scalar, space.vec, fields_struct(space, layout), pair_struct(space)
    slope, at = SMOOTHING[smoothing](space)[1], element(real, vec)
    if form.moving:

        @wp.func
        def now(
            pair: Pair, weight: wp.array(dtype=real), node: wp.array(dtype=vec), fields: Fields, i: int, j: int, k: int
        ):
            r = (at(node, j) - at(node, i)) + (at(fields.displacement, j) - at(fields.displacement, i))
            return r, -slope(wp.length(r) / pair.h)

        return now

    @wp.func
    def at_start(
        pair: Pair, weight: wp.array(dtype=real), node: wp.array(dtype=vec), fields: Fields, i: int, j: int, k: int
    ):
        return at(node, j) - at(node, i), at(weight, k)

    return at_start


@cache
def gathered(space: Space, layout: Layout, form: Form, smoothing: str, averaged: bool) -> wp.Function:
    """Warp function (pair, offsets, indices, weight, node, centre, others, field, i) -> the sum of w (f_j - f_i) (x) r over
    the pairs of i, and where `averaged` the weighted mean of f."""
    real, vec, mat, Fields, Pair = space.scalar, space.vec, space.mat, fields_struct(space, layout), pair_struct(space)
    points, seen, at = form.points, seen_pair(space, layout, form, smoothing), element(wp.int32, real, vec)

    @wp.func
    def gathered(pair: Pair, offsets: wp.array(dtype=wp.int32), indices: wp.array(dtype=wp.int32), weight: wp.array(dtype=real),
                 node: wp.array(dtype=vec), centre: wp.array(dtype=vec), others: Fields, field: wp.array(dtype=vec), i: int):  # fmt: skip
        near = i
        if wp.static(points):
            near = indices[offsets[i]]
        f0 = field[near]
        gradient = mat()
        mean = vec()
        c = centre[i]
        k = offsets[i]
        end = offsets[i + 1]
        while k < end:
            j = at(indices, k)
            if wp.static(points):
                r = at(node, j) - c
                w = at(weight, k)
            else:
                r, w = seen(pair, weight, node, others, i, j, k)
            df = w * (at(field, j) - f0)
            gradient = gradient + wp.outer(df, r)
            if wp.static(averaged):
                mean = mean + df
            k += 1
        return gradient, f0 + mean

    return gathered


def loop_options(form: Form) -> dict[str, str] | None:
    """How the pair loops of a form are compiled: rows of the current configuration have pairs without weight in them, and
    sums in vectors would depend on how many."""
    return None if form.moving else PAIR_LOOPS
