"""One row of a search: a run, and what it took."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from wsph.accuracy.measures import Record
from wsph.simulation.result import Result


class Halted(Exception):
    """A search that cannot go on: `status` "interrupted", or "refused" where a run did not come to its end."""

    def __init__(self, status: str, why: str):
        super().__init__(why)
        self.status = status


@dataclass(frozen=True)
class Row:
    """A run: its lattice by `cells` and `spacing` [m], the work that was `planned`, the seconds that it took, and its
    `result`; of the wall seconds those of `composing`, where it was not composed before."""

    cells: int
    spacing: float
    planned: float
    wall_seconds: float
    cpu_seconds: float
    result: Result
    composing: float = 0.0

    @property
    def work(self) -> float:
        """Pair visits."""
        return float(self.result.work)

    @property
    def steps(self) -> int:
        """Steps of the run."""
        return self.result.summary["steps"]

    @cached_property
    def records(self) -> Mapping[str, Record]:
        """The columns of all probes, "PROBE.COLUMN"."""
        return {name: Record(*each) for name, each in self.result.recorded().items()}

    def data(self) -> dict[str, object]:
        """As accuracy.json has it."""
        run, summary = self.result.scene.run, self.result.summary
        return {
            "spacing": self.spacing,
            "cells": self.cells,
            "particles": summary["particles"],
            "steps": self.steps,
            "planned_work": self.planned,
            "work": self.work,
            "rhs": summary["right_hand_sides"],
            "wall_seconds": self.wall_seconds,
            "cpu_seconds": self.cpu_seconds,
            "precision": run.precision,
            "integrator": run.integrator.name,
            "formulation": run.formulation or "default",
        }


class Late(Halted):
    """A row that was ended because it would have gone beyond the seconds that there are, or was `early`, as they pay for a
    finer one: as far as it came."""

    def __init__(self, why: str, row: Row, early: bool = False):
        super().__init__("out of reach", why)
        self.row, self.early = row, early


def in_seconds(seconds: float) -> str:
    """A time in words."""
    if seconds < 120.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.2g} h"
