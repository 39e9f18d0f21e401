"""The turning of a stress with its material: the spin of the axes, and the turn of a step.

With F = R U the axes of the material turn with R, and their spin is Omega = R' R^T (Green & Naghdi 1965). With A = R^T F'
the skew part of A says A - A^T = w U + U w, w = R^T Omega R: in two dimensions the rate of the angle of R, in three a
system of three equations for the axial vector of w.

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
def rotation(space: Space) -> wp.Function:
    """Warp function F (3 x 3, determinant above zero) -> R of F = R U."""
    real, mat = space.scalar, space.mat

    @wp.func
    def polar(F: mat) -> mat:
        R = F
        change = real(1.0)
        rounds = int(0)
        while change > real(1.0e-12) and rounds < POLAR_ROUNDS:
            closer = real(0.5) * (R + wp.transpose(wp.inverse(R)))
            change = wp.ddot(closer - R, closer - R)
            R = closer
            rounds += 1
        return R

    return polar


@cache
def spinning(space: Space) -> wp.Function:
    """Warp function (F, velocity gradient L) -> Omega, the spin of the axes of the material, dim x dim; the skew part of L
    where F says nothing."""
    real, vec, mat, dim = space.scalar, space.vec, space.mat, space.dim
    polar, determinant = rotation(space), determinant_and_inverse(space)[0]

    @wp.func
    def in_two(F: mat, L: mat) -> mat:
        dF = L * F
        c = F[0, 0] + F[1, 1]
        s = F[1, 0] - F[0, 1]
        rate = (c * (dF[1, 0] - dF[0, 1]) - s * (dF[0, 0] + dF[1, 1])) / (c * c + s * s)
        return mat(real(0.0), -rate, rate, real(0.0))

    @wp.func
    def in_three(F: mat, L: mat) -> mat:
        R = polar(F)
        U = wp.transpose(R) * F
        A = wp.transpose(R) * (L * F)
        skew = vec(A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1])
        w = R * (wp.inverse(wp.trace(U) * wp.identity(n=3, dtype=real) - U) * skew)
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
def half_turn(space: Space) -> wp.Function:
    """Warp function (spin times time step) -> Q - 1, Q half of Cayley's turn, 3 x 3: small where the turn is, so that no
    digits of a stress are lost to it."""
    real, mat, tensor, dim = space.scalar, space.mat, space.tensor, space.dim

    @wp.func
    def half(angle: mat) -> tensor:
        # The axial vector of Cayley's turn is tan of half the angle; of half the turn it is tan of a quarter.
        whole = wp.ddot(angle, angle) / real(8.0)
        A = tensor()
        for i in range(wp.static(dim)):
            for j in range(wp.static(dim)):
                A[i, j] = real(0.5) * angle[i, j]
        A = A / (real(1.0) + wp.sqrt(real(1.0) + whole))
        square = real(0.5) * wp.ddot(A, A)
        return (real(2.0) / (real(1.0) + square)) * (A + A * A)

    return half


@cache
def turn_change(space: Space) -> wp.Function:
    """Warp function (Q - 1, symmetric tensor) -> Q s Q^T - s."""
    tensor = space.tensor

    @wp.func
    def change(by: tensor, s: tensor) -> tensor:
        first = by * s
        return first + wp.transpose(first) + first * wp.transpose(by)

    return change
