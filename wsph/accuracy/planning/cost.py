"""What a run will cost, before it runs: pair visits, the pairs of all operators times the right-hand sides.

A scene is set up for it, some hundredths of a second, and nothing of its step is compiled: its pairs, its time step and the
right-hand sides of its integrator are then what the run itself will have. Beyond LARGEST cells it is scaled from a smaller
lattice of the same scene. Steps that shrink with the deformation are more than were planned: `Rate` learns by how much,
and what a visit takes in seconds, from the rows that were run.
"""

# pyright: strict

import math
import warnings
from dataclasses import dataclass

import numpy as np

from wsph.accuracy.planning.lattices import Lattices
from wsph.plugins import integrators
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose

LARGEST = 2e5
"""Particles up to which a scene is set up to know its work."""


@dataclass(frozen=True)
class Plan:
    """What a run will take: `particles`, `pairs`, `steps` and `right_hand_sides`."""

    particles: float
    pairs: float
    steps: float
    right_hand_sides: float

    @property
    def work(self) -> float:
        """Pair visits."""
        return self.pairs * self.right_hand_sides

    def finer(self, by: float, dim: int) -> "Plan":
        """That of a lattice with `by` times the cells along every axis, scaled."""
        much = by**dim
        return Plan(self.particles * much, self.pairs * much, self.steps * by, self.right_hand_sides * by)


def plan(scene: Scene) -> Plan:
    """The plan of a scene. Raises what `wsph.compose` raises."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the run itself gives them
        made = compose(scene)
    each = integrators.evaluations(made.bodies[0].integrator)
    return Plan(made.particles, made.pairs, made.steps, made.steps * each)


class Costs:
    """Plans of the lattices of a scene, each made once."""

    def __init__(self, lattices: Lattices):
        self._lattices = lattices
        self._dim = lattices.scene.dim
        self._known: dict[int, Plan] = {}

    def plan(self, cells: int) -> Plan:
        """The plan of a lattice: exact up to LARGEST particles, scaled beyond. Raises what `wsph.compose` raises."""
        if cells not in self._known:
            largest = max((n for n in self._known if n < cells), default=0)
            known = self._known.get(largest)
            if known is not None and known.particles * (cells / largest) ** self._dim > LARGEST:
                return known.finer(cells / largest, self._dim)
            self._known[cells] = plan(self._lattices.scene_at(cells))
        return self._known[cells]


class Rate:
    """Seconds of runs, learned from rows: those of the set-up, in proportion to the particles, and those of the steps,
    a steps + b work."""

    def __init__(self) -> None:
        self._rows: list[Took] = []

    @property
    def more(self) -> float:
        """Work of the last run as a multiple of its plan."""
        return max((row.work / row.plan.work for row in self._rows[-1:]), default=1.0)

    def learn(self, row: "Took") -> None:
        """Note what a run took."""
        self._rows.append(row)

    def seconds(self, asked: Plan) -> float:
        """What a run will take [s], not a number before the first. From one row all seconds of steps are taken to go with
        the work, three times too long perhaps."""
        if not self._rows:
            return math.nan
        a, b = self._rates()
        set_up = min(row.set_up * max(asked.particles / row.plan.particles, 1.0) for row in self._rows)
        return set_up + self.more * (a * asked.steps + b * asked.work)

    def _rates(self) -> tuple[float, float]:
        """Seconds of a step, and of a pair visit, by the last two rows, neither below zero."""
        last = self._rows[-1]
        alone = (0.0, last.inside / last.work)
        if len(self._rows) < 2:
            return alone
        before = self._rows[-2]
        matrix = np.array([[row.plan.steps * row.work / row.plan.work, row.work] for row in (before, last)])
        if abs(np.linalg.det(matrix / matrix.max(0))) < 1e-3:
            return alone
        a, b = np.linalg.solve(matrix, [before.inside, last.inside]).tolist()
        if b <= 0.0:
            return (0.0, last.inside / last.work)
        return (a, b) if a > 0.0 else alone


@dataclass(frozen=True)
class Took:
    """What a run took beside its `plan`: `work`, and seconds `inside` of its steps and around them, its `set_up`."""

    plan: Plan
    work: float
    inside: float
    set_up: float
