"""The works of gravity and of damping, with one velocity for all of a step: that at which the particles go their way."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of
from wsph.backend.domain import WHOLE, Domain, Share
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, blocks, total
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.parts.body_force import BodyForce, inertia_struct
from wsph.parts.works import Works


class ForceWork(Works):
    """The works of the body forces."""

    @property
    def gravity(self) -> float:
        """Work of gravity so far, nondimensional."""
        raise NotImplementedError

    @property
    def damped(self) -> float:
        """Energy that damping has taken so far, nondimensional."""
        raise NotImplementedError


@cache
def _way_kernel(space: Space, layout: Layout) -> wp.Kernel:
    Inertia, Fields = inertia_struct(space, False), fields_struct(space, layout)

    @kernel(ranged=True)
    def work(
        first: int,
        clock: wp.array(dtype=wp.float64),
        body: Inertia,
        volume: wp.array(dtype=space.scalar),
        fields: Fields,
        low: int,
        end: int,
        place_out: wp.array(dtype=space.vec),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        damped = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            u = fields.displacement[i]
            way = u - place_out[i]
            damped += wp.float64(volume[i] * wp.dot(way, way))
            place_out[i] = u
        work_out[block, 0] = work_out[block, 0] + wp.float64(body.density * body.damping) * damped / dt_of(clock)

    return work


@cache
def _lift_kernel(space: Space, layout: Layout) -> wp.Kernel:
    Inertia, Fields = inertia_struct(space, False), fields_struct(space, layout)

    @kernel()
    def lift(
        body: Inertia,
        volume: wp.array(dtype=space.scalar),
        fields: Fields,
        low: int,
        end: int,
        work_out: wp.array(dtype=wp.float64),
    ):
        block = wp.tid()
        lifted = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            lifted += wp.float64(volume[i] * wp.dot(body.gravity, fields.displacement[i]))
        work_out[block] = wp.float64(body.density) * lifted

    return lift


class WayWork(ForceWork):
    """Works of the body forces of a body of one set, from its displacements: that of gravity is its potential's, exactly;
    damping takes in a step m rate |du|^2/dt, so nothing where nothing moves.

    _volume  # (n,) scalar
    _place   # (n,) vec, displacements at the end of the last step, where there is damping
    """

    columns = 1

    def __init__(
        self,
        force: BodyForce,
        volume: np.ndarray,
        state: State,
        device: str,
        share: Share | None = None,
        domain: Domain = WHOLE,
    ):
        """`state`: that of the body, which is up to date when works are asked for; `share`: its particles that count."""
        super().__init__(share or Share.all(len(volume)), force.parts.damped, device, domain)
        self._force, self._state = force, state
        if force.parts.damped or force.parts.heavy:
            self._volume = wp.array(volume, dtype=state.space.scalar, device=device)
        if force.parts.damped:
            self._place = wp.zeros(len(volume), dtype=state.space.vec, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        made = _way_kernel(state.space, state.layout)
        return made, [clock.time, self._force.struct, self._volume, state.struct, self._low, self._n], [self._place]

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | ({"place": self._place} if self._acts else {})

    @property
    def gravity(self) -> float:
        # A launch and a small copy.
        if not self._force.parts.heavy:
            return 0.0
        count, state = blocks(self._n - self._low), self._state
        sums = wp.zeros(count, dtype=wp.float64, device=state.device)
        inputs = [self._force.struct, self._volume, state.struct, self._low, self._n]
        made = _lift_kernel(state.space, state.layout)
        wp.launch(made, len(sums), inputs=inputs, outputs=[sums], device=state.device)
        return total(sums, self._domain)

    @property
    def damped(self) -> float:
        return self._total(0)


@cache
def _middle_kernel(space: Space, layout: Layout, varied: bool) -> wp.Kernel:
    Inertia, Fields = inertia_struct(space, varied), fields_struct(space, layout)

    @kernel(ranged=True)
    def work(
        first: int,
        clock: wp.array(dtype=wp.float64),
        body: Inertia,
        volume: wp.array(dtype=space.scalar),
        fields: Fields,
        low: int,
        end: int,
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        lifted = wp.float64(0.0)
        damped = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            v = fields.velocity[i]
            mass = wp.float64(body.density * volume[i])
            pull = body.gravity
            if wp.static(varied):
                pull += body.field[i]
            lifted += mass * wp.float64(wp.dot(pull, v))
            damped += mass * wp.float64(body.damping * wp.dot(v, v))
        work_out[block, 0] = work_out[block, 0] + dt_of(clock) * lifted
        work_out[block, 1] = work_out[block, 1] + dt_of(clock) * damped

    return work


class MiddleWork(ForceWork):
    """Works of the body forces of a body of two sets, by the midpoint rule over the virtual particles in the middle of a
    step: what of the real particles' velocities these do not see does no work, and no force acts on it.

    _volume  # of the virtual particles, (m,) scalar
    """

    def __init__(
        self,
        force: BodyForce,
        volume: np.ndarray,
        space: Space,
        device: str,
        struct: object,
        share: Share | None = None,
        domain: Domain = WHOLE,
    ):
        """`struct`: of the virtual particles, whose accelerations are those of the middle of the step when works are
        added; `share`: its particles that count."""
        acts = force.parts.damped or force.parts.heavy or force.parts.varied
        super().__init__(share or Share.all(len(volume)), acts, device, domain)
        self._struct, self._varied = struct, force.parts.varied
        if acts:
            self._volume = wp.array(volume, dtype=space.scalar, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        made = _middle_kernel(state.space, state.layout, self._varied)
        return made, [clock.time, self._struct, self._volume, state.struct, self._low, self._n], []

    def start(self, state: State, clock: Clock) -> None:
        """The first step has not been taken."""
        if self._acts:
            self._work.zero_()

    @property
    def gravity(self) -> float:
        return self._total(0)

    @property
    def damped(self) -> float:
        return self._total(1)
