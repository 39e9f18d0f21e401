"""The fields of a state."""

# pyright: strict

from wsph.backend.space import Space
from wsph.backend.state import Field
from wsph.constitutive.constitutive import Constitutive


def matter_fields(constitutive: Constitutive, *, at_points: bool = False, derived: bool = False) -> tuple[Field, ...]:
    """Stress and internals of a material. `derived`: the stress follows from the deformation."""
    return (
        Field("stress", constitutive.width, "Pa", at_points=at_points, derived=derived),
        Field("internals", len(constitutive.internals), "", at_points=at_points, hidden=True, bounded=True),
    )


def velocity_field(space: Space) -> Field:
    """The velocity of particles."""
    return Field("velocity", space.dim, "m/s", leads=True)


def drag_field(space: Space) -> Field:
    """What drag has added to the velocities since the step began."""
    return Field("drag", space.dim, "m/s", leads=True, hidden=True)


def displacement_field(space: Space, wanted: bool = True) -> Field:
    """The displacement of particles, where it is `wanted`."""
    return Field("displacement", space.dim * wanted, "m")


def deviation_field(space: Space, wanted: bool = True) -> Field:
    """Deviation of a particle's neighbours from their linear field, turned and stretched back to the start, where it is
    `wanted`."""
    return Field("deviation", space.dim * wanted, "m", hidden=True)


def deformation_field(space: Space, *, at_points: bool = False, derived: bool = False) -> Field:
    """H = F - I."""
    return Field("deformation", space.dim**2, "", at_points=at_points, derived=derived, square=True, hidden=True)
