"""What rooms and plugins see of each other: small protocols, without the classes that meet them."""

from collections.abc import Callable
from typing import Any, Protocol


class BodyKeys(Protocol):
    """The keys of a scene's body that its parts ask for."""

    name: str
    map: Any
    hourglass: Any
    viscosity: Any
    artificial_stress: Any
    phase_field: Any
    links: Any


class LimitedBody(Protocol):
    """A body in a run, as the guard of its time step sees it."""

    body: Any
    system: Any
    integrator: Any
    constitutive: Any
    courant: float
    limit: float | None
    limit_reason: str

    @property
    def longest_step(self) -> float:
        """The longest time step that the material can take [s]."""
        ...


Again = Callable[[], LimitedBody]
"""Makes a body once more, in double precision."""
