"""A spring between the ends of two bars, as a coupling: what forces between bodies look like to integrators.

The last particle of the first and the first particle of the second are pulled together by f = k (u_2 - u_1), which stores
k (u_2 - u_1)^2/2.
"""

from collections.abc import Mapping, Sequence
from functools import cache

import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.contact.between import CoupledBody
from wsph.protocols import Entry
from wsph.reporting import Reported
from wsph.scene.scene import Scene
from wsph.units import Scales


@cache
def _pull_kernel(space: Space, one: Layout, two: Layout) -> wp.Kernel:
    real, One, Two = space.scalar, fields_struct(space, one), fields_struct(space, two)

    @kernel()
    def pull(
        last: int, stiffness: real, first_mass: real, second_mass: real, first: One, second: Two,
        stored_out: wp.array(dtype=wp.float64), first_out: One, second_out: Two,
    ):  # fmt: skip
        apart = second.displacement[0] - first.displacement[last]
        first_out.velocity[last] = first_out.velocity[last] + (stiffness / first_mass) * apart
        second_out.velocity[0] = second_out.velocity[0] - (stiffness / second_mass) * apart
        stored_out[0] = wp.float64(real(0.5) * stiffness * wp.dot(apart, apart))

    return pull


class Bond:
    """The spring, of `stiffness` in rho c^2 over a spacing of the first body."""

    def __init__(self, stiffness: float, bodies: Sequence[CoupledBody], space: Space, clock: Clock):
        self._bodies, self._space, self._clock, self._stiffness = bodies[:2], space, clock, stiffness
        self._stored = wp.zeros(1, dtype=wp.float64, device=clock.device)
        self._masses = [
            float(b.system.density * b.system.volume[k]) for b, k in zip(self._bodies, (-1, 0), strict=True)
        ]
        self.ledger = (Entry("strain", lambda: float(self._stored.numpy()[0])),)

    def bodies(self) -> tuple[str, ...]:
        return tuple(each.body.name for each in self._bodies)

    def members(self) -> Mapping[str, object]:
        return {}

    @property
    def reported(self) -> tuple[Reported, ...]:
        return ()

    def fields(self, body: str) -> Mapping[str, object]:
        return {}

    def follow(self) -> bool:
        return False

    def start(self, states: Mapping[str, State]) -> None:
        pass

    def push(self, states: Mapping[str, State], rates: Mapping[str, State]) -> None:
        one, two = self.bodies()
        made = _pull_kernel(self._space, states[one].layout, states[two].layout)
        real = self._space.scalar
        inputs = [self._bodies[0].system.count - 1, real(self._stiffness), *map(real, self._masses)]
        inputs += [states[one].struct, states[two].struct]
        self._clock.launch(made, 1, inputs, [self._stored, rates[one].struct, rates[two].struct])

    def close(self, states: Mapping[str, State], *, fresh: bool) -> None:
        if not fresh:
            self.push(states, {name: each.system.new() for name, each in zip(self.bodies(), self._bodies, strict=True)})

    def bound(self, body: str) -> tuple[float, float]:
        return (
            (self._stiffness * sum(1.0 / mass for mass in self._masses), 0.0) if body in self.bodies() else (0.0, 0.0)
        )

    def stiffen(self, stiffness: float) -> bool:
        return False

    def kept(self) -> Mapping[str, wp.array]:
        return {}

    def as_kept(self, values: Mapping[str, object]) -> None:
        pass

    def restored(self) -> None:
        pass


def bond(
    scene: Scene, bodies: Sequence[CoupledBody], space: Space, scales: Scales, clock: Clock, once: bool, *,
    stiffness: float = 1.0,
) -> Bond:  # fmt: skip
    """Its maker: a line of `wsph.contact.table.COUPLINGS`."""
    return Bond(stiffness, bodies, space, clock)
