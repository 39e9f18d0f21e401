"""What rooms and plugins see of each other: small protocols, without the classes that meet them."""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass
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
    integrator: "Integrator"
    constitutive: Any

    @property
    def courant(self) -> float:
        """The Courant number of its steps."""
        ...

    @property
    def limit(self) -> float | None:
        """The largest stable Courant number, None where it is not known."""
        ...

    @property
    def limit_reason(self) -> str:
        """Where the limit comes from."""
        ...

    @property
    def longest_step(self) -> float:
        """The longest time step that the material can take [s]."""
        ...


Again = Callable[[], LimitedBody]
"""Makes a body once more, in double precision."""


class Integrator(Protocol):
    """What a run calls of an integrator; what else it may have is asked in `wsph.plugins.integrators`."""

    order: int
    """Its order in time."""

    def step(self) -> None:
        """One step of its system's state, by launches alone."""
        ...


class PushedBody(Protocol):
    """A body in a run, as what acts between bodies sees it."""

    body: Any
    system: Any
    integrator: Integrator


class Limited(Protocol):
    """A system, as the limit of its time step sees it."""

    @property
    def frequency(self) -> float:
        """The largest frequency of its small motions, nondimensional."""
        ...

    def measure_anew(self) -> None:
        """Forget what is known of the small motions: the next question is about the current state."""
        ...


@dataclass(frozen=True)
class Entry:
    """An entry of the energy ledger: what it has come to so far, nondimensional, and the column of history.csv that it is
    counted in. The column "external_work" is what is done on the bodies; the residual is it less all others."""

    column: str
    value: Callable[[], float]


class Interaction(Protocol):
    """What acts between bodies, or on one from outside, between two steps: contact, a rigid tool, a tie."""

    ledger: tuple[Entry, ...]
    follows: bool
    """Whether `follow` has to be called before every step, which keeps steps from being captured in blocks."""

    def follow(self) -> bool:
        """Before a step, on the host: bring up to date what follows the motion; whether that changed what launches take."""
        ...

    def act(self) -> None:
        """Change the velocities of the bodies (launches)."""
        ...

    def frequency(self, body: str) -> float:
        """A bound of the frequency that it adds to a body's, nondimensional; 0 for a body that it does not touch."""
        ...

    def kept(self) -> dict[str, Any]:
        """Device arrays that a run goes on from, by name."""
        ...

    def restored(self) -> None:
        """Make what follows from the kept arrays, after they have been put back."""
        ...
