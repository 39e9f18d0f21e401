"""What contacts, tools, boundaries and sections tell of themselves: numbers of the end of every step, by their columns."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

from wsph.backend.arrays import host
from wsph.backend.space import Array


@dataclass(frozen=True)
class Column:
    """A number of a reported thing: its place in the array, the SI value of one, and its `unit`."""

    index: int
    scale: float
    unit: str


@dataclass(frozen=True)
class Reported:
    """Numbers of something with a `name` and a `kind`, on the device: `numbers` (k,) float64, nondimensional, up to date at
    the end of every step.

    `fields`: what a probe may ask for, each with its columns, as in {"force": {"force_x": ..., "force_y": ...}};
    `history`: columns of history.csv by their endings, KIND_NAME_x and so on.
    """

    kind: str
    name: str
    numbers: Array
    fields: Mapping[str, Mapping[str, Column]]
    history: Mapping[str, Column]

    def columns(self) -> dict[str, Column]:
        """The columns of history.csv by their whole names."""
        return {f"{self.kind}_{self.name}_{ending}": column for ending, column in self.history.items()}

    def values(self) -> dict[str, float]:
        """The columns of history.csv in SI units (a copy from the device)."""
        numbers = host(self.numbers)
        return {name: float(numbers[column.index]) * column.scale for name, column in self.columns().items()}
