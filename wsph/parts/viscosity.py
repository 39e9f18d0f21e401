"""Artificial viscosity (He & Seaid 2016, eq 17): h v.x/(x^2 + 0.01 h^2), linear and quadratic in the closing speed, on
approaching pairs, or linear on all.

Between particles that are their own points it acts along the current line of two particles, with weights that stand in place
of a gradient: angular momentum is kept to rounding. The paper's acts along each particle's own corrected gradient and keeps
no momentum at a boundary (`correction`): it is there to compare with. Stress points, which have no pairs among nodes,
have it as a stress, the mean over all directions of the pairs' forces: rho alpha c h (tr D I + 2 D)/(2 (dim + 2)) on all
motion, or against compression rho/2 (alpha c h tr D - beta (h tr D)^2) I, the bulk viscosity of von Neumann and
Richtmyer. What it takes is dissipated.
"""

from functools import cache
from typing import Annotated, ClassVar, Literal

import warp as wp

from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, fields_struct
from wsph.declarations import example
from wsph.errors import Refused
from wsph.parts.part import Host, Part
from wsph.parts.terms import PairTerm, RateTerm, answers_struct, points_struct
from wsph.quantities import Unit

NUMBERS = ("alpha", "beta")


class Viscosity(Part):
    """Artificial viscosity: `alpha` linear, `beta` quadratic in the closing speed, on approaching pairs; kind "pair"
    damps all pairs, linearly. `correction`, that of the run where not said: "symmetric" keeps momentum and angular
    momentum; "paper" acts along each particle's own corrected gradient, as it does there, and keeps neither at a
    boundary."""

    model_config = example({"alpha": 0.5, "beta": 0.5})
    key: ClassVar[str] = "viscosity"
    formal: ClassVar[int] = 1
    alpha: Annotated[float, Unit("", ge=0)]
    beta: Annotated[float, Unit("", ge=0)] = 0.0
    kind: Literal["approach", "pair"] = "approach"
    correction: Literal["symmetric", "paper"] | None = None

    @property
    def every_direction(self) -> bool:
        # Along edges alone shear of a lattice's axes would not be damped; what approaches does so along some edge.
        return self.kind == "pair" or self.correction == "paper"

    def _own_gradient(self, host: Host) -> bool:
        return (self.correction or host.correction) == "paper"

    def refuse(self, host: Host) -> None:
        if self._own_gradient(host) and not host.traits.pairwise and host.correction != "paper":
            raise Refused(
                f'body {host.name!r}: viscosity.correction = "paper" is of pairs of particles; stress points have viscosity as a'
                " stress: leave it out"
            )

    def fields(self, host: Host) -> tuple[Field, ...]:
        return (Field("drag", host.space.dim, "m/s", leads=True, hidden=True),)

    def coefficients(self, host: Host) -> dict[str, float]:
        return {"alpha": self.alpha, "beta": self.beta}

    def pair_term(self, host: Host) -> PairTerm | None:
        own, approach = self._own_gradient(host), self.kind == "approach"
        return PairTerm("drag", _drag(approach, own), NUMBERS, shares=not own, one_sided=approach)

    def rate_term(self, host: Host) -> RateTerm | None:
        return RateTerm(_stress(self.kind == "approach"), NUMBERS, one_sided=self.kind == "approach")


@cache
def _pressure(space: Space, approach: bool, Coefficients: type) -> wp.Function:
    """Warp function (c, density, dv.x, x^2) -> the viscous pressure of two particles at x, dv their relative velocity."""
    real = space.scalar

    @wp.func
    def pressure(c: Coefficients, density: real, closing: real, square: real) -> real:
        phi = c.h * closing / (square + real(0.01) * c.h * c.h)
        pressure = c.alpha * c.speed * phi
        if wp.static(approach):
            pressure -= c.beta * phi * phi
        return density * pressure

    return pressure


@cache
def _closing(space: Space, layout: Layout, approach: bool) -> wp.Function:
    """Warp function (fields, others, i, j, x) -> dv.x, or what of it is approach."""
    real, vec, Fields, at = space.scalar, space.vec, fields_struct(space, layout), element(space.vec)

    @wp.func
    def closing(fields: Fields, others: Fields, i: int, j: int, apart: vec) -> real:
        speed = wp.dot(at(others.velocity, j) - at(fields.velocity, i), apart)
        if wp.static(approach):
            speed = wp.min(speed, real(0.0))
        return speed

    return closing


@cache
def _drag(approach: bool, own: bool):
    """The factory of its pair term: along the current line of two particles or, the paper's, each one's `own` gradient."""

    def make(space: Space, layout: Layout, smoothing: str, Coefficients: type) -> wp.Function:
        real, vec, dim, Fields = space.scalar, space.vec, space.dim, fields_struct(space, layout)
        Points, Answers = points_struct(space), answers_struct(space)
        pressure_of, closing_of = _pressure(space, approach, Coefficients), _closing(space, layout, approach)

        @wp.func
        def drag(
            c: Coefficients,
            density: real,
            points: Points,
            answers: Answers,
            fields: Fields,
            others: Fields,
            i: int,
            j: int,
            wr: vec,
            r: vec,
            apart: vec,
            square: real,
            both: real,
        ) -> vec:
            pressure = pressure_of(c, density, closing_of(fields, others, i, j, apart), square)
            if wp.static(own):
                return (pressure * points.volume[i]) * (points.moment[i] * wr)
            return (real(wp.static(0.5 * dim)) * pressure * both) * apart

        return drag

    return make


@cache
def _stress(approach: bool):
    """The factory of its rate term."""

    def make(space: Space, Coefficients: type) -> wp.Function:
        real, mat, dim = space.scalar, space.mat, space.dim

        @wp.func
        def viscous(c: Coefficients, h: real, density: real, L: mat) -> mat:
            one = wp.identity(n=dim, dtype=real)
            trace = wp.trace(L)
            if wp.static(approach):
                phi = h * wp.min(trace, real(0.0))
                return real(0.5) * density * (c.alpha * c.speed * phi - c.beta * phi * phi) * one
            scale = real(wp.static(0.5 / (dim + 2.0))) * density * c.alpha * c.speed * h
            return scale * (trace * one + L + wp.transpose(L))

        return viscous

    return make
