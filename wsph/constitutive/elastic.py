"""Isotropic linear elasticity by its moduli: strain of a stress."""

from functools import cache

import warp as wp

from wsph.backend.space import Space


@cache
def elastic_strain(space: Space, Params: type) -> wp.Function:
    """Warp function (p, stress 3x3) -> the elastic strain of it, 3x3."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def strain(p: Params, stress: tensor) -> tensor:
        mean = wp.trace(stress) / real(3.0)
        one = wp.identity(n=3, dtype=real)
        return (stress - mean * one) / (real(2.0) * p.elastic_shear) + (mean / (real(3.0) * p.elastic_bulk)) * one

    return strain
