"""The form of a one-set composition, which decides the source of its kernels; and the sums over the pairs of a point."""

from dataclasses import dataclass
from functools import cache

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Layout, fields_struct
from wsph.parts.terms import (
    PairTerm,
    RateTerm,
    Response,
    StressTerm,
    coefficients_struct,
    points_struct,
)
from wsph.sph.rows import rows_struct
from wsph.sph.smoothing import SMOOTHING

AVERAGED = 1.0 / 12.0
"""Strength a of the average over the edges (`wsph.formulations.lagrangian.edges`)."""


@dataclass(frozen=True)
class Form:
    """The choices that decide the source of a composition's kernels: compositions with equal forms share kernels."""

    points: bool
    """Whether stresses live at places of their own, apart from the particles."""
    total: bool
    """Whether the law gives the stress of a deformation."""
    stabilised: bool
    """Whether there is a stiffness against the misfit of a linear field to the displacements."""
    loaded: bool
    paper: bool
    """Whether both sides of a pair take the correction of the one (He & Seaid 2016, eq 13 with eq 3)."""
    smoothing: str
    pair_terms: tuple[PairTerm, ...] = ()
    stress_term: StressTerm | None = None
    rate_term: RateTerm | None = None
    response: Response | None = None
    breaks: bool = False
    """Whether the body can break: across a crack the deformation says nothing."""
    moving: bool = False
    """Whether pairs are seen in the current configuration."""
    followed: bool = False
    """Whether there are loads that follow the state."""
    averaged: bool = False
    """Whether gradients and stresses are averaged once over the edges that pairs are."""
    blocks: bool = False
    """Whether volumes are averaged over blocks of particles."""
    vectors: bool = False
    """Whether gradients are those of the cells around a particle, a vector a pair, and no weights' times r."""
    fades: int = -1
    """Which of the internals is the plastic strain that the stabilisation fades with (`wsph.parts.fading`), -1: none."""
    remembers: bool = False
    """Whether particles remember the deviation of their neighbours from a linear field, where pairs follow the motion."""
    imaged: bool = False
    """Whether particles see mirror images behind the walls of the body."""
    resisted: bool = False
    """Whether there are loads that depend on velocities."""
    beside: bool = False
    """Whether the points are some of a body's, whose fields stand in the rows of the state that they name."""

    @property
    def staged(self) -> bool:
        """Whether the answer of the points takes gradients that were found before, and forces take what is found after."""
        return self.averaged or self.blocks

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of the coefficients that its terms take."""
        terms = (*self.pair_terms, self.stress_term, self.rate_term)
        names = dict.fromkeys(name for term in terms if term is not None for name in term.coefficients)
        return (*names, *(("yields",) if self.fades >= 0 else ()))

    @property
    def drags(self) -> bool:
        """Whether there are forces that depend on velocities."""
        return self.resisted or self.damps

    @property
    def damps(self) -> bool:
        """Whether such forces act inside of the body."""
        return self.rate_term is not None or any(term.sum == "drag" for term in self.pair_terms)

    @property
    def one_sided(self) -> bool:
        """Whether those act on approach alone."""
        rate = self.rate_term is not None and self.rate_term.one_sided
        return rate or any(term.one_sided for term in self.pair_terms)

    @property
    def holds(self) -> bool:
        """Whether there are forces that hold spurious modes and do work of their own."""
        return any(term.sum == "hold" for term in self.pair_terms)

    @property
    def shares(self) -> bool:
        """Whether pairs take the sum of their two shares."""
        return self.stabilised or any(term.shares for term in self.pair_terms)


def coefficients_of(space: Space, form: Form) -> type:
    """The struct of coefficients that kernels of a form take."""
    return coefficients_struct(space, form.numbers, form.imaged)


@cache
def seen_pair(space: Space, layout: Layout, form: Form) -> wp.Function:
    """Warp function (c, rows, points, fields, i, j, k) -> (r, w) of pair k, from i to j: from the reference configuration as
    stored, or from the current one."""
    real, vec, Fields = space.scalar, space.vec, fields_struct(space, layout)
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    slope, at = SMOOTHING[form.smoothing](space)[1], element(real, vec)
    if form.moving:

        @wp.func
        def now(c: Coefficients, rows: Rows, points: Points, fields: Fields, i: int, j: int, k: int):
            r = (at(points.node, j) - at(points.node, i)) + (at(fields.displacement, j) - at(fields.displacement, i))
            return r, -slope(wp.length(r) / c.h)

        return now

    @wp.func
    def at_start(c: Coefficients, rows: Rows, points: Points, fields: Fields, i: int, j: int, k: int):
        return at(points.node, j) - at(points.node, i), at(rows.weight, k)

    return at_start


@cache
def smoothed(space: Space, averaged: bool) -> wp.Function:
    """Warp function (rows, points, field, i) -> the average A_i + a/V_i sum_j w r^2 (A_j - A_i) of a field of matrices, or
    where they are not `averaged` A_i."""
    real, vec, mat, Rows, Points = space.scalar, space.vec, space.mat, rows_struct(space), points_struct(space)
    at = element(wp.int32, real, vec, mat)

    if not averaged:

        @wp.func
        def own(rows: Rows, points: Points, field: wp.array(dtype=mat), i: int) -> mat:
            return field[i]

        return own

    @wp.func
    def average(rows: Rows, points: Points, field: wp.array(dtype=mat), i: int) -> mat:
        own = field[i]
        place = points.node[i]
        total = mat()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            r = at(points.node, j) - place
            total = total + (at(rows.weight, k) * wp.dot(r, r)) * (at(field, j) - own)
            k += 1
        return own + (real(wp.static(AVERAGED)) / points.volume[i]) * total

    return average


@cache
def gathered(space: Space, layout: Layout, form: Form, averaged: bool) -> wp.Function:
    """Warp function (c, rows, points, others, field, i) -> the sum of w (f_j - f_i) (x) r over the pairs of i, and where
    `averaged` the weighted mean of f."""
    real, vec, mat, Fields = space.scalar, space.vec, space.mat, fields_struct(space, layout)
    Coefficients, Rows, Points = coefficients_of(space, form), rows_struct(space), points_struct(space)
    vectors = form.vectors
    apart, seen, at = form.points, seen_pair(space, layout, form), element(wp.int32, real, vec)

    @wp.func
    def sums(c: Coefficients, rows: Rows, points: Points, others: Fields, field: wp.array(dtype=vec), i: int):
        near = i
        if wp.static(apart):
            near = rows.indices[rows.offsets[i]]
        f0 = field[near]
        gradient = mat()
        mean = vec()
        centre = points.centre[i]
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            if wp.static(apart):
                r = at(points.node, j) - centre
                w = at(rows.weight, k)
            else:
                r, w = seen(c, rows, points, others, i, j, k)
            df = w * (at(field, j) - f0)
            if wp.static(vectors):
                gradient = gradient + wp.outer(at(field, j) - f0, at(points.slope, k))
            else:
                gradient = gradient + wp.outer(df, r)
            if wp.static(averaged):
                mean = mean + df
            k += 1
        return gradient, f0 + mean

    return sums


@cache
def misfit_pull(space: Space) -> wp.Function:
    """Warp function (rows, points, u, middle, H, share, i) -> c sum_j w e (x) r over the pairs of i, e = u_j - middle - H r,
    c the stabilisation times `share`: what the misfit pulls at H by, zero where H is the gradient that makes the misfit
    least."""
    real, vec, mat = space.scalar, space.vec, space.mat
    Rows, Points, at = rows_struct(space), points_struct(space), element(wp.int32, real, vec)

    @wp.func
    def pull(rows: Rows, points: Points, u: wp.array(dtype=vec), middle: vec, H: mat, share: real, i: int) -> mat:
        place = points.centre[i]
        total = mat()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            r = at(points.node, j) - place
            total = total + wp.outer(at(rows.weight, k) * (at(u, j) - middle - H * r), r)
            k += 1
        return (points.stabilisation * share) * total

    return pull
