"""Numbers that people read off a run: how boundaries, contacts, tools and sections say which they are."""

# pyright: strict

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from wsph.protocols import DeviceArray


@dataclass(frozen=True, eq=False)
class Term:
    """A part of a number that is read off a run: the sum of `count` elements of `values`, flat, from `first` on, every
    `stride`-th of them, times `factor`. `values` are float64 on the device, nondimensional; steps keep them up to date."""

    values: DeviceArray
    first: int = 0
    count: int = 1
    stride: int = 1
    factor: float = 1.0


class Reported(Protocol):
    """Something in a run that people read numbers off: a boundary, a contact, a tool, a section. Its numbers are columns of
    history.csv, and what a probe `of` it records."""

    @property
    def name(self) -> str:
        """Its name in the scene."""
        ...

    @property
    def kind(self) -> str:
        """What its columns begin with: "reaction", "contact", "tool" or "section"."""
        ...

    @property
    def numbers(self) -> Mapping[str, Sequence[Term]]:
        """The terms of each number: "force_x", "force_y", "force_z" as the dimension has them, "torque" in 2D or "torque_x",
        "torque_y", "torque_z", and "work". A number that it does not have is left out; that of no terms is zero."""
        ...

    def gather(self) -> None:
        """Bring its terms up to date, where steps do not (launches)."""
        ...


@runtime_checkable
class Reporting(Protocol):
    """A holder of numbers that people read off: a system, or something that acts between bodies."""

    @property
    def reported(self) -> tuple[Reported, ...]: ...
