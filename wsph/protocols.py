"""What rooms and plugins see of each other: small protocols, without the classes that meet them."""

# pyright: strict

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol


@dataclass(frozen=True)
class Traits:
    """What a formulation can do, and what a run has to do for it."""

    one_set: bool = False
    """Whether particles of one set carry the whole motion."""
    pairwise: bool = False
    """Whether those particles are their own stress points."""
    reference: bool = False
    """Whether pairs and weights are those of the reference configuration."""
    stabilisation: float = 1.0
    """Stiffness of what a linear field leaves of the displacements, by default, in Young's moduli."""
    support: float = 2.6
    """Support by default [spacings]."""
    needs_rate: bool = False
    """Whether a material has to give a rate law."""
    maps: bool = False
    """Whether cells may differ in size and direction."""
    splits_cracks: bool = False
    """Whether cracks part the particles on them, and so have to run along lines of the grid."""
    pairs_follow: bool = False
    """Whether pairs follow the motion on the host: `System.follow` before every step."""
    courant_follows: bool = False
    """Whether a particle's own Courant number follows its deformation."""
    measures: bool = False
    """Whether its limit is found from its right-hand sides, and can be found again about a deformed state."""
    tried: bool = False
    """Whether the guard tries the step of a jittered body for modes that grow: collocation can have some."""
    clumps: bool = False
    """Whether modes of neighbouring particles can grow about a stretched state."""
    pushable: bool = False
    """Whether interactions between bodies may change the velocities of its particles between steps."""

    def with_(self, **changes: Any) -> "Traits":
        """The same with some of them changed."""
        return replace(self, **changes)


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
    def longest_steps(self) -> dict[str, float]:
        """The longest time steps that the material and the parts of the body can take [s], by their names."""
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
