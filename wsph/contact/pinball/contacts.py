"""Contact between balls: particles push each other apart where they are nearer than their radii.

Every particle is a ball of radius R = `radius` spacings. With delta = R_i + R_j - |x_ij| > 0, n from j to i, along n, while
the balls approach (pinball contact, Belytschko & Neal 1991; Islam & Peng 2019, eqs 31-35):

    f = K_s min(F1, F2)
    F1 = m d(delta)/dt / dt with m the reduced mass, which stops them within a step
    F2 = G delta in 2D (per depth) and 1D, G sqrt(R) delta^(3/2) in 3D, G = G_i G_j/(G_i + G_j), R = R_i R_j/(R_i + R_j)

`friction` mu adds min(mu f, what stops the sliding) against the tangential velocity. Forces are gathers over candidate
pairs; both ends compute the same number with the other sign, so linear momentum is kept to rounding, and angular momentum
where there is no friction. None of them gives energy back.

A step of the bodies stands between two halves of an impulse, v += dt/2 f/m, with the forces of the positions there: with a
method of second order or higher that is Strang's splitting, of second order. Between two steps, where states are read and
works are summed, velocities so are those of the instant: at rest they are zero, and every entry of the ledger stands still.
The entry `contact_dissipated` is what the forces have taken, from the change of the velocities. Candidates are all pairs
within the radii and a skin, found again before a particle can leave it.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Sequence
from functools import partial
from itertools import chain

import numpy as np
import warp as wp

from wsph.backend.arrays import host
from wsph.backend.clock import Clock
from wsph.backend.domain import Share
from wsph.backend.space import Array, Space
from wsph.contact.between import PushedBody
from wsph.contact.pinball.bodies import ContactBody, ContactPair, pushed, without_neighbours
from wsph.contact.pinball.law import ContactLaw, law_struct, push_kernel
from wsph.errors import Refused
from wsph.plugins.integrators import publishes
from wsph.protocols import Entry
from wsph.ranks.blocks import own_mean
from wsph.scene.touch.contact import Contact
from wsph.sph.pairs import Pairs
from wsph.sph.rows import rows_of
from wsph.units import Scales

SKIN = 0.6
"""Distance beyond the radii within which candidates are found, in the larger spacing."""


class Contacts:
    """All contacts between balls of a composition, as one interaction."""

    follows: bool = True

    def __init__(
        self,
        parts: tuple[Contact, ...],
        bodies: Sequence[PushedBody],
        space: Space,
        scales: Scales,
        clock: Clock,
        device: str,
    ):
        self.ledger: tuple[Entry, ...] = (
            Entry("contact_dissipated", lambda: self.energy),
            Entry("external_work", lambda: self.held_work),
        )
        self._space, self._clock, self._device = space, clock, device
        named = {run.body.name: run for run in bodies}
        taking_part = dict.fromkeys(chain.from_iterable(part.names for part in parts))
        for name in taking_part:
            _refuse(named[name])
        systems = [pushed(named[name]) for name in taking_part]
        origin = np.mean([own_mean(each.position, each.share, each.domain) for each in systems], axis=0)
        self.sides = {name: ContactBody(named[name], origin, space, scales, clock) for name in taking_part}
        self._no_slot: Array = wp.zeros(1, dtype=wp.int32, device=device)
        self._no_weight: Array = wp.zeros(1, dtype=space.scalar, device=device)
        self._contacts: list[ContactPair] = []
        for part in parts:
            one, other = self.sides[part.names[0]], self.sides[part.names[-1]]
            laws = self._law(part, one, other), self._law(part, other, one)
            self._contacts.append(ContactPair(part, one, other, laws, []))
        self._skin = SKIN * max(side.spacing for side in self.sides.values())
        self._refuse_overlap(self._find())

    def _law(self, part: Contact, one: ContactBody, other: ContactBody) -> ContactLaw:
        space, real = self._space, self._space.scalar
        radii = part.radius * one.spacing, part.radius * other.spacing
        laws = [side.system.constitutive for side in (one, other)]
        shear = [c.material.moduli()[1] / one.system.scales.stress for c in laws]
        law: ContactLaw = law_struct(space)()
        law.reach = real(sum(radii))
        law.friction = real(part.friction)
        law.shear = real(shear[0] * shear[1] / (shear[0] + shear[1]))
        law.curvature = real(np.sqrt(radii[0] * radii[1] / sum(radii)))
        law.own_density, law.other_density = real(laws[0].density), real(laws[1].density)
        law.stiffness = real(part.number or 1.0)
        return law

    def frequency(self, body: str) -> float:
        """A bound of the frequency that contacts add to a body's, nondimensional: by 2^(dim - 1) contacts a particle."""
        square = 0.0
        for contact in self._contacts:
            for law, side, other in zip(
                contact.laws, (contact.one, contact.other), (contact.other, contact.one), strict=True
            ):
                if side.name == body:
                    inverse = 1.0 / (float(law.own_density) * side.everyone.smallest(side.system.volume))
                    inverse += 1.0 / (float(law.other_density) * other.everyone.smallest(other.system.volume))
                    stiffness = float(law.stiffness) * float(law.shear)
                    if self._space.dim == 3:
                        stiffness *= float(law.curvature) * float(law.reach) ** 0.5
                    square = max(square, 2.0 ** (self._space.dim - 1) * stiffness * inverse)
        return float(np.sqrt(square))

    def _find(self) -> dict[str, np.ndarray]:
        """Find the candidates where the particles are; places of every body, nondimensional."""
        where: dict[str, np.ndarray] = {}
        for name, side in self.sides.items():
            u = side.u.numpy()
            side.skin.found.assign(u)
            where[name] = side.place + side.everyone.rows(u).astype(float)
        for contact in self._contacts:
            reach = float(contact.laws[0].reach) + self._skin
            one, other = contact.one, contact.other
            if one is other:
                contact.rows = [without_neighbours(self._pairs(one, one, where, reach), one, self._device)]
            else:
                ways = ((one, other), (other, one))
                contact.rows = [(self._pairs(a, b, where, reach), self._no_slot) for a, b in ways]
        return where

    def _pairs(self, side: ContactBody, against: ContactBody, where: dict[str, np.ndarray], reach: float) -> Pairs:
        """The candidates of a body's particles among those of another one, or of itself."""
        own, other = where[side.name], where[against.name]
        return side.everyone.near(own, other, reach, self._device, same=side is against)

    def _refuse_overlap(self, where: dict[str, np.ndarray]) -> None:
        """Refuse particles that overlap from the start: two at one place have no direction to be pushed in."""
        for contact in self._contacts:
            one, other, pairs = contact.one, contact.other, contact.rows[0][0]
            partners = host(pairs.indices)
            r = where[one.name][one.everyone.numbers(pairs.rows())] - where[other.name][partners]
            apart = np.linalg.norm(r, axis=1)
            if one is other:
                apart = np.where(contact.rows[0][1].numpy() >= 0, np.inf, apart)
            least = float(apart.min()) if len(apart) else np.inf
            if words := one.everyone.told(partial(_overlap, contact, apart, least), least):
                raise Refused(words)

    def follow(self) -> bool:
        """Before a step: find the candidates again if a particle can leave its skin by the end of it."""
        if not any(side.skin.has_left(side.u, side.v, self._skin) for side in self.sides.values()):
            return False
        self._find()
        return True

    def start(self) -> None:
        """Find the forces at the start (launches)."""
        for side in self.sides.values():
            side.everyone.bring()
        for contact in self._contacts:
            one, other, part = contact.one, contact.other, contact.part
            push = push_kernel(self._space, part.friction > 0.0, one is other)
            ways = ((one, other), (other, one)) if one is not other else ((one, one),)
            for (side, against), law, (pairs, slot) in zip(ways, contact.laws, contact.rows, strict=False):
                weight = side.system.breakable_weights if one is other else None
                weight = weight if weight is not None else self._no_weight
                rows = rows_of(self._space, pairs)
                inputs = [law, rows, side.struct, against.everyone.struct, self._clock.time, slot, weight]
                self._clock.launch(push, side.count, inputs, [side.force])
        for side in self.sides.values():
            side.everyone.spread(side.force)

    def begin(self) -> None:
        """The first half of the impulses of a step, of the forces that stand (launches)."""
        for side in self.sides.values():
            side.kick(opens=True)

    def act(self) -> None:
        """The forces where the bodies are now, and the second half of the impulses (launches)."""
        self.start()
        for side in self.sides.values():
            side.kick(opens=False)

    @property
    def energy(self) -> float:
        """Energy that contacts have taken from the bodies so far, nondimensional."""
        return sum(side.energy for side in self.sides.values())

    @property
    def held_work(self) -> float:
        """Work that prescribed motion has done against contacts so far, nondimensional."""
        return sum(side.held_work for side in self.sides.values())

    def kept(self) -> dict[str, Array]:
        """Forces and works so far, by name: what a checkpoint holds of the contacts."""
        sides = self.sides.items()
        return {f"contact.{name}.{key}": array for name, side in sides for key, array in side.kept().items()}

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has, of bodies that processes share."""
        sides = self.sides.items()
        return {f"contact.{name}.{key}": share for name, side in sides for key, share in side.shares().items()}

    def restored(self) -> None:
        """Find the candidates of a state that has been put back."""
        self._find()


def _overlap(contact: ContactPair, apart: np.ndarray, least: float) -> str | None:
    """What is wrong with the nearest of the candidates, which are so far `apart` (pairs,); None where nothing is."""
    reach, system = float(contact.laws[0].reach), contact.one.system
    if not least < 0.5 * reach:
        return None
    length, i = system.scales.length, contact.rows[0][0].rows()[apart.argmin()]
    return (
        f"contact of {contact.one.name!r} with {contact.other.name!r}: particles lie {least * length:g} m apart at"
        f" {system.position[i].tolist()} m, within half of the {reach * length:g} m of the two radii, before the run begins:"
        " leave a gap (the sides of a crack between stress points lie on each other), or lower contact.radius"
    )


def _refuse(run: PushedBody) -> None:
    """Refuse bodies whose velocities nothing may change between steps."""
    if publishes(run.integrator):
        raise Refused(
            f"body {run.body.name!r}: contact changes velocities between steps; {type(run.integrator).__name__} keeps variables of"
            " its own there: use leapfrog"
        )
