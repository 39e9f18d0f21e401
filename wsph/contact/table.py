"""The table of interactions between bodies, each kind as a function that finds it in a scene.

To add one, write its file beside this one and put its function in the list.
"""

# pyright: strict

from collections.abc import Callable, Sequence

from wsph.backend.clock import Clock
from wsph.backend.space import Space
from wsph.contact.pinball.contacts import Contacts
from wsph.errors import Refused
from wsph.protocols import Interaction, PushedBody
from wsph.scene.scene import Scene
from wsph.units import Scales

Maker = Callable[[Scene, Sequence[PushedBody], Space, Scales, Clock], Interaction | None]
"""Makes the interaction of one kind from a scene and its bodies, None where the scene has none of it. Raises Refused."""


def contacts(
    scene: Scene, bodies: Sequence[PushedBody], space: Space, scales: Scales, clock: Clock
) -> Interaction | None:
    """The contacts of a scene between balls."""
    parts = tuple(part for part in scene.contact if part.law == "pinball")
    for part in scene.contact:
        if part not in parts:
            raise Refused(f"contact {part.name!r}: law = {part.law!r} is not there yet")
    return Contacts(parts, bodies, space, scales, clock, clock.device) if parts else None


INTERACTIONS: list[Maker] = [contacts]


def interactions(
    scene: Scene, bodies: Sequence[PushedBody], space: Space, scales: Scales, clock: Clock
) -> tuple[Interaction, ...]:
    """Everything that acts between the bodies of a scene, in the order of the list."""
    found = (make(scene, bodies, space, scales, clock) for make in INTERACTIONS)
    return tuple(each for each in found if each is not None)
