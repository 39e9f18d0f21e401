"""Artificial stress."""

from functools import cache

import warp as wp

from wsph.backend.space import Space
from wsph.backend.tensors import principal
from wsph.quantities import Model, in_unit


class ArtificialStress(Model):
    """Artificial stress (He & Seaid 2016, eqs 19-23): tension is opposed by `epsilon` of it where particles are near."""

    epsilon: in_unit("", ge=0, le=1) = 0.3
    exponent: in_unit("", ge=0) = 4.0


@cache
def opposing_stress(space: Space) -> wp.Function:
    """Warp function (epsilon, in-plane stress) -> -epsilon times its tensile part, by principal stresses."""
    real, mat, dim, axes_of = space.scalar, space.mat, space.dim, principal(space)

    @wp.func
    def opposing(epsilon: real, stress: mat) -> mat:
        axes, values = axes_of(stress)
        result = mat()
        for k in range(wp.static(dim)):
            tension = wp.max(values[k], real(0.0))
            for a in range(wp.static(dim)):
                for b in range(wp.static(dim)):
                    result[a, b] = result[a, b] - epsilon * tension * axes[a, k] * axes[b, k]
        return result

    return opposing
