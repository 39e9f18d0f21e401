"""The tables of what acts between bodies, each kind as a function that finds it in a scene: interactions change velocities
between steps, couplings are forces in the rates of the velocities.

To add one, write its file beside this one and put its function in its list.
"""

# pyright: strict

from collections.abc import Callable, Sequence

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.between import CoupledBody, Coupling, Interaction, PushedBody
from wsph.contact.meeting.meeting import meetings
from wsph.contact.pinball.contacts import Contacts
from wsph.contact.surfaces.coupling import coupled
from wsph.contact.surfaces.laws import LawMaker
from wsph.contact.ties.tie import ties
from wsph.contact.tools.making import tool_laws
from wsph.scene.scene import Scene
from wsph.units import Scales

Maker = Callable[[Scene, Sequence[PushedBody], Space, Scales, Clock], Interaction | None]
"""Makes the interaction of one kind from a scene and its bodies, None where the scene has none of it. Raises Refused."""


def contacts(
    scene: Scene, bodies: Sequence[PushedBody], space: Space, scales: Scales, clock: Clock
) -> Interaction | None:
    """The contacts of a scene between balls."""
    parts = tuple(part for part in scene.contact if part.law == "pinball")
    return Contacts(parts, bodies, space, scales, clock, clock.device) if parts else None


INTERACTIONS: list[Maker] = [contacts]


def interactions(
    scene: Scene, bodies: Sequence[PushedBody], space: Space, scales: Scales, clock: Clock
) -> tuple[Interaction, ...]:
    """Everything that acts between the bodies of a scene, in the order of the list."""
    found = (make(scene, bodies, space, scales, clock) for make in INTERACTIONS)
    return tuple(each for each in found if each is not None)


CouplingMaker = Callable[[Scene, Sequence[CoupledBody], Space, Scales, Clock, bool], Coupling | None]
"""Makes the coupling of one kind from a scene and its bodies, which have no integrators yet, None where the scene has none
of it. The last argument: whether a step has one evaluation of the forces, at its end. Raises Refused."""

LAWS: list[LawMaker] = [meetings, ties, tool_laws]
"""What acts on the surfaces of bodies, each kind of law as a function that finds it in a scene."""


def surfaces(
    scene: Scene, bodies: Sequence[CoupledBody], space: Space, scales: Scales, clock: Clock, once: bool
) -> Coupling | None:
    """The surfaces of bodies, with all laws that act on them."""
    return coupled(scene, bodies, LAWS, space, scales, clock, once)


COUPLINGS: list[CouplingMaker] = [surfaces]


def couplings(
    scene: Scene, bodies: Sequence[CoupledBody], space: Space, scales: Scales, clock: Clock, *, once: bool
) -> tuple[Coupling, ...]:
    """All forces between the bodies of a scene, in the order of the list. `once`: a step evaluates forces once, at its
    end."""
    found = (make(scene, bodies, space, scales, clock, once) for make in COUPLINGS)
    return tuple(each for each in found if each is not None)
