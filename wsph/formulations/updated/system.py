"""A body in the current configuration: with walls in place of held faces, and images of its particles behind them."""

# pyright: strict

from wsph.backend.clock import Clock
from wsph.backend.state import Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.reactions import Terms
from wsph.boundary.natural import wall_conditions
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.motions import Motions
from wsph.errors import Refused
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.setup import Setup
from wsph.formulations.updated.loads import spread_loads
from wsph.formulations.updated.parted import PartedSystem
from wsph.formulations.updated.rates import UpdatedRates
from wsph.formulations.updated.wall_forces import WallForces
from wsph.formulations.updated.walls import PLACE, SPEED, wall_fields, wall_values
from wsph.geometry.lattice import Lattice
from wsph.parts.part import Host
from wsph.protocols import Entry


class UpdatedSystem(PartedSystem):
    """A body in the current configuration, as integrators see it. Walls that are driven have their places in its state."""

    listed = "its pairs follow the motion"

    def __init__(self, setup: Setup):
        super().__init__(setup, UpdatedRates)
        self._refuse_accelerated(setup)
        walls, driven = list(self.walls), [wall for wall in self.walls if wall.driven]
        self._driven = wall_values(self.space, driven, self.state, self.position, self.scales, self.device)
        self._wall_work = WallForces(self.share, walls, self.rates, self.space, self.device, self.domain)
        self.arrays.part("walls").adopt(self._driven)
        self.arrays.part("walls.motions").adopt(self._driven.motions, self._driven.motions.kept())
        self.arrays.part("walls.work").adopt(self._wall_work, self._wall_work.kept())

    def _find_conditions(self, setup: Setup) -> Conditions:
        if self.placement.at_nodes or not isinstance(self.geometry, Lattice):
            return super()._find_conditions(setup)
        conditions, walls = wall_conditions(setup.scene, self.name, self.lattice)
        self.walls = tuple(walls)
        spread_loads(conditions, setup.host, walls, self.device)
        return conditions

    def _refuse_accelerated(self, setup: Setup) -> None:
        """Refuse walls that are to go on, accelerated, with a velocity that the body has from the start."""
        given = (value for wall in self.walls for value in wall.velocity.values())
        moving = setup.body.velocity is not None and any(value not in (0.0, "0") for value in setup.body.velocity)
        if moving and any(isinstance(value, Motion) and value.kind == "acceleration" for value in given):
            raise Refused(
                f"body {self.name!r}: its velocity is given at the start, and an acceleration of a face that is a wall here begins"
                ' at rest: prescribe the velocity of that face, or use "stress-points" or "total-lagrangian"'
            )

    def _find_layout(self, host: Host) -> Layout:
        layout, driven = super()._find_layout(host), sum(wall.driven for wall in self.walls)
        if not driven:
            return layout
        self._counts = {PLACE: driven, SPEED: driven}
        speed, place = wall_fields(host.space)
        leading = sum(field.leads for field in layout.fields)
        return Layout((*layout.fields[:leading], speed, *layout.fields[leading:], place))

    @property
    def wall_motions(self) -> Motions:
        return self._driven.motions

    def _set(self, state: State, c: float | tuple[float, float], *, counted: bool) -> None:
        super()._set(state, c, counted=counted)
        self._driven.impose(state, self.clock, c, leads=counted)

    def begin(self) -> None:
        super().begin()
        self._driven.motions.begin(self.state)

    def start_works(self) -> None:
        super().start_works()
        self._walls_done(self.clock, start=True)

    def accept(self, state: State) -> None:
        super().accept(state)
        self._driven.motions.lead(state, self.clock)
        self._walls_done(self.clock)

    def close(self) -> None:
        self._driven.motions.close(self.clock)
        super().close()

    def _walls_done(self, clock: Clock, start: bool = False) -> None:
        """Add the work of the walls up to the state as it is."""
        if self._counts:
            self.refresh(self.state)
            (self._wall_work.start if start else self._wall_work.add)(self.state, clock)

    def does(self, boundary: int) -> list[Terms]:
        return [*super().does(boundary), self._wall_work.terms(boundary)]

    def gather(self) -> None:
        self._wall_work.gather(self.state, self.clock)

    @property
    def ledger(self) -> tuple[Entry, ...]:
        return (Entry("external_work", lambda: self._wall_work.total), *super().ledger)


def build(setup: Setup) -> OneSetSystem:
    """A body in the current configuration."""
    return UpdatedSystem(setup)
