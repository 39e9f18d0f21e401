"""What is prescribed to a one-set body in a step, and the works of it: constraints, sliding, loads and drag."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager

import numpy as np

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import Domain, Share, any_of
from wsph.backend.space import Array, Space
from wsph.backend.state import Field, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.carried import Carried, Forms
from wsph.boundary.loads.reactions import Terms
from wsph.boundary.loads.work import LoadWork
from wsph.boundary.slide import slides_of
from wsph.boundary.sliding import Sliding
from wsph.boundary.values import BoundaryValues
from wsph.boundary.work import ConstraintWork, DragWork
from wsph.formulations.one_set_setup import Loads, Placement
from wsph.parts.part import Attached
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
        self._forms: Forms | None = None
        self._some = any_of(domain, bool(conditions.entries))
        self._carried: list[Carried] = []
        self._space, self._state, self._arrays = space, state, arrays.part("carried")
        self.values = BoundaryValues(
            space,
            conditions,
            state,
            position,
            {"velocity": scales.velocity},
            scales.time,
            device,
            domain=domain,
        )
        self.slides = slides_of(conditions.slides, conditions.entries, space.dim, conditions.owners)
        units = (scales.velocity, scales.time)
        self._sliding: Sliding | None = None
        if any_of(domain, len(self.slides.particle) > 0):
            part = arrays.part("sliding")
            self._sliding = Sliding(self.slides, space, position, mass, units, part, state.layout, share, domain)
        self._loads, self._acting = loads, conditions.acting
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
        if self._forms is not None:
            self._forms.set(state, counted)
        if counted:
            self._constraint_work.before(state, clock)
        with self._changing(0, state, clock) as carried:
            self.values.impose(state, clock, c, leads=counted)
        if counted:
            if carried is not None:
                self._constraint_work.settled(state, carried, clock)
            self._constraint_work.after(state, clock, c)
        if self._sliding is not None:
            with self._changing(1, state, clock) as carried:
                self._sliding.impose(state, clock, c)
            if counted and carried is not None:
                self._sliding.settled(state, carried, clock)
            if counted:
                self._sliding.count_work(state, clock)
        self._loads.impose(clock, c)

    @contextmanager
    def _changing(self, kind: int, state: State, clock: Clock) -> Generator[Carried | None]:
        """Values of a kind are set in a state: what a method that hands it on carries of it."""
        carried = self._carried[kind] if self._carried else None
        if carried is not None:
            carried.changes(state, -1.0, clock)
        yield carried
        if carried is not None:
            carried.changes(state, 1.0, clock)

    def combined(self, out: State, plain: list[tuple[float, State]], clock: Clock) -> None:
        """The velocity of `out` is a sum of states, and of rates (launches, where what was set is handed on)."""
        if len(plain) == 1 and plain[0][0] == 1.0 and plain[0][1] is out:
            return
        if self._forms is not None:
            self._forms.combined(out, plain)
        for each in self._carried:
            each.combined(out, plain, clock)

    def watch(self) -> None:
        """Find out, from steps that are listed until `watched`, whether the method hands on what was set."""
        if (self._some or self._sliding is not None) and not self._carried:
            self._forms = Forms()

    def watched(self) -> bool:
        """Have what was set carried, where the method hands it on; whether it does."""
        if self._forms is not None and self._forms.found:
            kinds = ("values", "slides")[: 1 if self._sliding is None else 2]
            self._carried = [Carried(self._space, self._state, self._arrays.part(kind)) for kind in kinds]
        self._forms = None
        return bool(self._carried)

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        for each in (self._constraint_work, self._load_work, self.drag):
            each.start(state, clock)
        for each in self._carried:
            each.start()
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
        # Where nothing of the whole body is loaded there is a row that stands for none.
        count = len(self._loads.vectors)
        found["loads.imposed"] = Rows.of(share) if count == share.held else Rows.alike(count, domain)
        for (name, _, _), load in zip(self._acting, self._loads.acting, strict=True):
            found |= {f"loads.{name}.{of}": rows for of, rows in load.rows().items()}
        if self._sliding is not None:
            found |= {f"sliding.{of}": rows for of, rows in self._sliding.rows(Rows.of(share)).items()}
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
    kept: Iterable[str],
    state: State,
    prescribed: Prescribed,
    placement: Placement,
    domain: Domain,
    attached: Mapping[str, Attached],
    more: Mapping[str, Rows] | None = None,
) -> dict[str, list[Piece]]:
    """Where the kept arrays of a body stand in those of all processes that share it, by their names. `placement`: its
    particles and its points; `attached`: its parts; `more` that it keeps."""
    shares = placement.share, placement.point_share
    particles, points = (Rows.of(share) for share in shares)

    def rows(field: Field) -> Rows:
        share, of = (shares[1], points) if field.at_points else (shares[0], particles)
        count = state.counts[field.name]
        return of if count == share.held else Rows.alike(count, domain)

    fields = [field for field in state.layout.fields if field.name in state.start]
    own = [Piece(state.start[field.name], field.width, rows(field)) for field in fields]
    known = prescribed.rows(shares[0], domain) | dict(more or {})
    known |= {f"{key}.{name}": rows for key, part in attached.items() for name, rows in part.rows().items()}
    known |= {"fading.zeta": points, "fading.freed": points}
    known |= {f"drag.work.{name}": particles for name in ("before", "_hold")}
    known |= {"force._place": particles, "force._work": Rows.of_blocks(shares[0])}
    leading = [piece for field, piece in zip(fields, own, strict=True) if field.leads]
    found: dict[str, list[Piece]] = {}
    for name in kept:
        flat = own if name.startswith("state") else leading if name.startswith("carried") else []
        found[name] = flat or [Piece(0, 0, known[name])]
    return found
