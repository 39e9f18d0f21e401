"""Artificial viscosity."""

from functools import cache
from typing import Literal

import warp as wp

from wsph.backend.space import Space
from wsph.parts.pair_forces import pair_struct
from wsph.quantities import Model, in_unit


class Viscosity(Model):
    """Artificial viscosity between particles (He & Seaid 2016, eq 17): `alpha` linear, `beta` quadratic in the closing
    speed, on approaching pairs; kind "pair" damps all pairs, linearly. `correction`, that of the run where not said:
    "symmetric" keeps momentum and angular momentum; "paper" acts along each particle's own corrected gradient, as it does
    there, and keeps neither at a boundary."""

    alpha: in_unit("", ge=0)
    beta: in_unit("", ge=0) = 0.0
    kind: Literal["approach", "pair"] = "approach"
    correction: Literal["symmetric", "paper"] | None = None


@cache
def viscous_push(space: Space, kind: str) -> wp.Function:
    """Warp function (pair, density, dv.x, x^2) -> the viscous pressure of two particles at x, dv their relative velocity."""
    real, Pair, approach = space.scalar, pair_struct(space), kind == "approach"

    @wp.func
    def push(pair: Pair, density: real, closing: real, square: real) -> real:
        phi = pair.h * closing / (square + real(0.01) * pair.h * pair.h)
        pressure = pair.alpha * pair.speed * phi
        if wp.static(approach):
            pressure -= pair.beta * phi * phi
        return density * pressure

    return push


@cache
def viscous_stress(space: Space, kind: str) -> wp.Function:
    """Warp function (pair, density, velocity gradient) -> the viscous stress of a point."""
    real, mat, dim, Pair, approach = space.scalar, space.mat, space.dim, pair_struct(space), kind == "approach"

    @wp.func
    def viscous(pair: Pair, density: real, L: mat) -> mat:
        one = wp.identity(n=dim, dtype=real)
        trace = wp.trace(L)
        if wp.static(approach):
            phi = pair.h * wp.min(trace, real(0.0))
            return real(0.5) * density * (pair.alpha * pair.speed * phi - pair.beta * phi * phi) * one
        scale = real(wp.static(0.5 / (dim + 2.0))) * density * pair.alpha * pair.speed * pair.h
        return scale * (trace * one + L + wp.transpose(L))

    return viscous
