"""The energy ledger of a run: the energies and works of its bodies and interactions so far, column by column.

Nothing here knows which parts of bodies or which interactions there are: each brings its entries. An entry may name a
column of its own, which then stands before the external work. What contact stores, what it dissipates and what it makes or
takes beside that have columns where anything names them; the column `contact` is their sum, and counts once. The residual is
the external work less all the others: below zero, energy was created.
"""

# pyright: strict

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from wsph.protocols import Entry
from wsph.simulation.diagnostics import BodySums

COLUMNS = ("kinetic", "strain", "dissipated", "hourglass", "contact")
"""The columns of every ledger, in the order of history.csv."""

CONTACT, OF_CONTACT = COLUMNS[4], ("contact_stored", "contact_dissipated", "contact_numerical")
"""The column of contact, and those that it is the sum of."""

WORK, RESIDUAL = "external_work", "residual"

LOST, HELD = COLUMNS[2:4]
"""The columns of what is dissipated, and of what holds spurious modes."""


@dataclass(frozen=True)
class Account:
    """The ledger at a step, nondimensional: `energies` by column, the `total` that the bodies hold and have lost, the
    `work` done on them, with what they started with, and their momentum (dim,); by body, what `held` spurious modes and what
    parts, loads and forces have `lost`, beside the material."""

    energies: dict[str, float]
    total: float
    work: float
    momentum: np.ndarray
    held: tuple[float, ...]
    lost: tuple[float, ...]


class Ledger:
    """Sums up the entries of bodies and interactions. `initial` is what the bodies started with, nondimensional."""

    def __init__(self, bodies: Sequence[Sequence[Entry]], interactions: Sequence[Sequence[Entry]]):
        """The entries of each. Raises ValueError for one that names the residual."""
        self._bodies, self._interactions = bodies, interactions
        named = dict.fromkeys(entry.column for entries in (*bodies, *interactions) for entry in entries)
        if RESIDUAL in named:
            raise ValueError("the residual is what all entries leave: none can name it")
        parts = [name for name in OF_CONTACT if name in named]
        self.further = (*parts, *(name for name in named if name not in (*COLUMNS, *OF_CONTACT, WORK)))
        """Columns beyond those that every ledger has."""
        self.columns = (*COLUMNS, *self.further, WORK, RESIDUAL)
        self.initial = 0.0

    def open(self, sums: Sequence[BodySums]) -> Account:
        """Begin with what the bodies hold; the account of that."""
        self.initial = self.account(sums).total
        return self.account(sums)

    def account(self, sums: Sequence[BodySums]) -> Account:
        """The account at present (copies from the device). `sums` are of the bodies' states as they are."""
        bodies = [_by_column(entries) for entries in self._bodies]
        interactions = [_by_column(entries) for entries in self._interactions]
        measured = {
            "kinetic": [sum(e.kinetic for e in sums)],
            "strain": [sum(e.strain for e in sums)],
            "dissipated": [sum(e.dissipated for e in sums)],
        }
        # The order of these sums is part of the bits of a run.
        beside = {
            name: [*_over(bodies, name), *_together(interactions, name)] for name in (*COLUMNS, *self.further, WORK)
        }
        energies = {
            name: reduce(operator.add, [*measured.get(name, []), *beside[name]] or [0.0])
            for name in (*COLUMNS, *self.further)
        }
        # An entry may be of contact as a whole, too.
        energies[CONTACT] += sum(energies.get(name, 0.0) for name in OF_CONTACT)
        counted = [energies[name] for name in self.further if name not in OF_CONTACT]
        total = sum(e.kinetic + e.strain for e in sums) + energies["dissipated"]
        total += energies["hourglass"] + energies[CONTACT]
        for value in (*beside["kinetic"], *beside["strain"], *counted):
            total += value
        work = self.initial
        for value in (*_together(interactions, WORK), *_over(bodies, WORK)):
            work += value
        energies |= {WORK: work, RESIDUAL: work - total}
        momentum = np.asarray(sum(e.momentum for e in sums))
        held, lost = (tuple(group.get(name, 0.0) for group in bodies) for name in (HELD, LOST))
        return Account(energies, total, work, momentum, held, lost)


def _by_column(entries: Sequence[Entry]) -> dict[str, float]:
    """The values of the entries of one body or interaction so far, by column."""
    values: dict[str, float] = {}
    for entry in entries:
        value = entry.value()
        values[entry.column] = values[entry.column] + value if entry.column in values else value
    return values


def _over(groups: Sequence[dict[str, float]], column: str) -> list[float]:
    """The sum of a column over bodies, in a list that is empty where none has it."""
    found = [group[column] for group in groups if column in group]
    return [float(sum(found))] if found else []


def _together(groups: Sequence[dict[str, float]], column: str) -> list[float]:
    """The same over interactions, where a zero keeps its sign."""
    found = [group[column] for group in groups if column in group]
    return [reduce(operator.add, found)] if found else []
