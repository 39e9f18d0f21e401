"""Linear isotropic elasticity as a rate law."""

from dataclasses import dataclass, field

import warp as wp


def lame(youngs_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """Lame's parameters lambda and mu [Pa]."""
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    return 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio), shear


@dataclass(frozen=True)
class Elastic:
    """stress rate = lambda tr(D) I + 2 mu D with D the symmetric part of L, without spin: for small rotations.

    Fields: density [kg/m3], youngs_modulus [Pa], poisson_ratio in (-1, .5).
    """

    density: float = field(metadata={"unit": "kg/m3", "above": 0.0})
    youngs_modulus: float = field(metadata={"unit": "Pa", "above": 0.0})
    poisson_ratio: float = field(metadata={"unit": "", "above": -1.0, "below": 0.5})

    derived = {"lame_first": "Pa", "lame_second": "Pa"}
    depends_on_stress = False

    @property
    def lame_first(self) -> float:
        """lambda [Pa]."""
        return lame(self.youngs_modulus, self.poisson_ratio)[0]

    @property
    def lame_second(self) -> float:
        """mu [Pa]."""
        return lame(self.youngs_modulus, self.poisson_ratio)[1]

    def moduli(self) -> tuple[float, float]:
        """Bulk and shear modulus [Pa]."""
        return self.lame_first + 2.0 * self.lame_second / 3.0, self.lame_second

    def rate(self, space, Params) -> wp.Function:
        """The law (p, stress, L) -> stress rate."""
        real, tensor = space.scalar, space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.lame_first * wp.trace(L) * wp.identity(n=3, dtype=real) + p.lame_second * (L + wp.transpose(L))

        return law
