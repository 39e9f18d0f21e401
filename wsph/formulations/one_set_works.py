"""What is prescribed to a one-set body in a step, and the works of it: constraints, sliding, loads and drag."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Iterable

import numpy as np

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import Domain, Share
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.reactions import Terms
from wsph.boundary.loads.work import LoadWork
from wsph.boundary.slide import slides_of
from wsph.boundary.sliding import Sliding
from wsph.boundary.values import BoundaryValues
from wsph.boundary.work import ConstraintWork, DragWork
from wsph.formulations.one_set_setup import Loads
from wsph.ranks.kept import Piece, Rows
from wsph.units import Scales


class Prescribed:
    """What is prescribed to a body of n particles, of `mass` (n,), nondimensional: velocities, those along faces' own
    normals, and loads; with the work that each has done."""

    def __init__(
        self,
        conditions: Conditions,
        loads: Loads,
        space: Space,
        scales: Scales,
        state: State,
        position: np.ndarray,
        mass: np.ndarray,
        holding: Array | None,
        arrays: Arrays,
        share: Share,
        domain: Domain,
    ):
        """`holding`: forces per mass that hold spurious modes, (n,) vec, where there are any; `share`: the particles whose
        works count."""
        device = arrays.device
        self.values = BoundaryValues(
            space, conditions, state, position, {"velocity": scales.velocity}, scales.time, device
        )
        self.slides = slides_of(conditions.slides, conditions.entries, space.dim, conditions.owners)
        units = (scales.velocity, scales.time)
        self._sliding: Sliding | None = None
        if len(self.slides.particle):
            part = arrays.part("sliding")
            self._sliding = Sliding(self.slides, space, position, mass, units, part, state.layout)
        self._loads = loads
        self._constraint_work = ConstraintWork(space, self.values, mass, device, share, domain)
        forces = loads.forces
        pieces = np.arange(len(forces.particle))
        mine = None if share.complete else share
        self._load_work = LoadWork(forces.particle, pieces, forces.owner, forces.pieces, space, device, mine, domain)
        self.drag = DragWork(space, state, holding, mass, device, share, domain)
        arrays.part("boundary").adopt(self.values)
        arrays.part("motions").adopt(self.values.motions, self.values.motions.kept())
        arrays.part("loads").adopt(loads.forces)
        for name, works in (("work", self._constraint_work), ("loads.work", self._load_work), ("drag.work", self.drag)):
            arrays.part(name).adopt(works, works.kept())

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float], *, counted: bool) -> None:
        """Set the prescribed velocities of a state, and the loads for the rates to come, at t + c dt. `counted`: of the
        state that the run continues from, whose work is counted too."""
        if counted:
            self._constraint_work.before(state, clock)
        self.values.impose(state, clock, c, leads=counted)
        if counted:
            self._constraint_work.after(state, clock, c)
        if self._sliding is not None:
            self._sliding.impose(state, clock, c)
        if self._sliding is not None and counted:
            self._sliding.count_work(state, clock)
        self._loads.impose(clock, c)

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        for each in (self._constraint_work, self._load_work, self.drag):
            each.start(state, clock)
        if self._sliding is not None:
            self._sliding.start(state)
        for load in self._loads.acting:
            load.start(state)

    def close(self, state: State, clock: Clock) -> None:
        """Add the works of a step (launches)."""
        self.values.motions.close(clock)
        self._load_work.add(state, clock)
        self.drag.add(state, clock)
        for load in self._loads.acting:
            load.advance(state)

    def rows(self, share: Share, domain: Domain) -> dict[str, Rows]:
        """Where the rows of its kept arrays stand in those of all processes that share the body, by their names."""
        blocks = Rows.of_blocks(share)
        found = {f"drag.work.{name}": blocks for name in ("_work", "_power")}
        constraints, loads = self._constraint_work.rows(share), self._load_work.rows(share)
        found |= {f"work.{name}": constraints for name in ("_old", "_sums", "_last")}
        found |= {f"loads.work.{name}": loads for name in ("_work", "_before", "_place")}
        moved = self.values.moving(share, domain)
        return found | {f"motions.moves.{name}": moved for name in ("velocity", "displacement")}

    def numbers(self, owner: int) -> list[Terms]:
        """What the boundary of a number does to the body: velocities that it sets, and loads."""
        sliding = [self._sliding.terms(owner)] if self._sliding is not None else []
        acting = [
            each.numbers for each, mine in zip(self._loads.acting, self._loads.owners, strict=True) if mine == owner
        ]
        return [self._constraint_work.terms(owner), *sliding, self._load_work.terms(owner), *acting]

    @property
    def total(self) -> float:
        """Work of constraints and loads so far, nondimensional."""
        sliding = self._sliding.total if self._sliding is not None else 0.0
        return self._constraint_work.total + sliding + self._load_work.total


def pieces_of(
    kept: Iterable[str], state: State, prescribed: Prescribed, shares: tuple[Share, Share], domain: Domain
) -> dict[str, list[Piece]]:
    """Where the kept arrays of a body stand in those of all processes that share it, by their names. `shares`: its
    particles and its points."""
    particles, points = (Rows.of(share) for share in shares)
    fields = [field for field in state.layout.fields if field.name in state.start]
    own = [Piece(state.start[field.name], field.width, points if field.at_points else particles) for field in fields]
    known = prescribed.rows(shares[0], domain)
    known |= {"loads.imposed": particles, "fading.zeta": points, "fading.freed": points}
    known |= {f"drag.work.{name}": particles for name in ("before", "_hold")}
    known |= {"force._place": particles, "force._work": Rows.of_blocks(shares[0])}
    return {name: own if name.startswith("state") else [Piece(0, 0, known[name])] for name in kept}
