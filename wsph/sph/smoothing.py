"""Smoothing functions W(r, h): value and slope, per dimension.

A smoothing function is named in the scene (`run.kernel`) and given as two Warp functions of xi = r/h: the value W and the
slope over distance, W'(xi)/xi, which stays finite at r = 0. Both end at xi = 2, the support radius 2h.
"""

import math
from collections.abc import Callable
from functools import cache

import warp as wp

from wsph.backend.space import Space

SUPPORT = 2.0
"""Support radius over smoothing length, of every smoothing function here."""


@cache
def cubic_spline(space: Space) -> tuple[wp.Function, wp.Function]:
    """Monaghan & Lattanzio's B-spline: C {2/3 - xi^2 + xi^3/2, xi <= 1; (2 - xi)^3/6, xi <= 2}.

    C h^dim = 1, 15/(7 pi), 3/(2 pi) (Herreros & Mabssout 2011, eqs 24-25; He & Seaid 2016, eq 2 prints 6(2-xi)^3).
    """
    real = space.scalar
    norm = {1: 1.0, 2: 15.0 / (7.0 * math.pi), 3: 3.0 / (2.0 * math.pi)}[space.dim]
    # A sum or quotient inside real(...) would be computed in single precision: constants are made here.
    middle, sixth, minus_half = norm * 2.0 / 3.0, norm / 6.0, -0.5 * norm

    @wp.func
    def value(xi: real) -> real:
        if xi < real(1.0):
            return real(middle) + real(norm) * (real(0.5) * xi - real(1.0)) * xi * xi
        if xi < real(2.0):
            left = real(2.0) - xi
            return real(sixth) * left * left * left
        return real(0.0)

    @wp.func
    def slope(xi: real) -> real:
        if xi < real(1.0):
            return real(norm) * (real(-2.0) + real(1.5) * xi)
        if xi < real(2.0):
            left = real(2.0) - xi
            return real(minus_half) * left * left / xi
        return real(0.0)

    return value, slope


@cache
def wendland_c2(space: Space) -> tuple[wp.Function, wp.Function]:
    """Wendland's C2 function: C (1 - xi/2)^4 (1 + 2 xi) in 2D and 3D, C (1 - xi/2)^3 (1 + 3/2 xi) in 1D.

    C h^dim = 5/8, 7/(4 pi), 21/(16 pi) (Dehnen & Aly 2012, table 1, in terms of the support radius 2h).
    """
    real = space.scalar
    norm = {1: 5.0 / 8.0, 2: 7.0 / (4.0 * math.pi), 3: 21.0 / (16.0 * math.pi)}[space.dim]
    minus_three, minus_five = -3.0 * norm, -5.0 * norm
    dim = space.dim

    @wp.func
    def value(xi: real) -> real:
        left = wp.max(real(1.0) - real(0.5) * xi, real(0.0))
        if wp.static(dim == 1):
            return real(norm) * left * left * left * (real(1.0) + real(1.5) * xi)
        return real(norm) * left * left * left * left * (real(1.0) + real(2.0) * xi)

    @wp.func
    def slope(xi: real) -> real:
        left = wp.max(real(1.0) - real(0.5) * xi, real(0.0))
        if wp.static(dim == 1):
            return real(minus_three) * left * left
        return real(minus_five) * left * left * left

    return value, slope


DEFAULT = "cubic-spline"
"""The kernel of a scene that names none."""

SMOOTHING: dict[str, Callable[[Space], tuple[wp.Function, wp.Function]]] = {
    "cubic-spline": cubic_spline,
    "wendland-c2": wendland_c2,
}
