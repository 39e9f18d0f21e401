"""Prescribed loads on the device: the force on every particle, the sum of its rows."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.prescribed import Prescribed, constant, same
from wsph.boundary.programs.stack_machine import Bank, bank_of, evaluate_mean, interval, places
from wsph.boundary.values import CONSTANT


@cache
def _sum_kernel(space: Space) -> wp.Kernel:
    vec, real, dim, exact, Rows = space.vec, space.scalar, space.dim, Space(space.dim).vec, _rows_struct(space.dim)

    @wp.func
    def rounded(x: exact) -> vec:
        force = vec()
        for a in range(wp.static(dim)):
            force[a] = real(x[a])
        return force

    @kernel(ranged=True)
    def sum_loads(
        first: int,
        bank: Bank,
        clock: wp.array(dtype=wp.float64),
        rows: Rows,
        from_dt: wp.float64,
        to_dt: wp.float64,
        second: wp.float64,
        force_out: wp.array(dtype=vec),
        piece_out: wp.array(dtype=vec),
    ):
        e = first + wp.tid()
        total = exact()
        piece = exact()
        end = rows.offsets[e + 1]
        for row in range(rows.offsets[e], end):
            value = wp.float64(1.0)
            if rows.program[row] != wp.static(CONSTANT):
                value = evaluate_mean(bank, rows.program[row], rows.position[e], clock, second, from_dt, to_dt)
            push = value * rows.push[row]
            total += push
            piece += push
            if row + 1 == end or rows.piece[row + 1] != rows.piece[row]:
                piece_out[rows.piece[row]] = rounded(piece)
                piece = exact()
        force_out[rows.particle[e]] = rounded(total)

    return sum_loads


@cache
def _rows_struct(dim: int) -> type:
    """Struct of the loads of p particles that change, by r rows.

    particle  # (p,) int32
    offsets   # (p + 1,) int32, where the rows of each begin
    program   # (r,) int32, of its value in the `Bank`, or CONSTANT
    push      # (r,) float64 vector, force per SI unit of the value, or the force of what is constant
    piece     # (r,) int32, which force of one boundary on one particle it is a part of
    position  # (p,) vec3d, reference position [m], zero beyond the dimensions
    """
    annotations = dict.fromkeys(("particle", "offsets", "program", "piece"), wp.array(dtype=wp.int32))
    annotations |= {"push": wp.array(dtype=Space(dim).vec), "position": wp.array(dtype=wp.vec3d)}
    return wp.struct(type("LoadRows", (), {"__annotations__": annotations, "__module__": __name__}))


class LoadForces:
    """The prescribed loads of a body of n particles, nondimensional. `impose` sets `force` (n,) vec to those of a time; what
    does not change in time is set once. `pieces` (q,) vec are the same by boundary: of each of q pieces the force of
    `owner` (q,) on `particle` (q,), the numbers of boundaries and particles.
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
        self.particle = self.owner = np.zeros(0, int)
        self.pieces: Array = force
        if not loads:
            return
        kept, particle, owner, program, push = _merged(loads, unit)
        begins = np.diff(particle, prepend=-1).astype(bool) | np.diff(owner, prepend=-2).astype(bool)
        piece = np.cumsum(begins) - 1
        self.particle, self.owner = particle[begins], owner[begins]
        # What no program changes is there from the start.
        fixed = np.isin(particle, particle[program != CONSTANT], invert=True)
        start, parts = np.zeros((len(force), space.dim)), np.zeros((len(self.particle), space.dim))
        np.add.at(start, particle[fixed], push[fixed])
        np.add.at(parts, piece[fixed], push[fixed])
        force.assign(start)
        self.pieces = wp.array(parts, dtype=space.vec, device=device)
        particle, program, push, piece = (values[~fixed] for values in (particle, program, push, piece))
        changed, first = np.unique(particle, return_index=True)
        self.count = len(changed)
        if self.count == 0:
            return
        self._bank = bank_of(kept, device)
        self._rows = rows = _rows_struct(space.dim)()
        rows.particle = wp.array(changed, dtype=wp.int32, device=device)
        rows.offsets = wp.array([*first, len(particle)], dtype=wp.int32, device=device)
        rows.program = wp.array(program, dtype=wp.int32, device=device)
        rows.push = wp.array(push, dtype=Space(space.dim).vec, device=device)
        rows.piece = wp.array(piece, dtype=wp.int32, device=device)
        rows.position = wp.array(places(position[changed]), dtype=wp.vec3d, device=device)

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the loads of t + c dt; of c = (a, b) the mean of both times (a launch, where loads change in time)."""
        if self.count == 0:
            return
        inputs = [self._bank, clock.time, self._rows, *interval(c), wp.float64(self._second)]
        clock.launch(_sum_kernel(self.space), self.count, inputs, [self.force, self.pieces])


def _merged(
    loads: list[FaceLoad], unit: float
) -> tuple[list[Prescribed], np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The values that are no constants, and the rows of all loads by particle, boundary and value:
    particle (r,), owner (r,), program (r,), push (r, dim)."""
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
    owner = np.concatenate([np.full(len(load.particle), load.owner) for load in loads])
    keys, place = np.unique(np.stack([particle, owner, program], 1), axis=0, return_inverse=True)
    push = np.zeros((len(keys), loads[0].push.shape[1]))
    np.add.at(push, place.ravel(), np.concatenate(pushes))
    return kept, *keys.T, push
