"""What a run finds of its own answer that makes it worth less: said in a warning, and in the findings of summary.json.

The energy of whatever holds a body's spurious modes (a column of the ledger) is that of a stiffness which the material does
not have. It is measured by the largest internal energy that the body has had so far, what it stores and what it has
dissipated: 5 % is warned of, 10 % is a finding. Near rest, and where a body flies or turns almost undeformed, that is no
measure: a twentieth of the largest energy of the body stands in its place.
"""

# pyright: strict

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field

from wsph.simulation.composition import BodyRun
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.ledger import HELD, Account

HELD_WARNING, HELD_FINDING, HELD_FLOOR, HELD_AFTER = 0.05, 0.10, 0.05, 20
"""Parts of the internal energy that are warned of and that are a finding; part of the whole energy that is the least
measure; steps before the first look."""


@dataclass
class Held:
    """Of a body, nondimensional: the largest internal energy and the largest energy so far, the largest part of the internal
    energy that holds spurious modes, at which step, and whether it was warned of."""

    internal: float = 0.0
    energy: float = 0.0
    worst: float = 0.0
    step: int = 0
    warned: bool = False

    def look(self, step: int, sums: BodySums, held: float, lost: float) -> float:
        """The part at `step`. `held` is the energy that holds spurious modes, `lost` what parts and loads dissipated."""
        internal = sums.strain + sums.dissipated + lost
        self.internal = max(self.internal, internal)
        self.energy = max(self.energy, sums.kinetic + internal)
        measure = max(self.internal, HELD_FLOOR * self.energy)
        part = held / measure if measure > 0.0 else 0.0
        if part > self.worst:
            self.worst, self.step = part, step
        return part


@dataclass
class Findings:
    """The findings of a run, by its bodies."""

    bodies: Sequence[BodyRun]
    held: list[Held] = field(default_factory=list[Held])

    def __post_init__(self) -> None:
        self.held = self.held or [Held() for _ in self.bodies]

    def look(self, step: int, sums: Sequence[BodySums], account: Account) -> None:
        """Look at a state; warn of a body that needs it, once."""
        if step <= HELD_AFTER:
            return
        for run, mine, each, held, lost in zip(self.bodies, self.held, sums, account.held, account.lost, strict=True):
            part = mine.look(step, each, held, lost)
            if part > HELD_WARNING and not mine.warned:
                mine.warned = True
                warnings.warn(_words(run, step, part), RuntimeWarning, stacklevel=5)

    @property
    def words(self) -> list[str]:
        """The findings so far, in words."""
        found = zip(self.bodies, self.held, strict=True)
        return [_words(run, mine.step, mine.worst) for run, mine in found if mine.worst > HELD_FINDING]

    def kept(self) -> list[list[float]]:
        """The numbers that a checkpoint holds of it."""
        return [[each.internal, each.energy, each.worst, each.step, each.warned] for each in self.held]

    def restore(self, kept: Sequence[Sequence[float]]) -> None:
        """Put back what `kept` gave."""
        self.held = [Held(a, b, c, int(step), bool(warned)) for a, b, c, step, warned in kept]


def _words(run: BodyRun, step: int, part: float) -> str:
    return (
        f"step {step}: control of spurious modes (column {HELD} of history.csv) has {100 * part:.3g} % of the internal energy"
        f" of body {run.body.name!r}: it carries what the material should; use a finer spacing, or another run.formulation"
    )
