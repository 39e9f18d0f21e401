"""The turning of a stress with its material: the spin of the axes, and the turn of a step.

With F = R U = V R the axes of the material turn with R, and their spin is Omega = R' R^T (Green & Naghdi 1965). With
L = D + W it differs from W by the skew X with X V + V X = D V - V D, in three dimensions three equations for the axial
vector of X (Dienes 1979; Flanagan & Taylor 1987); in two it is the rate of the angle of R.

A stress turns over a step by Cayley's turn of the spin in its middle, (1 - h/2 Omega)^-1 (1 + h/2 Omega), as Hughes & Winget
(1980) have it: where F turns rigidly within a step, by any angle, so does the stress.
"""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import determinant_and_inverse

POLAR_ROUNDS = 10
"""Most rounds of R <- (R + R^-T)/2, which squares the error: enough from stretches between 1/100 and 100."""


@cache
def _stretch(space: Space) -> wp.Function:
    """Warp function F (3 x 3, determinant above zero) -> V of F = V R. An error of it is one of Omega in proportion to D
    alone: a rigid turn has none, so that a millionth is enough."""
    real, mat = space.scalar, space.mat

    @wp.func
    def stretch(F: mat) -> mat:
        R = F
        change = real(1.0)
        rounds = int(0)
        while change > real(1.0e-6) and rounds < POLAR_ROUNDS:
            closer = real(0.5) * (R + wp.transpose(wp.inverse(R)))
            change = wp.ddot(closer - R, closer - R)
            R = closer
            rounds += 1
        return F * wp.transpose(R)

    return stretch


@cache
def spinning(space: Space) -> wp.Function:
    """Warp function (F, velocity gradient L) -> Omega, the spin of the axes of the material, dim x dim; the skew part of L
    where F says nothing."""
    real, vec, mat, dim = space.scalar, space.vec, space.mat, space.dim
    stretch, determinant = _stretch(space), determinant_and_inverse(space)[0]

    @wp.func
    def in_two(F: mat, L: mat) -> mat:
        dF = L * F
        c = F[0, 0] + F[1, 1]
        s = F[1, 0] - F[0, 1]
        rate = (c * (dF[1, 0] - dF[0, 1]) - s * (dF[0, 0] + dF[1, 1])) / (c * c + s * s)
        return mat(real(0.0), -rate, rate, real(0.0))

    @wp.func
    def in_three(F: mat, L: mat) -> mat:
        V = stretch(F)
        A = (L + wp.transpose(L)) * V
        skew = real(0.5) * vec(A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1])
        w = wp.inverse(wp.trace(V) * wp.identity(n=3, dtype=real) - V) * skew
        w += real(0.5) * vec(L[2, 1] - L[1, 2], L[0, 2] - L[2, 0], L[1, 0] - L[0, 1])
        return mat(real(0.0), -w[2], w[1], w[2], real(0.0), -w[0], -w[1], w[0], real(0.0))

    of_axes = in_two if dim == 2 else in_three

    @wp.func
    def spin(F: mat, L: mat) -> mat:
        if determinant(F) <= real(0.0):
            return real(0.5) * (L - wp.transpose(L))
        return of_axes(F, L)

    return spin


@cache
def turned_gradient(space: Space, turned: bool) -> wp.Function:
    """Warp function (F, L) -> the rate of the strain and, as skew part, the spin that the stress turns with; L itself where
    the law is not `turned`."""
    real, mat = space.scalar, space.mat
    if not turned:

        @wp.func
        def as_it_is(F: mat, L: mat) -> mat:
            return L

        return as_it_is
    spin = spinning(space)

    @wp.func
    def of_axes(F: mat, L: mat) -> mat:
        return real(0.5) * (L + wp.transpose(L)) + spin(F, L)

    return of_axes


@cache
def turn_change(space: Space) -> wp.Function:
    """Warp function (half the spin times the time step, dim x dim; symmetric tensor s) -> Q s Q^T - s, Q Cayley's turn:
    small where the turn is, so that no digits of a stress are lost to it."""
    real, mat, tensor, dim = space.scalar, space.mat, space.tensor, space.dim

    @wp.func
    def in_two(half: mat, s: tensor) -> tensor:
        # half[1, 0] is the tangent of half the angle; twice the angle is what Mohr's circle turns by.
        t = half[1, 0]
        scale = real(1.0) / (real(1.0) + t * t)
        sine = real(2.0) * t * scale
        versine = t * sine
        twice_sine = real(2.0) * sine * (real(1.0) - versine)
        twice_versine = real(2.0) * sine * sine
        d = real(0.5) * (s[0, 0] - s[1, 1])
        normal = -twice_versine * d - twice_sine * s[0, 1]
        shear = twice_sine * d - twice_versine * s[0, 1]
        change = tensor()
        change[0, 0] = normal
        change[1, 1] = -normal
        change[0, 1] = shear
        change[1, 0] = shear
        return change

    @wp.func
    def in_three(half: mat, s: tensor) -> tensor:
        by = (real(2.0) / (real(1.0) + real(0.5) * wp.ddot(half, half))) * (half + half * half)
        first = by * s
        return first + wp.transpose(first) + first * wp.transpose(by)

    return in_two if dim == 2 else in_three
