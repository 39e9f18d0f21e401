"""What a run will cost, before it runs: pair visits, the pairs of all operators times the right-hand sides.

A scene is set up for it, and nothing of its step is compiled: its pairs, its time step and the right-hand sides of its
integrator are then what the run itself will have. That takes some hundredths of a second, and seconds where cells are fitted
to a surface: what was set up last is kept for its run. Beyond LARGEST cells it is scaled from a smaller lattice. Steps that
shrink with the deformation are more than were planned, which is said before the first row: `wsph.accuracy.planning.rate`
learns by how much, and what setting up and a visit take in seconds, from the rows that were run.
"""

# pyright: strict

import time
import warnings
from dataclasses import dataclass, replace

from wsph.accuracy.planning.lattices import Lattices
from wsph.accuracy.planning.shrinking import shrinks
from wsph.scene.scene import Scene
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition

LARGEST = 2e5
"""Particles up to which a scene is set up to know its work."""


@dataclass(frozen=True)
class Plan:
    """What a run will take: `particles`, `pairs`, `steps` and `right_hand_sides`; its largest Courant number; why its steps
    may get shorter (`shrinks`, empty where they do not)."""

    particles: float
    pairs: float
    steps: float
    right_hand_sides: float
    courant: float
    shrinks: str = ""

    @property
    def work(self) -> float:
        """Pair visits."""
        return self.pairs * self.right_hand_sides

    def finer(self, by: float, dim: int) -> "Plan":
        """That of a lattice with `by` times the cells along every axis, scaled."""
        much = by**dim
        found = replace(self, particles=self.particles * much, pairs=self.pairs * much)
        return found.longer(by)

    def longer(self, by: float) -> "Plan":
        """The same in `by` times the steps."""
        return replace(self, steps=self.steps * by, right_hand_sides=self.right_hand_sides * by)


def plan(scene: Scene) -> Plan:
    """The plan of a scene. Raises what `wsph.compose` raises."""
    return plan_of(composed(scene))


def composed(scene: Scene) -> Composition:
    """A scene made ready, for its plan and its run, which says what there is to warn of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return compose(scene)


def plan_of(made: Composition) -> Plan:
    """The plan of a scene that is made ready."""
    courant = max(run.courant for run in made.bodies)
    return Plan(made.particles, made.pairs, made.steps, made.steps * made.evaluations, courant, shrinks(made))


class Costs:
    """Plans of the lattices of a scene, each made once; `taken`: the seconds that setting up for it took, by cells. What
    was set up last is kept for its run (`keep`), or is not where another process runs it."""

    def __init__(self, lattices: Lattices, keep: bool = True):
        self._lattices, self._keep = lattices, keep
        self._dim = lattices.scene.dim
        self._known: dict[int, Plan] = {}
        self.taken: dict[int, float] = {}
        self._ready: dict[int, Composition] = {}

    def plan(self, cells: int) -> Plan:
        """The plan of a lattice: exact up to LARGEST particles, scaled beyond. Raises what `wsph.compose` raises."""
        if cells not in self._known:
            largest = max((n for n in self._known if n < cells), default=0)
            known = self._known.get(largest)
            if known is not None and known.particles * (cells / largest) ** self._dim > LARGEST:
                return known.finer(cells / largest, self._dim)
            self._ready.clear()
            begun = time.perf_counter()
            made = composed(self._lattices.scene_at(cells))
            self._known[cells], self.taken[cells] = plan_of(made), time.perf_counter() - begun
            if self._keep:
                self._ready[cells] = made
        return self._known[cells]

    def holds(self, cells: int) -> bool:
        """Whether a lattice is set up, for its run."""
        return cells in self._ready

    def ready(self, cells: int) -> Composition | None:
        """What was set up last, for its run, where it is that of a lattice; None a second time."""
        return self._ready.pop(cells, None)
