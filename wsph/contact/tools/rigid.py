"""Rigid bodies: systems that integrators step beside deformable ones, prescribed or free."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.algebra import combine
from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Array, Space, Struct
from wsph.backend.state import State
from wsph.boundary.programs.prescribed import Prescribed, nonzero
from wsph.boundary.programs.stack_machine import bank_of, interval
from wsph.contact.reported import Column, Reported
from wsph.contact.tools import moving
from wsph.contact.tools.moving import LAYOUT, SPACE, Rigid, pose_struct, stand_kernel
from wsph.output.fields import AXES
from wsph.protocols import Entry
from wsph.units import Scales

WORK = 6
"""The place, behind force and torque, of the work in what a rigid body tells."""


@dataclass(frozen=True)
class Inertia:
    """What a free body is moved by: `mass`, `tensor` (3, 3) about its centre of mass, gravity (3,), all nondimensional."""

    mass: float
    tensor: np.ndarray
    gravity: np.ndarray


@dataclass(frozen=True)
class Motion:
    """What is prescribed: components of the velocity [m/s] and the rate [1/s] about `axis` (3,), as programs of t."""

    velocity: Sequence[Prescribed]
    rate: Prescribed
    axis: np.ndarray

    @property
    def moves(self) -> bool:
        """Whether any of it is not zero."""
        return any(nonzero(value) for value in (*self.velocity, self.rate))


@dataclass(frozen=True)
class Start:
    """Where a body begins, nondimensional: place of its point about the origin (3,), velocity (3,), and of a free one the
    angular velocity (3,)."""

    place: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


class RigidBody:
    """A rigid body. Its motion is `Inertia`'s or `Motion`'s; a joint system calls it as it calls a deformable body, `place`,
    `spread` and `close` are for what acts on it. Three-dimensional and in double precision inside; nondimensional.

    state    # `moving.LAYOUT`
    pose     # where it is, for kernels (`moving.pose_struct`)
    load     # force and torque on it in the last evaluation, (6,) float64
    _told    # force and torque on others, and work, at the end of the last step, (7,) float64
    _began   # where it was there
    _before  # load there, (6,) float64
    """

    def __init__(
        self,
        name: str,
        moved_by: Inertia | Motion,
        start: Start,
        space: Space,
        scales: Scales,
        clock: Clock,
        reach: float = np.inf,
    ) -> None:
        """`reach`: no point of it that can touch anything is further from its own point."""
        self.name, self.clock, self.scales = name, clock, scales
        self.free, self._motion = isinstance(moved_by, Inertia), moved_by if isinstance(moved_by, Motion) else None
        self.space, self.inertia = space, moved_by if isinstance(moved_by, Inertia) else None
        self.arrays, self._reach = Arrays(clock.device), reach
        self._found, self._extent = (np.zeros(3), np.zeros(4)), 0.0
        # Of the angular velocity by the angular momentum, at most.
        self._slack = 1.0 if self.inertia is None else float(np.linalg.eigvalsh(_inverse(self.inertia.tensor)).max())
        self.rigid = _numbers(self.inertia)
        self._still = self._motion is not None and not self._motion.moves
        self.first, self._made = start, 0
        if self._motion is not None and not self._still:
            self._bank = bank_of([*self._motion.velocity, self._motion.rate], clock.device)
            self._axis = SPACE.vec(*self._motion.axis)
        self.state = self.new()
        self._began = self.new()
        self.pose = _pose(space, self.arrays)
        self.load = self.arrays.zeros("load", 6, wp.float64)
        self._before = self.arrays.zeros("before", 6, wp.float64, kept=True)
        self._told = self.arrays.zeros("told", 7, wp.float64, kept=True)
        spin = start.spin if self.inertia is None else self.inertia.tensor @ start.spin
        for state in (self.state, self._began):
            self._put(state, start.velocity, spin)
        self.impose(self.state, 0.0)
        self.impose(self._began, 0.0)

    def _put(self, state: State, velocity: np.ndarray, spin: np.ndarray) -> None:
        state.buffer.assign(np.concatenate([velocity, spin, self.first.place, [0.0, 0.0, 0.0, 1.0]]))

    def new(self) -> State:
        """A state: of a body that stands still as it is, otherwise zero."""
        state = State(SPACE, 1, LAYOUT, self.clock.device)
        if self._still:
            self._put(state, np.zeros(3), np.zeros(3))
        self.arrays.take(f"state{self._made}", state.buffer, kept=True)
        self._made += 1
        return state

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivative of `state`, with gravity and without other forces."""
        if not self._still:
            inputs = [self.rigid, state.struct, int(part != "rest"), int(part != "velocity")]
            self.clock.launch(moving.rate, 1, inputs, [out.struct])

    def combine(
        self,
        out: State,
        plain: list[tuple[float, State]],
        timed: list[tuple[float, State]] | None = None,
        squared: list[tuple[float, State]] | None = None,
        part: str = "all",
    ) -> None:
        """As that of a deformable body."""
        if not self._still:
            span = {"all": (0, len(out.buffer)), "velocity": (0, out.split), "rest": (out.split, len(out.buffer))}[part]
            x, k, j = ([(c, state.buffer) for c, state in each or []] for each in (plain, timed, squared))
            combine(SPACE, self.clock, x, k, j, span, out.buffer)

    def drift(self, state: State, k: State, c: float, ahead: float = 0.0) -> None:
        """Place and turning go on by c dt, with the velocity and the angular momentum as they are."""
        if not self._still:
            self.clock.launch(moving.drift, 1, [self.rigid, self.clock.time, wp.float64(c)], [state.struct])

    def impose(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed velocities at t + c dt."""
        if self._motion is not None and not self._still:
            units = [wp.float64(self.scales.time), wp.float64(self.scales.length)]
            inputs = [self._bank, self.clock.time, self._axis, *interval(c), *units]
            self.clock.launch(moving.impose, 1, inputs, [state.struct])

    def constrain(self, state: State, c: float | tuple[float, float]) -> None:
        """`impose` on the state that goes on from there."""
        self.impose(state, c)

    def project(self, state: State) -> None:
        """It has no stresses."""

    def accept(self, state: State) -> None:
        """Close the step of its own motion."""
        self.constrain(state, 1.0)
        if not self._still:
            self.clock.launch(moving.unify, 1, [], [state.struct])

    def kinetic(self, state: State) -> float:
        """Kinetic energy of a free body (a copy from the device); none of a prescribed one, which no force has given it."""
        if self.inertia is None:
            return 0.0
        v, L, turn = state.read("velocity")[0], state.read("spin")[0], state.read("turn")[0]
        R = rotation_matrix(turn)
        inside = R.T @ L
        return 0.5 * self.inertia.mass * float(v @ v) + 0.5 * float(inside @ _inverse(self.inertia.tensor) @ inside)

    def member(self) -> "RigidBody":
        """Itself: integrators step it."""
        return self

    def find(self, places: np.ndarray) -> None:
        """Candidates are found where it is now, on the host, for vertices at `places` (n, dim)."""
        self.place(self.state)
        place, turn = self.state.read("place")[0], self.state.read("turn")[0]
        away = np.linalg.norm(places - place[: self.space.dim], axis=1).max(initial=0.0)
        self._found, self._extent = (place, turn), float(min(self._reach, away))

    def has_left(self, way: float) -> bool:
        """Whether one of its points that can touch has gone, or can go by the end of the step, further than a way since."""
        if self._still:
            return False
        numbers = self.state.buffer.numpy()
        before, turned = self._found
        gone = math.dist(numbers[6:9], before)
        # Half as fast again: stages and accelerations within a step.
        ahead = (
            1.5 * self.clock.dt * (math.hypot(*numbers[:3]) + self._slack * math.hypot(*numbers[3:6]) * self._extent)
        )
        if self._extent > 0.0:
            # 2 sin(angle/2) of the turning since.
            gone += 2.0 * math.sqrt(max(1.0 - float(numbers[9:] @ turned) ** 2, 0.0)) * self._extent
        return way < gone + ahead < math.inf

    @property
    def told(self) -> Reported:
        """Force and torque on others, about its point, and the work that it has done on them."""
        dim, unit = self.space.dim, self.scales.stress * self.scales.length ** (self.space.dim - 1)
        units = {1: ("Pa", "J/m2"), 2: ("N/m", "N"), 3: ("N", "N m")}[dim]
        force = {f"force_{axis}": Column(a, unit, units[0]) for a, axis in enumerate(AXES[:dim])}
        energy = unit * self.scales.length
        turning = {2: {"torque": 5}, 3: {f"torque_{axis}": 3 + a for a, axis in enumerate(AXES)}}.get(dim, {})
        torque = {name: Column(at, energy, units[1]) for name, at in turning.items()}
        work = {"work": Column(WORK, energy, {1: "J/m2", 2: "J/m", 3: "J"}[dim])}
        history = {name.removeprefix("force_"): column for name, column in force.items()}
        fields = {"force": force, "torque": torque, "work": work} if torque else {"force": force, "work": work}
        return Reported("tool", self.name, self._told, fields, history | torque)

    def start(self, state: State) -> None:
        """Take what is there at the start of a run; `load` is that of the state (copies)."""
        self._before.assign(self.load.numpy())
        self._told.assign(np.concatenate([-self.load.numpy(), [0.0]]))

    def place(self, state: State) -> None:
        """Where it is in a state; nothing acts on it yet (a launch)."""
        inputs = [self.rigid, state.struct, self._began.struct]
        self.clock.launch(stand_kernel(self.space), 1, inputs, [self.pose, self.load])

    def spread(self, rate: State) -> None:
        """Add the accelerations by what acts on it (a launch)."""
        if self.free:
            self.clock.launch(moving.push, 1, [self.rigid, self.load], [rate.struct])

    def close(self, state: State) -> None:
        """Close a step whose last evaluation was of `state`: its work, and where ways begin (a launch)."""
        outputs = [self._began.struct, self._before, self._told]
        self.clock.launch(moving.close, 1, [state.struct, self.load], outputs)

    @property
    def given(self) -> float:
        """Work that it has done on others so far."""
        return float(self._told.numpy()[WORK])

    @property
    def lifted(self) -> float:
        """Work of gravity on it so far: that of its potential."""
        if self.inertia is None:
            return 0.0
        way = self.state.read("place")[0] - self.first.place
        return self.inertia.mass * float(self.inertia.gravity @ way)

    @property
    def ledger(self) -> tuple[Entry, ...]:
        """A prescribed body brings work from outside; a free one has energy of its own."""
        if self.free:
            energy = Entry("kinetic", lambda: self.kinetic(self.state))
            return energy, Entry("external_work", lambda: self.lifted)
        return (Entry("external_work", lambda: self.given),)

    def compliance(self, arm: np.ndarray) -> np.ndarray:
        """1/M + r^2/I, I its smallest moment of inertia: how a force at a distance r from its centre of mass moves it there
        at most, (n,) of `arm` (n,); 0 of a prescribed body."""
        if self.inertia is None:
            return np.zeros(len(arm))
        turning = _inverse(self.inertia.tensor)
        return 1.0 / self.inertia.mass + arm**2 * float(np.linalg.eigvalsh(turning).max())

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        return self.arrays.kept


def rotation_matrix(turn: np.ndarray) -> np.ndarray:
    """R of a quaternion (x, y, z, w)."""
    x, y, z, w = turn / np.linalg.norm(turn)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def _inverse(tensor: np.ndarray) -> np.ndarray:
    """The inverse over the axes that a body can turn about; the others, of 1D and 2D, are left out."""
    axes = np.diag(tensor) > 0.0
    found = np.zeros((3, 3))
    if axes.any():
        found[np.ix_(axes, axes)] = np.linalg.inv(tensor[np.ix_(axes, axes)])
    return found


def _numbers(inertia: Inertia | None) -> Struct:
    made: Any = Rigid()
    made.free = int(inertia is not None)
    if inertia is not None:
        made.mass, made.inverse_mass = wp.float64(inertia.mass), wp.float64(1.0 / inertia.mass)
        made.gravity = SPACE.vec(*inertia.gravity)
        made.inertia = SPACE.mat(*inertia.tensor.ravel())
        made.inverse = SPACE.mat(*_inverse(inertia.tensor).ravel())
    return made


def _pose(space: Space, arrays: Arrays) -> Struct:
    kinds: Mapping[str, type] = {
        **dict.fromkeys(("place", "shift", "velocity"), space.vec),
        **dict.fromkeys(("about", "spin"), space.point),
        "axes": space.mat,
    }
    made = pose_struct(space)()
    for name, kind in kinds.items():
        setattr(made, name, arrays.zeros(f"pose.{name}", 1, kind))
    return made
