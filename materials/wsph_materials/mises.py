"""Rate-independent plasticity: von Mises with linear hardening, brought back radially (Wilkins)."""

from dataclasses import dataclass, field

import warp as wp

from wsph_materials.elastic import Isotropic
from wsph_materials.jaumann import jaumann_rate


@dataclass(frozen=True)
class Mises(Isotropic):
    """The Jaumann rate of linear elasticity; above yield the deviator is scaled back to it: s sigma_y/q, q = sqrt(3/2 s:s).

    Wilkins 1964; Islam & Peng 2019, 2.4. sigma_y = yield_stress + hardening_modulus * plastic_strain, not below zero; the
    plastic strain grows by (q - sigma_y)/(3 G + hardening_modulus). The pressure is the elastic one. Plastic work is on the
    ledger. A hardening modulus at or below -3 G would have no answer and is refused.

    Fields: density [kg/m3], youngs_modulus [Pa], poisson_ratio, yield_stress [Pa], hardening_modulus [Pa, 0: perfectly
    plastic, negative softens]. Internal: plastic_strain, the equivalent plastic strain.
    """

    yield_stress: float = field(metadata={"unit": "Pa", "above": 0.0})
    hardening_modulus: float = field(default=0.0, metadata={"unit": "Pa"})

    depends_on_stress = True
    relaxes = False
    turns_itself = True
    internals = {"plastic_strain": 0.0}
    flows = ("plastic_strain", "yield_stress")

    def __post_init__(self) -> None:
        """Raises ValueError where softening outruns elasticity."""
        if self.hardening_modulus <= -3.0 * self.lame_second:
            raise ValueError(f"hardening_modulus must be above -3 G = {-3.0 * self.lame_second:g} Pa")

    def rate(self, space, Params) -> wp.Function:
        """The elastic law (p, stress, L, q) -> stress rate, no rate of the plastic strain."""
        tensor, internals = space.tensor, space.vector(1)
        elastic = jaumann_rate(space, Params)

        @wp.func
        def law(p: Params, stress: tensor, L: tensor, q: internals):
            return elastic(p, stress, L), internals()

        return law

    def project(self, space, Params) -> wp.Function:
        """The return (p, stress, q) -> stress, q."""
        real, tensor, internals = space.scalar, space.tensor, space.vector(1)

        @wp.func
        def back(p: Params, stress: tensor, q: internals):
            one = wp.identity(n=3, dtype=real)
            mean = wp.trace(stress) / real(3.0)
            s = stress - mean * one
            size = wp.sqrt(real(1.5) * wp.ddot(s, s))
            limit = wp.max(p.yield_stress + p.hardening_modulus * q[0], real(0.0))
            if size <= limit:
                return stress, q
            more = (size - limit) / (real(3.0) * p.lame_second + p.hardening_modulus)
            limit = wp.max(p.yield_stress + p.hardening_modulus * (q[0] + more), real(0.0))
            # Where softening has reached zero the whole deviator goes.
            more = (size - limit) / (real(3.0) * p.lame_second)
            return mean * one + (limit / size) * s, internals(q[0] + more)

        return back
