"""A fixed rigid plane that bodies cannot pass, as an interaction: particles beyond it are pushed back by a penalty.

With x the place of a particle, p a point of the plane, n its normal and d = (p - x).n > 0 the depth of what is beyond it

    f = K d n,    K = stiffness M h^(dim - 2)

M the wave modulus rho c^2 of the body and h its spacing: with a stiffness of 1 the plane gives way as a cell of the body
does. Half of an impulse v += dt/2 f/m before a step and half after it, as of contact between balls
(`wsph.contact.pinball.contacts`): of second order, with the energy K d^2/2 that it stores in the ledger's column
`contact_stored`, and what the bodies gave beside that in `contact_numerical`. It adds K/m to the squares of the body's
frequencies. The plane takes momentum, has no friction and is not part of a scene: its maker is given to the table with its
numbers.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import total
from wsph.backend.space import Space
from wsph.contact.between import PushedBody
from wsph.contact.pinball.bodies import ContactBody
from wsph.contact.pinball.law import body_struct
from wsph.errors import Refused
from wsph.plugins.integrators import publishes
from wsph.protocols import Entry
from wsph.scene.scene import Scene
from wsph.units import Scales


@cache
def _push_kernel(space: Space) -> wp.Kernel:
    real, vec, Body = space.scalar, space.vec, body_struct(space)

    @kernel(ranged=True)
    def push(
        first: int,
        body: Body,
        stiffness: real,
        normal: vec,
        force_out: wp.array(dtype=vec),
        stored_out: wp.array(dtype=wp.float64),
    ):
        i = first + wp.tid()
        # Places are about a point of the plane.
        depth = -wp.dot(body.x[i] + body.u[i], normal)
        if depth <= real(0.0):
            depth = real(0.0)
        force_out[i] = force_out[i] + (stiffness * depth) * normal
        stored_out[i] = wp.float64(real(0.5) * stiffness * depth * depth)

    return push


class RigidPlane:
    """A plane through `point` [m] that keeps all bodies on the side that `normal` points to."""

    follows = False

    def __init__(
        self,
        point: Sequence[float],
        normal: Sequence[float],
        stiffness: float,
        bodies: Sequence[PushedBody],
        space: Space,
        scales: Scales,
        clock: Clock,
    ):
        self._space, self._clock = space, clock
        self._normal = space.vec(*(np.array(normal) / np.linalg.norm(normal)))
        for run in bodies:
            if not run.system.traits.pushable or publishes(run.integrator):
                raise Refused(
                    f"body {run.body.name!r}: a rigid plane changes velocities between steps: use an integrator of one set that"
                    " goes on from them, such as leapfrog"
                )
        self._sides = [ContactBody(run, np.array(point), space, scales, clock) for run in bodies]
        self._stiffness = {
            side.name: stiffness * _modulus(side) * side.spacing ** (space.dim - 2) for side in self._sides
        }
        self._stored = [wp.zeros(side.count, dtype=wp.float64, device=clock.device) for side in self._sides]
        self.ledger = (
            Entry("contact_stored", lambda: self.stored),
            Entry("contact_numerical", lambda: sum(side.energy for side in self._sides) - self.stored),
            Entry("external_work", lambda: sum(side.held_work for side in self._sides)),
        )

    @property
    def stored(self) -> float:
        """The energy that it stores, nondimensional."""
        return sum(total(each, WHOLE) for each in self._stored)

    def start(self) -> None:
        """The forces where the bodies are (a launch a body)."""
        for side, stored in zip(self._sides, self._stored, strict=True):
            inputs = [side.struct, self._space.scalar(self._stiffness[side.name]), self._normal]
            self._clock.launch(_push_kernel(self._space), side.count, inputs, [side.force, stored])

    def begin(self) -> None:
        """Half of the impulses, before a step (a launch a body)."""
        for side in self._sides:
            side.kick(opens=True)

    def act(self) -> None:
        """The other half, after it (two launches a body)."""
        self.start()
        for side in self._sides:
            side.kick(opens=False)

    def frequency(self, body: str) -> float:
        """That of the lightest particle against the plane, nondimensional."""
        side = next(side for side in self._sides if side.name == body)
        return float(np.sqrt(self._stiffness[body] / (side.system.density * side.system.volume.min())))

    def follow(self) -> bool:
        """Nothing to bring up to date: it does not move, and every particle is looked at."""
        return False

    def kept(self) -> dict[str, wp.array]:
        """The forces and the works so far."""
        sides = zip(self._sides, self._stored, strict=True)
        kept = [(side.name, {**side.kept(), "stored": stored}) for side, stored in sides]
        return {f"rigid_plane.{name}.{key}": each for name, arrays in kept for key, each in arrays.items()}

    def shares(self) -> dict[str, Share]:
        """Its bodies are whole."""
        return {}

    def restored(self) -> None:
        """Nothing follows from the works."""


def _modulus(side: ContactBody) -> float:
    """The wave modulus of a body, nondimensional."""
    return side.system.density * (side.system.constitutive.wave_speed / side.system.scales.velocity) ** 2


def rigid_plane(
    scene: Scene,
    bodies: Sequence[PushedBody],
    space: Space,
    scales: Scales,
    clock: Clock,
    *,
    point: Sequence[float],
    normal: Sequence[float],
    stiffness: float = 1.0,
) -> RigidPlane:
    """Its maker: with `functools.partial` and the plane's numbers a line of `wsph.contact.table.INTERACTIONS`."""
    return RigidPlane(point, normal, stiffness, bodies, space, scales, clock)
