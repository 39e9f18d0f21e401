"""Every part that a body can have. A part is added by its file and a line here."""

# pyright: strict

from wsph.parts.artificial_stress import ArtificialStress
from wsph.parts.hourglass import Hourglass
from wsph.parts.links import Links
from wsph.parts.part import Part
from wsph.parts.phase_field.part import PhaseField
from wsph.parts.residual import Residual
from wsph.parts.viscosity import Viscosity

PARTS: dict[str, type[Part]] = {
    part.key: part for part in (Viscosity, Residual, Hourglass, ArtificialStress, PhaseField, Links)
}
"""By their keys in a body, in the order in which their terms join the loops."""
