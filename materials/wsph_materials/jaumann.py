"""Linear isotropic elasticity with the Jaumann rate: objective, for moderate strains and any rotation."""

from dataclasses import dataclass

import warp as wp

from wsph_materials.elastic import Isotropic


@dataclass(frozen=True)
class Jaumann(Isotropic):
    """stress rate = lambda tr(D) I + 2 mu D + W stress - stress W, with D + W = L (Serroukh & Mabssout 2022, eqs 2-6).

    The spin's sign is that of eq 2; their eqs 21 and 22 print the other one, with which a block turned by 45 degrees under
    uniaxial stress gets its shear stress with the wrong sign. In simple shear by g the stress is mu sin g: it swings from a
    shear of about 1.5 on. Fields as in `Isotropic`.
    """

    depends_on_stress = True
    relaxes = False
    turns_itself = True

    def rate(self, space, Params) -> wp.Function:
        """The law (p, stress, L) -> stress rate."""
        return jaumann_rate(space, Params)


def jaumann_rate(space, Params) -> wp.Function:
    """Warp function (p, stress, L) -> the Jaumann rate of linear elasticity turned to the fixed axes."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def law(p: Params, stress: tensor, L: tensor) -> tensor:
        elastic = p.lame_first * wp.trace(L) * wp.identity(n=3, dtype=real) + p.lame_second * (L + wp.transpose(L))
        W = real(0.5) * (L - wp.transpose(L))
        return elastic + W * stress - stress * W

    return law
