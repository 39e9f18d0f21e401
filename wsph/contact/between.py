"""What acts between bodies, as a run sees it, and bodies as that sees them."""

# pyright: strict

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from wsph.backend.domain import Share
from wsph.protocols import AnyState, BodySystem, BodyTable, DeviceArray, Entry, Integrator, Stepped
from wsph.reporting import Reported


class CoupledBody(Protocol):
    """A body, as forces between bodies see it: its table and its system."""

    @property
    def body(self) -> BodyTable: ...

    @property
    def system(self) -> BodySystem: ...


class PushedBody(Protocol):
    """A body in a run, as what acts between bodies sees it. What its system has beside, where its traits say that it is
    `pushable`, is `wsph.contact.touched.TouchedSystem`."""

    @property
    def body(self) -> BodyTable: ...

    @property
    def system(self) -> BodySystem: ...

    @property
    def integrator(self) -> Integrator: ...


class Interaction(Protocol):
    """An interaction between bodies, or with one from outside, around their steps: contact, a rigid tool, a tie."""

    ledger: tuple[Entry, ...]
    follows: bool
    """Whether `follow` has to be called before every step, which keeps steps from being captured in blocks."""

    def follow(self) -> bool:
        """Before a step, on the host: bring up to date what follows the motion; whether that changed what launches take."""
        ...

    def start(self) -> None:
        """Find what acts at the start of a run (launches)."""
        ...

    def begin(self) -> None:
        """Before the bodies' step: half of what changes their velocities, with what acts where they are (launches)."""
        ...

    def act(self) -> None:
        """After it: find what acts where they are now, and the other half (launches)."""
        ...

    def frequency(self, body: str) -> float:
        """A bound of the frequency that it adds to a body's, nondimensional; 0 for a body that it does not touch."""
        ...

    def kept(self) -> Mapping[str, DeviceArray]:
        """Device arrays that a run goes on from, by name."""
        ...

    def shares(self) -> Mapping[str, Share]:
        """As `Coupling.shares`."""
        ...

    def restored(self) -> None:
        """Make what follows from the kept arrays, after they have been put back."""
        ...


class Coupling(Protocol):
    """Forces between bodies, or on them from outside, as part of the rates of their velocities: contact, tools, ties. Bodies
    that a coupling acts on step together, by one integrator (`wsph.simulation.composing.joint`). States and rates are those
    of the evaluation, by the bodies' names."""

    ledger: tuple[Entry, ...]

    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies that it acts on."""
        ...

    def members(self) -> Mapping[str, Stepped]:
        """What it brings that steps beside them, such as rigid bodies, by their names."""
        ...

    @property
    def reported(self) -> tuple[Reported, ...]:
        """What of it people read numbers off."""
        ...

    def fields(self, body: str) -> Mapping[str, Callable[[], np.ndarray]]:
        """Fields of a body's particles that frames can have by it, by their names in `wsph.output.fields.ON_SURFACES`."""
        ...

    def follow(self) -> bool:
        """Before a step, on the host: bring up to date what follows the motion; whether that changed what launches take."""
        ...

    def start(self, states: Mapping[str, AnyState]) -> None:
        """Take what is there at the start of the run (launches)."""
        ...

    def push(self, states: Mapping[str, AnyState], rates: Mapping[str, AnyState]) -> None:
        """Add the accelerations of its forces in a state to the rates (launches)."""
        ...

    def close(self, states: Mapping[str, AnyState], *, fresh: bool) -> None:
        """Close a step (launches): take the memory of the evaluation, sum works up. Not `fresh`: the last evaluation was not
        of this state, and there is another first."""
        ...

    def bound(self, body: str) -> tuple[float, float]:
        """Bounds of what it adds to the square of a body's frequency and to the rate of its damping, nondimensional; zeros
        for a body that it does not touch."""
        ...

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness, in those of the materials, where the scene leaves it open; whether it does."""
        ...

    def kept(self) -> Mapping[str, DeviceArray]:
        """Device arrays that a run goes on from, by name."""
        ...

    def shares(self) -> Mapping[str, Share]:
        """The parts that this process has of kept arrays that processes share, of particles, contacts and bonds, by their
        names: all others are alike in every process."""
        ...

    def as_kept(self, values: Mapping[str, np.ndarray]) -> None:
        """Before `values` are put back into the kept arrays: make those of the lengths that they had."""
        ...

    def restored(self) -> None:
        """Make what follows from the kept arrays, after they have been put back."""
        ...
