"""Motions on the device: velocities that follow from prescribed displacements and accelerations, and where they lead.

A displacement u(t) gives the velocity u'(t); where one velocity leads over a whole step (the middle of a leapfrog step, the
two sets of Taylor-SPH) it is the mean (u(t + dt) - u(t))/dt, and at the end of a step the displacement is set to u(t + dt).
An acceleration is integrated beside the run, by Gauss' four points between the entries of a table: exactly, up to
rounding, where it is linear in time between them. Both are measured from where the particles are at the start of the run:
in the reference configuration, or in the state of a file. While the clock is still nothing moves.
"""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of, time_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.stack_machine import Bank, bank_of, evaluate, knot_after, places
from wsph.expressions import Expression

WHOLE = (0.0, 1.0)
"""The part of a step over which one velocity leads."""

_ROOTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
NODES = wp.constant(wp.vec4d(*(0.5 * (1.0 + _ROOTS)).tolist()))
WEIGHTS = wp.constant(wp.vec4d(*(0.5 * _WEIGHTS).tolist()))
"""Gauss' four points of [0, 1]."""


@wp.struct
class Moves:
    """k motions, and the units that they are counted in: `second` [s], `speed` [m/s], `length` [m].

    place         # (k,), of the velocity in the buffer of a state
    way           # (k,), of the displacement, or -1 where a state has none
    program       # (k,), of the displacement or of the acceleration, in the `Bank`
    rate          # (k,), of the velocity of a displacement, or -1
    position      # (k,), reference position [m], zero beyond the dimensions
    velocity      # (k,), of an acceleration, at the start of the step [m/s]
    displacement  # (k,), at the start of the step [m]; of a displacement, at the start of the run
    """

    place: wp.array(dtype=wp.int32)
    way: wp.array(dtype=wp.int32)
    program: wp.array(dtype=wp.int32)
    rate: wp.array(dtype=wp.int32)
    position: wp.array(dtype=wp.vec3d)
    velocity: wp.array(dtype=wp.float64)
    displacement: wp.array(dtype=wp.float64)
    second: wp.float64
    speed: wp.float64
    length: wp.float64


@wp.func
def _integrals(bank: Bank, program: int, x: wp.vec3d, t: wp.float64, span: wp.float64):
    """What an acceleration adds to velocity and displacement from t to t + span."""
    gain = wp.float64(0.0)
    way = wp.float64(0.0)
    end = t + span
    since = t
    while since < end:
        until = knot_after(bank, program, since, end)
        h = until - since
        for q in range(4):
            s = since + NODES[q] * h
            a = WEIGHTS[q] * h * evaluate(bank, program, x, s, wp.float64(0.0))
            gain += a
            way += a * (end - s)
        since = until
    return gain, way


@wp.func
def _moved(bank: Bank, moves: Moves, e: int, clock: wp.array(dtype=wp.float64), c: wp.float64):
    """Displacement [m] and velocity [m/s] of a motion at t + c dt."""
    dt = dt_of(clock) * moves.second
    t = time_of(clock) * moves.second
    x = moves.position[e]
    if moves.rate[e] < 0:
        gain, way = _integrals(bank, moves.program[e], x, t, c * dt)
        return moves.displacement[e] + c * dt * moves.velocity[e] + way, moves.velocity[e] + gain
    slack = wp.float64(1.0e-9) * dt
    u = evaluate(bank, moves.program[e], x, t + c * dt, slack)
    return moves.displacement[e] + u, evaluate(bank, moves.rate[e], x, t + c * dt, slack)


@cache
def _kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    real, module = space.scalar, space.module("motions")

    @kernel(ranged=True, module=module)
    def move(
        first: int,
        bank: Bank,
        moves: Moves,
        clock: wp.array(dtype=wp.float64),
        from_dt: wp.float64,
        to_dt: wp.float64,
        whole: int,
        state_out: wp.array(dtype=real),
    ):
        e = first + wp.tid()
        u, v = _moved(bank, moves, e, clock, from_dt)
        if to_dt != from_dt:
            there, then = _moved(bank, moves, e, clock, to_dt)
            v = wp.float64(0.5) * (v + then)
            if whole == 1:
                v = (there - u) / (dt_of(clock) * moves.second)
        state_out[moves.place[e]] = real(v / moves.speed)

    @kernel(ranged=True, module=module)
    def lead(first: int, bank: Bank, moves: Moves, clock: wp.array(dtype=wp.float64), state_out: wp.array(dtype=real)):
        e = first + wp.tid()
        if moves.way[e] >= 0:
            u, _v = _moved(bank, moves, e, clock, wp.float64(1.0))
            state_out[moves.way[e]] = real(u / moves.length)

    @kernel(ranged=True, module=module)
    def advance(
        first: int,
        bank: Bank,
        moves: Moves,
        clock: wp.array(dtype=wp.float64),
        velocity_out: wp.array(dtype=wp.float64),
        displacement_out: wp.array(dtype=wp.float64),
    ):
        e = first + wp.tid()
        if moves.rate[e] < 0:
            u, v = _moved(bank, moves, e, clock, wp.float64(1.0))
            velocity_out[e] = v
            displacement_out[e] = u

    return move, lead, advance


class Motions:
    """The motions of a body or of its walls: k entries of `place` (k,) in the buffer of a state, with the `way` (k,) of
    their displacements, the motion and the reference position [m] of each."""

    def __init__(
        self,
        space: Space,
        place: list[int],
        way: list[int],
        motions: list[Motion],
        position: list[np.ndarray],
        units: tuple[float, float],
        device: str,
        some: bool,
    ):
        """`units`: of velocity [m/s] and of time [s]; `some`: whether any process that shares the body has one."""
        self.count, self._some = len(place), some
        self._space = space
        self.moves = Moves()
        if some:
            self.moves.velocity = wp.zeros(self.count, dtype=wp.float64, device=device)
            self.moves.displacement = wp.zeros(self.count, dtype=wp.float64, device=device)
        if not self.count:
            return
        kept: list[Expression | Function] = []
        programs: dict[int, tuple[int, int]] = {}
        for motion in motions:
            if id(motion) not in programs:
                both = motion.kind == "displacement"
                programs[id(motion)] = len(kept), len(kept) + 1 if both else -1
                kept += [motion.of, motion.rate] if both else [motion.of]
        self._bank = bank_of(kept, device)
        program, rate = zip(*(programs[id(motion)] for motion in motions), strict=True)
        moves = self.moves
        moves.place, moves.way, moves.program, moves.rate = (
            wp.array(each, dtype=wp.int32, device=device) for each in (place, way, program, rate)
        )
        moves.position = wp.array(places(np.array(position)), dtype=wp.vec3d, device=device)
        moves.speed, moves.second = units
        moves.length = units[0] * units[1]

    def kept(self) -> dict[str, Array]:
        """The arrays that a checkpoint holds of them, by name."""
        return {"velocity": self.moves.velocity, "displacement": self.moves.displacement} if self._some else {}

    def begin(self, state: State) -> None:
        """Take the velocities at the start of the run, with which accelerations go on, and the displacements, from which all
        motions are measured."""
        if self.count:
            buffer, way = state.buffer.numpy().astype(float), self.moves.way.numpy()
            self.moves.velocity.assign(buffer[self.moves.place.numpy()] * float(self.moves.speed))
            self.moves.displacement.assign(np.where(way >= 0, buffer[way], 0.0) * float(self.moves.length))

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set their velocities at t + c dt; of c = (a, b) the mean of both times, of `WHOLE` the mean of the step (a
        launch)."""
        if self.count and not clock.still:
            first, last = c if isinstance(c, tuple) else (c, c)
            inputs = [self._bank, self.moves, clock.time, wp.float64(first), wp.float64(last), int(c == WHOLE)]
            clock.launch(_kernels(self._space)[0], self.count, inputs, [state.buffer])

    def lead(self, state: State, clock: Clock) -> None:
        """Set their displacements at t + dt, where the state has them (a launch)."""
        if self.count and not clock.still:
            inputs = [self._bank, self.moves, clock.time]
            clock.launch(_kernels(self._space)[1], self.count, inputs, [state.buffer])

    def close(self, clock: Clock) -> None:
        """Close a step (a launch)."""
        if self.count and not clock.still:
            inputs, outputs = [self._bank, self.moves, clock.time], [self.moves.velocity, self.moves.displacement]
            clock.launch(_kernels(self._space)[2], self.count, inputs, outputs)
