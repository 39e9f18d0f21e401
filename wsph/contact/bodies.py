"""Bodies as contacts see them."""

# pyright: strict
# pyright: reportUnknownMemberType=false

from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.contact.law import ContactLaw, body_struct
from wsph.protocols import PushedBody
from wsph.scene.tables import Contact
from wsph.sph.pairs import Pairs
from wsph.sph.skin import Skin
from wsph.units import Scales


class PushedSystem(Protocol):
    """The system of a body whose formulation is `pushable`. Nondimensional but for `position` and `spacing` [m]."""

    @property
    def constitutive(self) -> Constitutive: ...

    @property
    def scales(self) -> Scales: ...

    @property
    def spacing(self) -> float: ...

    @property
    def count(self) -> int: ...

    @property
    def position(self) -> np.ndarray: ...

    @property
    def volume(self) -> np.ndarray: ...

    @property
    def density(self) -> float: ...

    @property
    def state(self) -> State: ...

    @property
    def free_components(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        ...

    @property
    def neighbours(self) -> Pairs:
        """The particles that each is joined to."""
        ...

    @property
    def breakable_weights(self) -> Array | None:
        """Weights of the `neighbours`, zero where a pair has broken; None where none can."""
        ...

    @property
    def drags(self) -> bool:
        """Whether there are forces that depend on velocities, beside damping in proportion to mass."""
        ...

    @property
    def started_from(self) -> Array:
        """Velocities that the work of drag in a step is measured from, (n,) vec: what changes velocities between steps sets
        them too."""
        ...


def pushed(run: PushedBody) -> PushedSystem:
    """The system of a body whose traits say that it is pushable."""
    return cast(PushedSystem, run.system)


class Side:
    """A body as contacts see it: where its particles are and what they are pushed by. `struct` goes to the kernels."""

    def __init__(self, run: PushedBody, origin: np.ndarray, space: Space, scales: Scales, clock: Clock, domain: Domain):
        system, device = pushed(run), clock.device
        self.system, self.name, self.count = system, run.body.name, system.count
        self.spacing = system.spacing / scales.length
        self.place = (system.position - origin) / scales.length
        self.u, self.v = system.state.struct.displacement, system.state.struct.velocity
        self.volume: Array = wp.array(system.volume, dtype=space.scalar, device=device)
        self.impulse: Array = wp.zeros(self.count, dtype=space.vec, device=device)
        self.work: Array = wp.zeros(self.count, dtype=wp.float64, device=device)
        self.held: Array = wp.zeros(self.count, dtype=wp.float64, device=device)
        self.free: Array = wp.array(system.free_components.reshape(-1, space.dim), dtype=space.vec, device=device)
        self.skin = Skin(space, self.count, clock, domain)
        self.struct = body_struct(space)()
        self.struct.x = wp.array(self.place, dtype=space.vec, device=device)
        self.struct.u, self.struct.v, self.struct.volume = self.u, self.v, self.volume


@dataclass
class Meeting:
    """A contact of a scene: both directions of one pair of bodies, or one body and itself."""

    part: Contact
    one: Side
    other: Side
    laws: tuple[ContactLaw, ContactLaw]
    rows: list[tuple[Pairs, Array]]


def without_neighbours(pairs: Pairs, side: Side, device: str) -> tuple[Pairs, Array]:
    """Candidates of a body with itself: where links can break a particle's own neighbours stay, with the place of their
    weight beside them (-1 for others); elsewhere they go."""
    own = side.system.neighbours
    candidates, known = pairs.keys(), own.keys()
    at = np.searchsorted(known, candidates)
    near = known[np.minimum(at, len(known) - 1)] == candidates
    slot = np.where(near, at, -1)
    if side.system.breakable_weights is None:
        pairs, slot = pairs.where(~near), slot[~near]
    return pairs, wp.array(slot, dtype=wp.int32, device=device)
