"""Prescribed loads on the device: the force on every particle, the sum of its rows, and its work."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of, time_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.prescribed import Prescribed, constant, same
from wsph.boundary.programs.stack_machine import Bank, bank_of, evaluate
from wsph.boundary.values import CONSTANT
from wsph.parts.works import Works


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
        dt = dt_of(clock) * second
        t = time_of(clock) * second
        slack = wp.float64(1.0e-9) * dt
        total = exact()
        for row in range(offsets[e], offsets[e + 1]):
            value = wp.float64(1.0)
            if program[row] != wp.static(CONSTANT):
                value = evaluate(bank, program[row], position[e], t + from_dt * dt, slack)
                if to_dt != from_dt:
                    then = evaluate(bank, program[row], position[e], t + to_dt * dt, slack)
                    value = wp.float64(0.5) * (value + then)
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
        """`unit`: the unit of `force` [N per m^(dim-1) of a load's push and Pa of its value]."""
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
        padded = np.zeros((self.count, 3))
        padded[:, : position.shape[1]] = position[owners]
        self._bank = bank_of(kept, device)
        self._particle = wp.array(owners, dtype=wp.int32, device=device)
        self._offsets = wp.array([*first, len(particle)], dtype=wp.int32, device=device)
        self._program = wp.array(program, dtype=wp.int32, device=device)
        self._push = wp.array(push, dtype=Space(space.dim).vec, device=device)
        self._position = wp.array(padded, dtype=wp.vec3d, device=device)

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the loads of t + c dt; of c = (a, b) the mean of both times (a launch, where loads change in time)."""
        if self.count == 0:
            return
        first, last = c if isinstance(c, tuple) else (c, c)
        inputs = [self._bank, clock.time, self._particle, self._offsets, self._program, self._push, self._position]
        inputs += [wp.float64(first), wp.float64(last), wp.float64(self._second)]
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


@cache
def _work_kernel(space: Space, layout: Layout) -> wp.Kernel:
    vec, Fields = space.vec, fields_struct(space, layout)

    @kernel(ranged=True)
    def work(
        first: int,
        particle: wp.array(dtype=wp.int32),
        force: wp.array(dtype=vec),
        fields: Fields,
        count: int,
        before_out: wp.array(dtype=vec),
        place_out: wp.array(dtype=vec),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        for e in range(block * BLOCK, wp.min((block + 1) * BLOCK, count)):
            f = force[particle[e]]
            u = fields.displacement[particle[e]]
            total += wp.float64(wp.dot(f + before_out[e], u - place_out[e]))
            before_out[e] = f
            place_out[e] = u
        work_out[block, 0] = work_out[block, 0] + wp.float64(0.5) * total

    return work


class LoadWork(Works):
    """Work of the prescribed loads of a one-set body: the mean force of a step times the way in it, of the p particles that
    carry loads. A load that does not change has done the work of its potential, to rounding.

    _particle  # (p,) int32
    _before    # (p,) vec, forces at the end of the last step
    _place     # (p,) vec, displacements there
    """

    columns = 1

    def __init__(self, forces: LoadForces, device: str):
        super().__init__(len(forces.loaded), len(forces.loaded) > 0, device)
        self._forces = forces
        if self._acts:
            self._particle = wp.array(forces.loaded, dtype=wp.int32, device=device)
            self._before = wp.zeros(self._n, dtype=forces.space.vec, device=device)
            self._place = wp.zeros_like(self._before)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        made = _work_kernel(self._forces.space, state.layout)
        return made, [self._particle, self._forces.force, state.struct, self._n], [self._before, self._place]

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | ({"before": self._before, "place": self._place} if self._acts else {})

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return self._total(0)
