"""Prescribed values on the device: a list whose entries are a place in the flat state and a program for the stack machine
(`wsph.boundary.programs.stack_machine`)."""

from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import WHOLE as ALL
from wsph.backend.domain import Domain, Share, any_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.boundary.conditions import Conditions, Owned
from wsph.boundary.programs.motion import Motion
from wsph.boundary.programs.motions import WHOLE, Motions
from wsph.boundary.programs.prescribed import Prescribed, constant
from wsph.boundary.programs.stack_machine import Bank, are_tables, bank_of, between, holding, interval, places
from wsph.boundary.programs.windows import Windowed
from wsph.ranks.kept import Rows

NOBODY: Owned = ((-np.inf, np.inf, -1),)
"""The owner of what no boundary prescribes."""

CONSTANT = -1
"""The program of an entry that never changes: its scale is its value. Most faces are free: thousands of zeros."""


@cache
def _impose_kernel(space: Space, changes: bool, tables: bool) -> wp.Kernel:
    """`changes`: there are programs; `tables`: they all are tables. The stack machine takes longest to compile."""
    real, evaluate_between = space.scalar, between(tables)

    @kernel(ranged=True)
    def impose(
        first: int,
        bank: Bank,
        clock: wp.array(dtype=wp.float64),
        place: wp.array(dtype=wp.int32),
        program: wp.array(dtype=wp.int32),
        scale: wp.array(dtype=wp.float64),
        position: wp.array(dtype=wp.vec3d),
        from_dt: wp.float64,
        to_dt: wp.float64,
        second: wp.float64,
        leading: int,
        state_out: wp.array(dtype=real),
    ):
        e = first + wp.tid()
        value = scale[e]
        if wp.static(changes):  # noqa: SIM102 - what is static is left out by itself alone
            if program[e] != wp.static(CONSTANT):
                which = holding(bank, program[e], clock, second, wp.max(from_dt, to_dt))
                if which >= 0:
                    value *= evaluate_between(bank, which, position[e], clock, second, from_dt, to_dt)
                elif place[e] < leading:
                    return
                else:
                    value = wp.float64(0.0)
        state_out[place[e]] = real(value)

    return impose


class BoundaryValues:
    """The prescribed values of a body on the device.

    `impose(state, c)` sets them in a state at t + c dt; c = (a, b) means the mean of both times. Velocities that hold in
    some steps of the run are left as they are in the others. While the clock is still, prescribed velocities are zero: what
    is driven stays where it is. Of k entries, the host has `particle`,
    `component` (k,) and `owners`, by whose boundaries it is prescribed when, and the device

    place      # (k,) int32, where each stands in the buffer of the state
    _program   # (k,) int32, its program in the `Bank`, or CONSTANT
    _scale     # (k,) float64, nondimensional units per SI unit, or of a constant the nondimensional value
    _position  # (k,) vec3d, reference position [m], zero beyond the dimensions

    Displacements and accelerations are set after the others, by `motions`; their place in the list has a zero, which holds
    while the clock is still.
    """

    _still: list[wp.array] | None = None
    """`_program` and `_scale` while the clock is still."""

    def __init__(
        self,
        space: Space,
        conditions: Conditions,
        state: State,
        position: np.ndarray,
        units: dict[str, float],
        second: float,
        device: str,
        ways: tuple[str, str] = ("velocity", "displacement"),
        domain: Domain = ALL,
    ):
        """`ways`: the field whose values lead, and the one that says where to."""
        self.space, self.second = space, second
        place, program, scale, points, owners = [], [], [], [], []
        components: list[int] = []
        self.owners: list[Owned] = []
        moved: list[tuple[int, int, Motion, np.ndarray]] = []
        self._moving: list[tuple[int, int]] = []
        programs: dict[int, int] = {}
        kept: list[Prescribed] = []
        for (name, component), values in sorted(conditions.entries.items(), key=lambda item: item[0]):
            for particle, value in sorted(values.items()):
                factor = 1.0 / units[name]
                number = constant(value)
                if isinstance(value, Motion):
                    way = state.index(ways[1], particle, component) if ways[1] in state.layout else -1
                    moved.append((state.index(name, particle, component), way, value, position[particle]))
                    self._moving.append((component, particle))
                    number = 0.0
                if number is None and id(value) not in programs:
                    programs[id(value)] = len(kept)
                    kept.append(value)
                place.append(state.index(name, particle, component))
                program.append(programs[id(value)] if number is None else CONSTANT)
                scale.append(factor if number is None else number * factor)
                points.append(position[particle])
                owners.append(particle)
                components.append(component)
                self.owners.append(conditions.owners.get((name, component), {}).get(particle, NOBODY))
        columns = [list(column) for column in zip(*moved, strict=True)] or [[], [], [], []]
        some = any_of(domain, bool(moved))
        self.motions = Motions(space, *columns, (units.get(ways[0], 1.0), second), device, some)
        self.count = len(place)
        if self.count == 0:
            return
        self._bank, self._kinds = bank_of(kept, device), (bool(kept), are_tables(kept))
        self._windowed = [k for k, value in enumerate(kept) if isinstance(value, Windowed)]
        self.particle = np.array(owners, np.int32)
        self.component = np.array(components, int)
        self.place = wp.array(place, dtype=wp.int32, device=device)
        self._program = wp.array(program, dtype=wp.int32, device=device)
        self._scale = wp.array(scale, dtype=wp.float64, device=device)
        self._position = wp.array(places(np.array(points)), dtype=wp.vec3d, device=device)

    def moving(self, share: Share, domain: Domain) -> Rows:
        """Where the entries of its motions stand among those of all processes."""
        keys = np.array(self._moving, np.int64).reshape(-1, 2)
        own = share.owns(keys[:, 1])
        keys[:, 1] += share.first
        return Rows.by_keys(keys, own, domain)

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float], *, leads: bool = False) -> None:
        """Set the prescribed values in `state` (launches). `leads`: at c = 0.5 the velocities are to lead over all of the
        step."""
        if self.count == 0:
            return
        programs = self._at_rest(state) if clock.still else [self._program, self._scale]
        inputs = [self._bank, clock.time, self.place, *programs, self._position]
        inputs += [*interval(c), wp.float64(self.second), state.split]
        clock.launch(_impose_kernel(self.space, *self._kinds), self.count, inputs, [state.buffer])
        self.motions.impose(state, clock, WHOLE if leads and c == 0.5 else c)

    def _at_rest(self, state: State) -> list[wp.array]:
        """`_program` and `_scale` with zero for every velocity."""
        if self._still is None:
            moves = self.place.numpy() < state.split
            stays = moves & ~np.isin(self._program.numpy(), self._windowed)
            program, scale = np.where(stays, CONSTANT, self._program.numpy()), np.where(moves, 0.0, self._scale.numpy())
            device = self.place.device
            self._still = [
                wp.array(program, dtype=wp.int32, device=device),
                wp.array(scale, dtype=wp.float64, device=device),
            ]
        return self._still
