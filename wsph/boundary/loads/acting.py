"""The contract of loads that follow the state of a body, such as springs and follower pressures.

A load is one file. Its class is its table in a `[[boundary]]` of a scene, under its key; on the device it adds forces to the
particles of the selected faces in every evaluation of the right-hand sides, and stands on the ledger. Its stiffness
lowers the limit of the time step by itself: limits are found from the right-hand sides.
"""

# pyright: strict

from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.boundary.loads.loaded_faces import LoadedFaces
from wsph.boundary.loads.rows import FaceLoad
from wsph.protocols import Entry
from wsph.quantities import Model
from wsph.ranks.kept import Rows
from wsph.reporting import Term
from wsph.units import Scales


class ActingLoad:
    """A load on the device."""

    ledger: tuple[Entry, ...] = ()
    """Its entries of the energy ledger."""
    numbers: Mapping[str, Sequence[Term]] = {}
    """What it does to the body, for those who read it off (`wsph.reporting.Reported`): "force_x", ..., the mean of the last
    step, and "work" so far."""

    def rows(self) -> dict[str, Rows]:
        """Where what it keeps stands in what all processes keep, by the names of its arrays."""
        return {}

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        """Take the prescribed values of t + c dt for the evaluations to come; of c = (a, b) the mean of both times
        (launches, where they change)."""

    def act(self, state: State, forces: Array) -> None:
        """Add its forces in a state to `forces` (n,) vec, nondimensional (launches)."""
        raise NotImplementedError

    def resist(self, state: State, drags: Array) -> None:
        """Add its forces that depend on velocities, which dissipate, to `drags` (n,) vec, of a load that `resists`
        (launches). What they change and take is summed up by integrators."""

    def start(self, state: State) -> None:
        """Take what is there at the start of the run, where its work is summed up."""

    def advance(self, state: State) -> None:
        """Close a step (launches), where its work is summed up."""


class Load(Model):
    """Base of the loads' tables."""

    key: ClassVar[str] = ""
    """Its key in a boundary of a scene."""
    values: ClassVar[dict[str, str]] = {}
    """Those of its keys that are prescribed values, of time and place, with their units."""
    shorthand: ClassVar[tuple[dict[str, object], ...]] = ()
    """What it may be in place of a table, as JSON schemas."""
    by_corners: ClassVar[bool] = False
    """Whether it acts on faces by their corners, and so needs particles there."""
    on_faces: ClassVar[bool] = False
    """Whether it needs particles on the faces for another reason."""
    otherwise: ClassVar[str] = ""
    """The load that a body without such particles can have in place of it, in words."""

    @property
    def resists(self) -> bool:
        """Whether it has forces that depend on velocities."""
        return False

    def faults(self, dim: int) -> Iterator[tuple[str, str]]:
        """Keys of it, and what is wrong with them in a scene of `dim` dimensions."""
        yield from ()

    def at_rest(self, faces: LoadedFaces) -> FaceLoad | None:
        """Its forces on a body that has not moved, so that its resultant is seen before a run; None where there are none.
        The `faces` are in SI units."""
        return None

    def attach(self, faces: LoadedFaces, space: Space, scales: Scales, clock: Clock, arrays: Arrays) -> ActingLoad:
        """Put the load on the device; its arrays are registered in `arrays`."""
        raise NotImplementedError
