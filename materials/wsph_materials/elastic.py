"""Linear isotropic elasticity as a rate law."""

from dataclasses import dataclass, field

import warp as wp


def lame(youngs_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """Lame's parameters lambda and mu [Pa]."""
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    return 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio), shear


@dataclass(frozen=True)
class Isotropic:
    """The fields that all laws here share: density [kg/m3], youngs_modulus [Pa], poisson_ratio in (-1, 0.5)."""

    density: float = field(metadata={"unit": "kg/m3", "above": 0.0})
    youngs_modulus: float = field(metadata={"unit": "Pa", "above": 0.0})
    poisson_ratio: float = field(metadata={"unit": "", "above": -1.0, "below": 0.5})

    derived = {"lame_first": "Pa", "lame_second": "Pa"}

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


@dataclass(frozen=True)
class Elastic(Isotropic):
    """stress rate = lambda tr(D) I + 2 mu D with D the symmetric part of L. Where the body moves its stress turns with
    it; in small strain nothing turns: for small rotations.

    One-set forms take its total law instead, St Venant-Kirchhoff: S = lambda tr(E) I + 2 mu E with E the Green-
    Lagrange strain, objective for any rotation, for moderate strains (it softens in compression).
    Fields as in `Isotropic`.
    """

    depends_on_stress = False
    linear = True

    def rate(self, space, Params) -> wp.Function:
        """The law (p, stress, L) -> stress rate."""
        real, tensor = space.scalar, space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            return p.lame_first * wp.trace(L) * wp.identity(n=3, dtype=real) + p.lame_second * (L + wp.transpose(L))

        return law

    def stress(self, space, Params) -> wp.Function:
        """The total law (p, H) -> Cauchy stress: F S F^T/J."""
        real, tensor = space.scalar, space.tensor
        nominal = self.piola(space, Params)

        @wp.func
        def law(p: Params, H: tensor) -> tensor:
            F = wp.identity(n=3, dtype=real) + H
            return nominal(p, H) * wp.transpose(F) / wp.determinant(F)

        return law

    def piola(self, space, Params) -> wp.Function:
        """The same as first Piola stress, F S."""
        real, tensor = space.scalar, space.tensor

        @wp.func
        def nominal(p: Params, H: tensor) -> tensor:
            one = wp.identity(n=3, dtype=real)
            # From H, not from F: a strain of 1e-5 in single precision keeps its digits.
            E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
            S = p.lame_first * wp.trace(E) * one + real(2.0) * p.lame_second * E
            return (one + H) * S

        return nominal

    def energy(self, space, Params) -> wp.Function:
        """The energy (p, H) -> lambda/2 tr(E)^2 + mu E:E per reference volume."""
        real, tensor = space.scalar, space.tensor

        @wp.func
        def stored(p: Params, H: tensor) -> real:
            E = real(0.5) * (H + wp.transpose(H) + wp.transpose(H) * H)
            return real(0.5) * p.lame_first * wp.trace(E) * wp.trace(E) + p.lame_second * wp.ddot(E, E)

        return stored
