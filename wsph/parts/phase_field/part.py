"""Phase-field fracture as a part of a body: table, refusals, terms and fields."""

# pyright: strict

from typing import Annotated, ClassVar, Literal

import numpy as np

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.state import Field, State
from wsph.errors import Refused
from wsph.parts.part import Attached, Host, Neighbourhood, Part
from wsph.parts.phase_field.field import PhaseDamage, respond
from wsph.parts.phase_field.response import energy_left
from wsph.parts.phase_field.sight import SKEW, Sight, sight_of
from wsph.parts.phase_field.sweep import phase_struct
from wsph.parts.terms import Response
from wsph.plugins.traits import is_linear, turns
from wsph.protocols import Traits
from wsph.quantities import Unit


class PhaseField(Part):
    """Phase-field fracture: `fracture_energy` G_c [J/m2], `length` l [m], model "AT1" (no damage below a strength) or
    "AT2"."""

    key: ClassVar[str] = "phase_field"
    formal: ClassVar[int] = 1
    breaks: ClassVar[bool] = True
    offers: ClassVar[tuple[str, ...]] = ("damage",)
    fracture_energy: Annotated[float, Unit("J/m2", gt=0)]
    length: Annotated[float, Unit("m", gt=0)]
    model: Literal["AT1", "AT2"] = "AT1"

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.one_set and traits.reference

    def refuse(self, host: Host) -> None:
        material, spacing = host.constitutive.material, _largest(host)
        if host.geometry.mapped and not host.corners:
            raise Refused(
                f"body {host.name!r}: with pairs of a kernel phase_field needs a lattice of one spacing, without `map`: leave one out, or"
                ' choose run.formulation = "stress-points" without run.support'
            )
        bulk, shear = material.moduli()
        if host.constitutive.state.free and bulk < 2.0 / 3.0 * shear:
            raise Refused(
                f"body {host.name!r}: with a Poisson ratio below zero phase_field finds no strain out of a plane of zero stress: use"
                ' state = "strain" (or 3D)'
            )
        if not (is_linear(material) or turns(material)):
            raise Refused(
                f"body {host.name!r}: phase_field splits the energy of linear elasticity or the stress of a rate law that turns with"
                f" the body; {host.constitutive.who} is neither: use elastic or jaumann"
            )
        if self.length < spacing:
            raise Refused(
                f"body {host.name!r}: phase_field.length = {self.length:g} m is below the spacing, {spacing:g} m: a crack would not be"
                f" resolved; use at least {1.5 * spacing:g} m"
            )

        if _differ(host):
            self._sight(host)

    def _sight(self, host: Host) -> Sight:
        """What the points here see where cells differ. Raises Refused where that is too little, or too unlike in
        its directions."""
        try:
            found = sight_of(host.geometry)
        except ValueError as error:
            raise Refused(f"body {host.name!r}: phase_field: {error}") from None
        if found.skew > SKEW:
            raise Refused(
                f"body {host.name!r}: its cells are too long for their width: cracks across them would take {100 * found.skew:.0f} % less"
                f" than fracture_energy, on the mean, and phase_field takes cells of up to {100 * SKEW:g} %: use cells of more equal sides"
            )
        return found

    def fields(self, host: Host) -> tuple[Field, ...]:
        evolved = host.constitutive.laws.total is None
        return (
            Field("damage", 1, "", at_points=True, derived=True, bounded=True),
            # An evolved stress goes on undamaged.
            Field("damaged_stress", host.constitutive.width * evolved, "Pa", at_points=True, derived=True, hidden=True),
        )

    def response(self, host: Host) -> Response | None:
        return Response(self.model, phase_struct, respond(self.model, _differ(host)), energy_left)

    def attach(self, host: Host, seen: Neighbourhood, state: State, clock: Clock, arrays: Arrays) -> Attached | None:
        toughness = self.fracture_energy / (host.scales.stress * host.scales.length)
        length = self.length / host.scales.length
        laplacian = host.scales.length**2 * self._sight(host).laplacian if _differ(host) else None
        return PhaseDamage(self.model, toughness, length, host.space, seen, state, clock, arrays, laplacian)


def _differ(host: Host) -> bool:
    """Whether points see their own corners, of cells that differ."""
    return host.corners and host.geometry.irregular


def _largest(host: Host) -> float:
    """The spacing of the points [m], where cells differ that of the largest."""
    geometry = host.geometry
    if not _differ(host):
        return geometry.spacing
    largest = float(geometry.split.domain.max(np.array(geometry.cell_volume.max())))
    return largest ** (1.0 / host.space.dim)
