"""Compressible neo-Hookean elasticity: for large strains and any rotation."""

from dataclasses import dataclass

import warp as wp

from wsph_materials.elastic import Isotropic


@dataclass(frozen=True)
class NeoHookean(Isotropic):
    """W = mu/2 (tr(F^T F) - 3) - mu ln J + lambda/2 (ln J)^2, stress = (mu (F F^T - I) + lambda ln J I)/J.

    A total law alone: for total-Lagrangian forms. Linear elasticity at small strain; resists collapse (J to 0) and stretch.
    Fields as in `Isotropic`.
    """

    def stress(self, space, Params) -> wp.Function:
        """The total law (p, H) -> Cauchy stress."""
        real, tensor = space.scalar, space.tensor
        logarithm = log_of_volume(space)

        @wp.func
        def law(p: Params, H: tensor) -> tensor:
            one = wp.identity(n=3, dtype=real)
            J = wp.determinant(one + H)
            stretch = H + wp.transpose(H) + H * wp.transpose(H)
            return (p.lame_second * stretch + p.lame_first * logarithm(H) * one) / J

        return law

    def energy(self, space, Params) -> wp.Function:
        """The energy (p, H) -> W per reference volume."""
        real, tensor = space.scalar, space.tensor
        logarithm = log_of_volume(space)

        @wp.func
        def stored(p: Params, H: tensor) -> real:
            change = logarithm(H)
            trace = real(2.0) * wp.trace(H) + wp.ddot(H, H)
            return p.lame_second * (real(0.5) * trace - change) + real(0.5) * p.lame_first * change * change

        return stored


def log_of_volume(space) -> wp.Function:
    """Warp function H -> ln det(I + H), to rounding at small strain too."""
    real, tensor = space.scalar, space.tensor

    @wp.func
    def logarithm(H: tensor) -> real:
        trace = wp.trace(H)
        x = trace + real(0.5) * (trace * trace - wp.trace(H * H)) + wp.determinant(H)
        if wp.abs(x) < real(0.03125):
            # ln(1 + x) = 2 artanh(x/(2 + x)): the series in z^2 < 2.4e-4 has all digits after five terms.
            z = x / (real(2.0) + x)
            z2 = z * z
            return (
                real(2.0)
                * z
                * (
                    real(1.0)
                    + z2 * (real(1.0) / real(3.0) + z2 * (real(0.2) + z2 * (real(1.0) / real(7.0) + z2 / real(9.0))))
                )
            )
        return wp.log(real(1.0) + x)

    return logarithm
