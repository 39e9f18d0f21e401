"""Reactions: what the boundaries of a body do to it, by their names, and the work of each.

A reaction is the mean force of the last step. Of what holds the body it is the impulse that setting the prescribed
velocities took, over dt; of a load the mean of the forces at both ends. With leapfrog the reactions of all boundaries and
gravity are then the change of the momentum in a step over dt, to rounding; with methods of several stages too, where loads
do not change, and else to the order of dt^2. Of walls, behind which a body has images, it is the force at the end of the
step.
"""

# pyright: strict

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from wsph.parts.works import work_and_force
from wsph.reporting import Term

Terms = Mapping[str, Sequence[Term]]


@dataclass(frozen=True)
class Reaction:
    """The reaction of a boundary, as people read it off (`wsph.reporting.Reported`)."""

    name: str
    numbers: Terms
    gather: Callable[[], None]
    kind: str = "reaction"


def reaction(name: str, dim: int, parts: Sequence[Terms], gather: Callable[[], None]) -> Reaction:
    """The reaction of a boundary from what it has of all that a body is held and loaded by."""
    work, *forces = work_and_force(dim)
    numbers = {each: [term for part in parts for term in part.get(each, ())] for each in (*forces, work)}
    return Reaction(name, numbers, gather)
