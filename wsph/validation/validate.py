"""Published cases, run and compared with their oracles."""

# pyright: strict

import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from wsph.errors import WsphError
from wsph.quantities import Table
from wsph.scene.messages import nearest
from wsph.validation import contact, curved, cylinder, fracture, he_seaid, taylor, vibrating
from wsph.validation.case import Case, Row

_FILES = (taylor, he_seaid, fracture, curved, vibrating, cylinder, contact)

CASES = {each.name: each for file in _FILES for each in file.CASES}
"""Every published case by name, in the order in which they are run."""


@dataclass(frozen=True)
class Outcome:
    """A case that was run: its rows, and the seconds that it took."""

    case: Case
    rows: tuple[Row, ...]
    seconds: float

    @property
    def meets(self) -> bool:
        """Whether every figure is within what is asked."""
        return all(row.meets for row in self.rows)


def validate(names: Sequence[str] = (), full: bool = False) -> Iterator[Outcome]:
    """Run the named cases (all, where none is named), one after the other. Raises WsphError for a name that is none."""
    for name in names:
        if name not in CASES:
            raise WsphError(f"no case is named {name!r}; {nearest(name, CASES, 'there is ' + ', '.join(CASES))}")
    for name in names or CASES:
        started = time.perf_counter()
        with warnings.catch_warnings():
            # Numerical dissipation is what some of the cases measure.
            warnings.filterwarnings("ignore", "energy was lost", RuntimeWarning)
            rows = tuple(CASES[name].rows(full))
        yield Outcome(CASES[name], rows, time.perf_counter() - started)


def as_data(outcome: Outcome) -> Table:
    """An outcome as plain data."""
    rows = [
        {
            "figure": r.figure,
            "published": r.published,
            "asked": r.asked,
            "reached": r.reached,
            "unit": r.unit,
            "meets": r.meets,
        }
        for r in outcome.rows
    ]
    case = outcome.case
    return {
        "case": case.name,
        "source": case.source,
        "oracle": case.oracle,
        "seconds": outcome.seconds,
        "meets": outcome.meets,
        "rows": rows,
    }
