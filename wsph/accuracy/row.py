"""One row of a search: a run, and what it took."""

# pyright: strict

from collections.abc import Mapping
from dataclasses import dataclass

from wsph.accuracy.measures import Record
from wsph.simulation.result import Result


class Halted(Exception):
    """A search that cannot go on: `status` "interrupted", or "refused" where a run did not come to its end."""

    def __init__(self, status: str, why: str):
        super().__init__(why)
        self.status = status


@dataclass(frozen=True)
class Row:
    """A run: its lattice by `cells` and `spacing` [m], the work that was `planned`, and what it took; `records` of all
    probes, "PROBE.COLUMN"."""

    cells: int
    spacing: float
    planned: float
    work: float
    right_hand_sides: int
    steps: int
    particles: int
    wall_seconds: float
    cpu_seconds: float
    records: Mapping[str, Record]
    result: Result

    def data(self) -> dict[str, object]:
        """As accuracy.json has it."""
        run = self.result.scene.run
        return {
            "spacing": self.spacing,
            "cells": self.cells,
            "particles": self.particles,
            "steps": self.steps,
            "planned_work": self.planned,
            "work": self.work,
            "rhs": self.right_hand_sides,
            "wall_seconds": self.wall_seconds,
            "cpu_seconds": self.cpu_seconds,
            "precision": run.precision,
            "integrator": run.integrator.name,
            "formulation": run.formulation or "default",
        }


def in_seconds(seconds: float) -> str:
    """A time in words."""
    if seconds < 120.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.2g} h"
