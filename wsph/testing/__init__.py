"""Conformance kits for plugins: what every material and every integrator must do. Our own run them too.

    from wsph.testing import check_material, check_integrator

    def test_mine():
        check_material(Mine(density=1000.0, ...))
        check_integrator("mine", order=2)

Each check raises AssertionError with a sentence that says what the plugin did and what was expected.
"""

# pyright: strict

from wsph.constitutive.sampling import LawSampler
from wsph.testing.integrators import check_integrator, check_limit, temporal_order
from wsph.testing.materials import check_material
from wsph.testing.reactions import check_reactions
from wsph.testing.scenes import AMPLITUDE, vibrating_bar
from wsph.testing.steps import drift, spectral_radius, step_matrix, whole_spectrum

__all__ = [
    "AMPLITUDE",
    "LawSampler",
    "check_integrator",
    "check_limit",
    "check_material",
    "check_reactions",
    "drift",
    "spectral_radius",
    "step_matrix",
    "temporal_order",
    "vibrating_bar",
    "whole_spectrum",
]
