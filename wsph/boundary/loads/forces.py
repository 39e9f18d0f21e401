"""Prescribed loads on the device: the force on every particle, the sum of its rows."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.prescribed import Prescribed, constant, same
from wsph.boundary.programs.stack_machine import Bank, bank_of, evaluate_mean, interval, places
from wsph.boundary.values import CONSTANT


@cache
def _sum_kernel(space: Space) -> wp.Kernel:
    vec, real, dim, exact = space.vec, space.scalar, space.dim, Space(space.dim).vec

    @kernel(ranged=True)
    def sum_loads(
        first: int,
        bank: Bank,
        clock: wp.array(dtype=wp.float64),
        particle: wp.array(dtype=wp.int32),
        offsets: wp.array(dtype=wp.int32),
        program: wp.array(dtype=wp.int32),
        push: wp.array(dtype=exact),
        position: wp.array(dtype=wp.vec3d),
        from_dt: wp.float64,
        to_dt: wp.float64,
        second: wp.float64,
        force_out: wp.array(dtype=vec),
    ):
        e = first + wp.tid()
        total = exact()
        for row in range(offsets[e], offsets[e + 1]):
            value = wp.float64(1.0)
            if program[row] != wp.static(CONSTANT):
                value = evaluate_mean(bank, program[row], position[e], clock, second, from_dt, to_dt)
            total += value * push[row]
        force = vec()
        for a in range(wp.static(dim)):
            force[a] = real(total[a])
        force_out[particle[e]] = force

    return sum_loads


class LoadForces:
    """The prescribed loads of a body of n particles, nondimensional. `impose` sets `force` (n,) vec to those of a time; what
    does not change in time is set once. Of p particles whose loads change, by r rows:

    _particle  # (p,) int32
    _offsets   # (p + 1,) int32, where the rows of each begin
    _program   # (r,) int32, of its value in the `Bank`, or CONSTANT
    _push      # (r,) float64 vector, force per SI unit of the value, or the force of what is constant
    _position  # (p,) vec3d, reference position [m], zero beyond the dimensions
    """

    def __init__(
        self,
        space: Space,
        loads: list[FaceLoad],
        force: wp.array,
        position: np.ndarray,
        unit: float,
        second: float,
        device: str,
    ):
        """Of the body's particles `position` (n, dim) [m]; `force` (n,) vec is in units of `unit`, that of a push times its
        value (of loads N, N/m in 2D), and the clock in units of `second` [s]."""
        self.space, self.force, self._second = space, force, second
        self.loaded = np.unique(np.concatenate([load.particle for load in loads] or [np.zeros(0, int)]))
        """The particles that carry loads."""
        self.count = 0
        if not loads:
            return
        kept, particle, program, push = _merged(loads, unit)
        # What no program changes is there from the start.
        fixed = np.isin(particle, particle[program != CONSTANT], invert=True)
        start = np.zeros((len(force), space.dim))
        np.add.at(start, particle[fixed], push[fixed])
        force.assign(start)
        particle, program, push = (values[~fixed] for values in (particle, program, push))
        owners, first = np.unique(particle, return_index=True)
        self.count = len(owners)
        if self.count == 0:
            return
        self._bank = bank_of(kept, device)
        self._particle = wp.array(owners, dtype=wp.int32, device=device)
        self._offsets = wp.array([*first, len(particle)], dtype=wp.int32, device=device)
        self._program = wp.array(program, dtype=wp.int32, device=device)
        self._push = wp.array(push, dtype=Space(space.dim).vec, device=device)
        self._position = wp.array(places(position[owners]), dtype=wp.vec3d, device=device)

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the loads of t + c dt; of c = (a, b) the mean of both times (a launch, where loads change in time)."""
        if self.count == 0:
            return
        inputs = [self._bank, clock.time, self._particle, self._offsets, self._program, self._push, self._position]
        inputs += [*interval(c), wp.float64(self._second)]
        clock.launch(_sum_kernel(self.space), self.count, inputs, [self.force])


def _merged(loads: list[FaceLoad], unit: float) -> tuple[list[Prescribed], np.ndarray, np.ndarray, np.ndarray]:
    """The values that are no constants, and the rows of all loads by particle and value:
    particle (r,), program (r,), push (r, dim)."""
    kept: list[Prescribed] = []
    programs, pushes = [], []
    for load in loads:
        number, own = constant(load.value), CONSTANT
        if number is None:
            own = next((n for n, value in enumerate(kept) if same(value, load.value)), len(kept))
            kept += [load.value] * (own == len(kept))
        programs.append(np.full(len(load.particle), own))
        pushes.append(load.push * ((1.0 if number is None else number) / unit))
    particle, program = np.concatenate([load.particle for load in loads]), np.concatenate(programs)
    keys, place = np.unique(np.stack([particle, program], 1), axis=0, return_inverse=True)
    push = np.zeros((len(keys), loads[0].push.shape[1]))
    np.add.at(push, place.ravel(), np.concatenate(pushes))
    return kept, keys[:, 0], keys[:, 1], push
