"""Bodies as contacts between balls see them."""

# pyright: strict
# pyright: reportUnknownMemberType=false

from dataclasses import dataclass
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import host
from wsph.backend.clock import Clock
from wsph.backend.domain import Share
from wsph.backend.space import Array, Space
from wsph.contact.between import PushedBody
from wsph.contact.pinball.everyone import Everyone
from wsph.contact.pinball.law import ContactLaw, body_struct, kick_kernel
from wsph.contact.pinball.shared import SharedEveryone
from wsph.contact.touched import TouchedSystem
from wsph.scene.touch.contact import Contact
from wsph.sph.pairs import Pairs
from wsph.sph.skin import Skin
from wsph.units import Scales

KEPT = ("force", "taken", "held")
"""What a run goes on from, of every body."""


def pushed(run: PushedBody) -> TouchedSystem:
    """The system of a body whose traits say that it is pushable."""
    return cast(TouchedSystem, run.system)


class ContactBody:
    """A body as contacts see it, nondimensional: its n particles, and the forces on them. `struct` goes to the kernels.

    spacing  # of its lattice
    everyone # its particles, those of other processes too
    place    # their places at the start about an origin that all bodies share, on the host
    u, v     # displacements and velocities, those of its state, (n,) vec
    volume   # (n,) scalar
    force    # of the contacts where the particles are, zero inside of a step, (n,) vec
    taken    # energy that they have taken so far, (n,) float64
    held     # work of prescribed motion against impulses so far, (n,) float64
    free     # 1 along the axes along which the velocity is not prescribed, else 0, (n,) vec
    """

    def __init__(
        self,
        run: PushedBody,
        origin: np.ndarray,
        space: Space,
        scales: Scales,
        clock: Clock,
    ):
        system, device = pushed(run), clock.device
        self.system, self.name, self.count = system, run.body.name, system.count
        self.spacing = system.spacing / scales.length
        place = (system.position - origin) / scales.length
        self.u, self.v = system.state.struct.displacement, system.state.struct.velocity
        self.volume: Array = wp.array(system.volume, dtype=space.scalar, device=device)
        self.force: Array = wp.zeros(self.count, dtype=space.vec, device=device)
        self.taken: Array = wp.zeros(self.count, dtype=wp.float64, device=device)
        self.held: Array = wp.zeros(self.count, dtype=wp.float64, device=device)
        free = system.free_components.reshape(-1, space.dim).astype(space.numpy)
        self.free: Array = wp.array(free, dtype=space.vec, device=device)
        self.skin = Skin(space, self.count, clock, system.domain, system.share.own)
        self.struct = body_struct(space)()
        self.struct.x = wp.array(place, dtype=space.vec, device=device)
        self.struct.u, self.struct.v, self.struct.volume = self.u, self.v, self.volume
        shared = system.domain.size > 1
        self.everyone = SharedEveryone(self.struct, system, space, clock) if shared else Everyone(self.struct)
        self.place = self.everyone.rows(place)
        self._clock, self._kicks = clock, [kick_kernel(space, opens) for opens in (False, True)]
        self._density = space.scalar(system.density)

    def kick(self, *, opens: bool) -> None:
        """Change the velocities by half of the impulse of the forces (a launch), before a step (`opens`) or after it."""
        inputs = [self.volume, self.free, self._density, self._clock.time]
        outputs = [self.force, self.v, self.taken, self.held]
        self._clock.launch(self._kicks[opens], self.count, inputs, outputs)

    @property
    def energy(self) -> float:
        """Energy that the forces have taken so far, nondimensional."""
        return self._total(self.taken)

    @property
    def held_work(self) -> float:
        """Work that prescribed motion has done against the forces so far, nondimensional."""
        return self._total(self.held)

    def _total(self, values: Array) -> float:
        return float(self.everyone.rows(host(values)).sum(dtype=np.float64))

    def kept(self) -> dict[str, Array]:
        """What a run goes on from, by name."""
        return {name: getattr(self, name) for name in KEPT}

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has, where processes share the body."""
        return dict.fromkeys(KEPT, self.system.share) if self.system.domain.size > 1 else {}


@dataclass
class ContactPair:
    """A contact of a scene: two bodies, or one body and itself.

    `laws` are those of `one` pushed by `other` and the reverse; `rows` in the same order (once for a body with itself) the
    candidate pairs and the index of each one's link weight, (pairs,) int32, -1 without a link.
    """

    part: Contact
    one: ContactBody
    other: ContactBody
    laws: tuple[ContactLaw, ContactLaw]
    rows: list[tuple[Pairs, Array]]


def without_neighbours(pairs: Pairs, side: ContactBody, device: str) -> tuple[Pairs, Array]:
    """Candidate pairs of a body with itself, and for each the index of its link's weight, (pairs,) int32, -1 without a link.
    Neighbours in the body stay candidates only where links can break."""
    own = side.system.neighbours
    among, known = side.everyone.here(host(pairs.indices)), own.keys()
    candidates = np.where(among >= 0, pairs.rows().astype(np.int64) * own.sources + among, -1)
    at = np.searchsorted(known, candidates)
    near = known[np.minimum(at, len(known) - 1)] == candidates
    slot = np.where(near, at, -1)
    if side.system.breakable_weights is None:
        pairs, slot = pairs.where(~near), slot[~near]
    return pairs, wp.array(slot, dtype=wp.int32, device=device)
