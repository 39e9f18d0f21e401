"""Perzyna's viscoplasticity with a von Mises yield surface and linear hardening or softening."""

from dataclasses import dataclass, field

import warp as wp

from wsph_materials.elastic import Isotropic


@dataclass(frozen=True)
class Perzyna(Isotropic):
    """stress rate = C : (D - d), viscoplastic rate d = gamma <phi> (3/2) s/q, q = sqrt(3/2 s:s).

    Herreros & Mabssout 2011, eqs 2-7. phi = ((q - F0)/F0)^N above the yield stress
    F0 = max(yield_stress + hardening_modulus * plastic_strain, floor), zero below; N = 0 gives phi = 1. In uniaxial stress
    d = gamma phi sign(sigma). The yield is strict: q must exceed F0 by more than a rounding, because the published bar's
    wave stands exactly at yield until it is reflected. The stress turns with the axes of the material where the body moves;
    in small strain nothing turns.

    Fields: density [kg/m3], youngs_modulus [Pa], poisson_ratio, yield_stress [Pa], hardening_modulus [Pa, negative
    softens], fluidity gamma [1/s], exponent N, floor (fraction of yield_stress below which F0 does not soften, 0.1; 0.001 to
    0.01 blew up). Internal: plastic_strain, the equivalent viscoplastic strain.
    """

    yield_stress: float = field(metadata={"unit": "Pa", "above": 0.0})
    hardening_modulus: float = field(metadata={"unit": "Pa"})
    fluidity: float = field(metadata={"unit": "1/s", "min": 0.0})
    exponent: float = field(metadata={"unit": "", "min": 0.0, "max": 20.0})
    floor: float = field(default=0.1, metadata={"unit": "", "above": 0.0, "max": 1.0})

    derived = {**Isotropic.derived, "least_yield": "Pa"}
    internals = {"plastic_strain": 0.0}
    flows = ("plastic_strain", "yield_stress")
    depends_on_stress = True

    @property
    def least_yield(self) -> float:
        """The yield stress below which softening does not go [Pa]."""
        return self.floor * self.yield_stress

    def time_step(self) -> float:
        """Largest time step [s] for which the relaxation stays stable: 2 F0 / (3 G gamma N) at the softest yield stress.

        The slope of phi at twice the yield stress; N = 0 relaxes at a constant rate and has no such limit.
        """
        softest = self.yield_stress if self.hardening_modulus >= 0.0 else self.least_yield
        stiffness = 3.0 * self.lame_second * self.fluidity * self.exponent
        return 2.0 * softest / stiffness if stiffness > 0.0 else float("inf")

    def rate(self, space, Params) -> wp.Function:
        """The law (p, stress, L, q) -> stress rate, plastic strain rate."""
        real, tensor, internal = space.scalar, space.tensor, space.vector(1)
        # Rounding of a stress at yield, accumulated over a run.
        strict = 1.0e-9 if space.precision == "f64" else 1.0e-4

        @wp.func
        def law(p: Params, stress: tensor, L: tensor, q: internal):
            one = wp.identity(n=3, dtype=real)
            deviator = stress - wp.trace(stress) / real(3.0) * one
            effective = wp.sqrt(real(1.5) * wp.ddot(deviator, deviator))
            limit = wp.max(p.yield_stress + p.hardening_modulus * q[0], p.least_yield)
            flow = tensor()
            plastic = internal()
            if effective > limit * (real(1.0) + real(strict)):
                phi = real(1.0)
                if p.exponent > real(0.0):
                    phi = wp.pow((effective - limit) / limit, p.exponent)
                plastic[0] = p.fluidity * phi
                flow = real(1.5) * plastic[0] / effective * deviator
            elastic = real(0.5) * (L + wp.transpose(L)) - flow
            return p.lame_first * wp.trace(elastic) * one + real(2.0) * p.lame_second * elastic, plastic

        return law
