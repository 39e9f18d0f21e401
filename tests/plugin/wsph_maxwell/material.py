"""Maxwell viscoelasticity: shear stresses relax, pressure does not."""

from dataclasses import dataclass, field

import warp as wp


@dataclass(frozen=True)
class Maxwell:
    """stress rate = lambda tr(D) I + 2 mu D - s/tau, s the deviator. Fields: density, moduli, relaxation_time tau [s]."""

    density: float = field(metadata={"unit": "kg/m3", "above": 0.0})
    bulk_modulus: float = field(metadata={"unit": "Pa", "above": 0.0})
    shear_modulus: float = field(metadata={"unit": "Pa", "above": 0.0})
    relaxation_time: float = field(metadata={"unit": "s", "above": 0.0})

    def moduli(self) -> tuple[float, float]:
        """Bulk and shear modulus [Pa]."""
        return self.bulk_modulus, self.shear_modulus

    def time_step(self) -> float:
        """An explicit step resolves the relaxation."""
        return self.relaxation_time

    def rate(self, space, Params) -> wp.Function:
        """The law (p, stress, L) -> stress rate."""
        real, tensor = space.scalar, space.tensor

        @wp.func
        def law(p: Params, stress: tensor, L: tensor) -> tensor:
            one = wp.identity(n=3, dtype=real)
            D = real(0.5) * (L + wp.transpose(L))
            volumetric = wp.trace(D)
            deviator = stress - wp.trace(stress) / real(3.0) * one
            elastic = p.bulk_modulus * volumetric * one + real(2.0) * p.shear_modulus * (
                D - volumetric / real(3.0) * one
            )
            return elastic - deviator / p.relaxation_time

        return law
