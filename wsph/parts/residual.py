"""The residual: a stiffness against the misfit of a linear field to the displacements that a point sees.

It holds the modes that a gradient alone does not see, and is there by default: in forms with a reference configuration
against displacements since then (`wsph.formulations.lagrangian.rates` has the equations), where pairs follow the motion
against what particles remember of it (`wsph.formulations.updated.memory`).
"""

# pyright: strict

from typing import Annotated, ClassVar

from wsph.declarations import example
from wsph.parts.part import Host, Part
from wsph.protocols import Traits
from wsph.quantities import Unit

AT_NODES = 0.3
"""By default, of particles that are their own points and stand on the faces."""

ALONG_EDGES = 0.15
"""By default, of particles whose pairs are the edges of the cells. Sawteeth swing at 0.22 to 0.25 of 2 c/spacing with 0.2,
as with a kernel's pairs and 0.3; a cantilever of four rows in 3D is 1.1 % fast with 0.2, 0.6 % with 0.1."""

BREAKING = 0.1
"""By default, of a body that can break: enough to hold spurious modes; more is stiffness that a crack has to release beside
the material's."""

FLOWING = 0.03
"""By default, of a material that flows: the residual stays elastic, and a plastic hinge would spring back."""

MOVING = {1: 1.0, 2: 2.5, 3: 4.0}
"""By default, where pairs follow the motion, by dimension: free beams of 4, 8 and 12 rows in 2D vibrate .1, .4 and .3 %
below their frequency (3.4, 1.5 and .8 % with 2), and steps of a Courant number of .9 stay stable. With particles on the
faces AT_NODES of it: 1.2 and .1 % above with 4 and 8 rows."""

MOVING_FLOW = 0.1
"""The same of a material that flows."""


class Residual(Part):
    """Stiffness against the misfit of a linear field to the displacement differences, in Young's moduli."""

    model_config = example({"coefficient": 0.1})
    key: ClassVar[str] = "residual"
    holds_modes: ClassVar[bool] = True
    switchable: ClassVar[bool] = True
    coefficient: Annotated[float, Unit("", ge=0)]

    @property
    def acts(self) -> bool:
        return self.coefficient > 0.0

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.one_set


def stabilisation(host: Host) -> float:
    """The stiffness of a body's residual, as its scene has it or by default, in Young's moduli."""
    part = host.parts.get(Residual.key)
    return part.coefficient if isinstance(part, Residual) else _usual(host)


def _usual(host: Host) -> float:
    # Hourglass control takes its place unless both are named; the paper has none.
    if "hourglass" in host.parts or host.correction == "paper":
        return 0.0
    flows = host.constitutive.laws.dissipates
    if host.traits.pairs_follow:
        usual = MOVING[host.space.dim] * (AT_NODES if host.at_nodes else 1.0)
        return min(usual, MOVING_FLOW) if flows else usual
    usual = host.traits.stabilisation
    if host.traits.reference:
        usual = AT_NODES if host.traits.pairwise and host.at_nodes else usual
        usual = BREAKING if host.breaks else usual
        usual = FLOWING if flows else usual
        # What flows by edges has volumes of blocks, and with less a Taylor bar turns inside out.
        usual = ALONG_EDGES if host.edges and (host.flows or not flows) else usual
    return usual
