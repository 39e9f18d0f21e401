"""The elastic energy split by principal strains into what opens and what closes, and strains without axes."""

from functools import cache

import warp as wp

from wsph.backend.space import Space

SMALL = 0.01
"""A strain up to which roots of 1 + 2 E are taken by their series."""

ROOT_SERIES = (1.0, -1 / 2, 1 / 2, -5 / 8, 7 / 8, -21 / 16, 33 / 16, -429 / 128)

INVERSE_SERIES = (1.0, -3 / 2, 5 / 2, -35 / 8, 63 / 8, -231 / 16, 429 / 16, -6435 / 128)
"""sqrt(1 + 2 E) - 1 and 1 - 1/sqrt(1 + 2 E) by powers of E, to 1e-14 of it where E is below SMALL."""


@cache
def split(space: Space, Params: type) -> wp.Function:
    """Warp function (p, principal strains, strain along each axis out of the plane) -> psi+, psi-, s+, s-, and s+, s- out of
    the plane."""
    real, vec, dim = space.scalar, space.vec, space.dim
    beyond = 3 - dim

    @wp.func
    def parted(p: Params, e: vec, out: real):
        lame = p.elastic_bulk - real(2.0) / real(3.0) * p.elastic_shear
        mu = p.elastic_shear
        trace = real(beyond) * out
        for a in range(wp.static(dim)):
            trace += e[a]
        opening = wp.max(trace, real(0.0))
        closing = wp.min(trace, real(0.0))
        out_opening = wp.max(out, real(0.0))
        out_closing = wp.min(out, real(0.0))
        plus = real(beyond) * out_opening * out_opening
        minus = real(beyond) * out_closing * out_closing
        tension = vec()
        pressure = vec()
        for a in range(wp.static(dim)):
            up = wp.max(e[a], real(0.0))
            down = wp.min(e[a], real(0.0))
            plus += up * up
            minus += down * down
            tension[a] = lame * opening + real(2.0) * mu * up
            pressure[a] = lame * closing + real(2.0) * mu * down
        return (
            real(0.5) * lame * opening * opening + mu * plus,
            real(0.5) * lame * closing * closing + mu * minus,
            tension,
            pressure,
            lame * opening + real(2.0) * mu * out_opening,
            lame * closing + real(2.0) * mu * out_closing,
        )

    return parted


@cache
def shrinkage(space: Space) -> wp.Function:
    """Warp function H -> (I - U^-1, tr e, a bound of e : e, whether they are known), U = I + e = sqrt(F^T F), without axes.

    In 2D U = (C + J I)/sqrt(tr C + 2 J), of what is not turned inside out; in 3D, for strains below SMALL, the series of the
    roots, whose powers Cayley and Hamilton bring back to I, E and E^2. Differences from I are taken where they are small.
    """
    real, mat, dim = space.scalar, space.mat, space.dim
    roots, inverses = (wp.types.vector(length=len(c), dtype=real)(*c) for c in (ROOT_SERIES, INVERSE_SERIES))
    if dim == 2:

        @wp.func
        def in_two(H: mat):
            G = H + wp.transpose(H) + wp.transpose(H) * H
            change = wp.trace(H) + wp.determinant(H)  # J - 1
            if not (change > real(-0.9)):
                return mat(), real(0.0), real(0.0), False
            square = wp.trace(G) + real(2.0) * change
            s = wp.sqrt(real(4.0) + square)
            e = (G + (change - square / (s + real(2.0))) * wp.identity(n=dim, dtype=real)) / s
            trace = wp.trace(e)
            m = (e + (change - trace) * wp.identity(n=dim, dtype=real)) / (real(1.0) + change)
            return m, trace, wp.ddot(e, e), True

        return in_two

    @wp.func
    def in_space(H: mat):
        E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
        square = wp.ddot(E, E)
        if not (square < real(wp.static(SMALL * SMALL))):
            return mat(), real(0.0), real(0.0), False
        first = wp.trace(E)
        second = real(0.5) * (first * first - square)
        third = wp.determinant(E)
        a = real(0.0)
        b = real(0.0)
        c = real(0.0)
        x = real(0.0)
        y = real(0.0)
        z = real(0.0)
        for n in range(wp.static(len(ROOT_SERIES))):
            k = wp.static(len(ROOT_SERIES) - 1) - n
            # Horner: (a I + b E + c E^2) E = c I3 I + (a - c I2) E + (b + c I1) E^2
            old = a + inverses[k]
            grown = b + c * first
            b = old - c * second
            a = c * third
            c = grown
            old = x + roots[k]
            grown = y + z * first
            y = old - z * second
            x = z * third
            z = grown
        m = a * wp.identity(n=3, dtype=real) + b * E + c * (E * E)
        return m, real(3.0) * x + y * first + z * square, real(wp.static(1.0 + 3.0 * SMALL)) * square, True

    return in_space
