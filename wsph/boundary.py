"""Prescribed values: which components of which particles, and their values on the device.

A prescribed value is a program for a small stack machine (`wsph.expressions`), a number and a table included, so that one
kernel serves every boundary condition of every scene. An entry of the list is a place in the flat state and a program.

The rule at the faces of a two-set body (Herreros & Mabssout 2011, 3.2.4: essential conditions on the boundary particles):
each face prescribes one of (v_n | sigma_nn) and one of (v_t | sigma_nt) per tangent; a particle on several faces takes the
union; a face that nothing is said of is free. Where sigma_nn is prescribed the normal strain rate follows from its rate:
also at a corner whose other face holds v_n (without it a cantilever's root grows by 2e-4 a step at nu = .499, C <= .5).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import warp as wp

from wsph.errors import Fault, Refused, SceneError
from wsph.expressions import OPERATIONS, Expression, compile_expression, constant_program
from wsph.particles import Lattice
from wsph.program import Clock
from wsph.scene import AXES, Boundary, Function, Scene
from wsph.space import Space
from wsph.state import State

Prescribed = Expression | Function
WHERE_TOLERANCE = 1e-6
"""Points this fraction of a spacing from equality count as equal in `where`."""


@dataclass
class Conditions:
    """Prescribed components of one body and the faces that do work.

    entries: (field, component) -> {particle: value}; free_normals: bit k of (n,) where sigma_kk is prescribed; work_*: rows
    of (particle, axis, signed area [m^(dim-1)]) on faces that move or carry stress.
    """

    entries: dict[tuple[str, int], dict[int, Prescribed]] = field(default_factory=dict)
    free_normals: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_particle: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_axis: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int32))
    work_area: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def put(self, name: str, component: int, particles: np.ndarray, value: Prescribed) -> None:
        """Prescribe a component; what was said later holds."""
        self.entries.setdefault((name, component), {}).update(dict.fromkeys(particles.tolist(), value))


def select(text: str, position: np.ndarray, spacing: float) -> np.ndarray:
    """Particles where the expression holds, (n,) bool."""
    return compile_expression(text)(position, tolerance=WHERE_TOLERANCE * spacing) != 0.0


def _nonzero(value: Prescribed) -> bool:
    return not (isinstance(value, Expression) and value.program == constant_program(0.0).program)


def _nothing_selected(k: int, condition: Boundary) -> SceneError:
    key, text = ("where", condition.where) if condition.where else ("face", condition.face)
    return SceneError("scene", [Fault(0, f"boundary.{k}.{key}", f"{text!r} selects no particle of {condition.body!r}")])


def face_conditions(scene: Scene, body: str, lattice: Lattice, labels: tuple[str, ...]) -> Conditions:
    """Conditions of a two-set body. `labels` are the kept stress components. Raises SceneError where one selects nothing."""
    faces, dim, n = lattice.faces, scene.dim, len(lattice.nodes)
    result = Conditions()
    moved = np.zeros((len(faces.area), dim), bool)
    loaded = np.zeros(len(faces.area), bool)
    given: dict[str, dict[int, Prescribed]] = {}
    zero = constant_program(0.0)
    for k, condition in enumerate(scene.boundary):
        if condition.body != body:
            continue
        if condition.face:
            rows = faces.named(condition.face)
            nodes = np.unique(faces.nodes[rows])
        else:
            chosen = select(condition.where or "", lattice.nodes, lattice.spacing)
            nodes, rows = np.flatnonzero(chosen), chosen[faces.nodes].all(1)
        if not len(nodes):
            raise _nothing_selected(k, condition)
        velocity = {axis: scene.value(value, "m/s") for axis, value in condition.velocity.items()}
        velocity |= dict.fromkeys((*condition.fixed, *([condition.symmetry] if condition.symmetry else [])), zero)
        for axis, value in velocity.items():
            result.put("velocity", AXES.index(axis), nodes, value)
            moved[rows, AXES.index(axis)] = True
            loaded[rows] |= _nonzero(value)
        for label, text in condition.stress.items():
            value = scene.value(text, "Pa")
            on_faces = np.unique(faces.nodes[rows]) if rows.any() else nodes
            given.setdefault(label, {}).update(dict.fromkeys(on_faces.tolist(), value))
            loaded[rows] |= _nonzero(value)
    for axis in range(dim):
        rows = faces.axis == axis
        for tangent in range(dim):
            label = "".join(sorted("xyz"[axis] + "xyz"[tangent]))
            label = "xz" if label == "zx" else label
            free = rows & ~moved[:, tangent]
            result.put("stress", labels.index(label), np.unique(faces.nodes[free]), zero)
    for label, values in given.items():
        for value in set(values.values()):
            result.put("stress", labels.index(label), np.array([p for p, v in values.items() if v is value]), value)
    result.free_normals = np.zeros(n, np.int32)
    for axis in range(dim):
        stressed = np.array(sorted(result.entries.get(("stress", axis), {})), int)
        result.free_normals[stressed] |= 1 << axis
    corners = faces.nodes.shape[1]
    result.work_particle = faces.nodes[loaded].ravel().astype(np.int32)
    result.work_axis = np.repeat(faces.axis[loaded], corners).astype(np.int32)
    result.work_area = np.repeat((faces.sign * faces.area / corners)[loaded], corners)
    return result


def layer_conditions(scene: Scene, body: str, lattice: Lattice, who: str) -> Conditions:
    """Conditions of a one-set body, whose particles are the cells: a face is its first layer of particles."""
    result = Conditions()
    for k, condition in enumerate(scene.boundary):
        if condition.body != body:
            continue
        for key in ("stress", "symmetry"):
            if getattr(condition, key):
                raise Refused(
                    f"boundary.{k}.{key}: {who} prescribes velocity and fixed only; use a two-set integrator such as tsph"
                )
        if condition.face:
            particles = np.unique(lattice.faces.cell[lattice.faces.named(condition.face)])
        else:
            particles = np.flatnonzero(select(condition.where or "", lattice.cells, lattice.spacing))
        if not len(particles):
            raise _nothing_selected(k, condition)
        velocity = {axis: scene.value(value, "m/s") for axis, value in condition.velocity.items()}
        for axis, value in (velocity | dict.fromkeys(condition.fixed, constant_program(0.0))).items():
            result.put("velocity", AXES.index(axis), particles, value)
    return result


Stack = wp.types.vector(length=16, dtype=wp.float64)


@wp.struct
class Bank:
    """Programs and tables on the device."""

    start: wp.array(dtype=wp.int32)
    code: wp.array(dtype=wp.int32)
    number: wp.array(dtype=wp.float64)
    table_start: wp.array(dtype=wp.int32)
    table_step: wp.array(dtype=wp.int32)
    table_t: wp.array(dtype=wp.float64)
    table_value: wp.array(dtype=wp.float64)


def _op(name: str) -> int:
    return OPERATIONS[name]


@wp.func
def _first_at_or_after(values: wp.array(dtype=wp.float64), begin: int, end: int, t: wp.float64) -> int:
    """First index in [begin, end) whose value is >= t, or `end` (wp.lower_bound returns end - 1 there)."""
    low = begin
    high = end
    while low < high:
        middle = (low + high) // 2
        if values[middle] < t:
            low = middle + 1
        else:
            high = middle
    return low


@wp.func
def _look_up(bank: Bank, table: int, t: wp.float64, slack: wp.float64) -> wp.float64:
    first = bank.table_start[table]
    end = bank.table_start[table + 1]
    if bank.table_step[table] == 1:
        # value[k] holds on (t[k], t[k+1]]; a time a rounding above t[k+1] still counts as t[k+1].
        k = _first_at_or_after(bank.table_t, first, end, t - slack)
        return bank.table_value[wp.max(k - 1, first)]
    k = _first_at_or_after(bank.table_t, first, end, t)
    if k == first:
        return bank.table_value[first]
    if k == end:
        return bank.table_value[end - 1]
    s = (t - bank.table_t[k - 1]) / (bank.table_t[k] - bank.table_t[k - 1])
    return bank.table_value[k - 1] + s * (bank.table_value[k] - bank.table_value[k - 1])


@wp.func
def _truth(holds: bool) -> wp.float64:
    if holds:
        return wp.float64(1.0)
    return wp.float64(0.0)


@wp.func
def _apply_unary(code: int, a: wp.float64) -> wp.float64:
    if code == wp.static(_op("negate")):
        return -a
    if code == wp.static(_op("not")):
        return _truth(a == wp.float64(0.0))
    if code == wp.static(_op("sin")):
        return wp.sin(a)
    if code == wp.static(_op("cos")):
        return wp.cos(a)
    if code == wp.static(_op("tan")):
        return wp.tan(a)
    if code == wp.static(_op("asin")):
        return wp.asin(a)
    if code == wp.static(_op("acos")):
        return wp.acos(a)
    if code == wp.static(_op("atan")):
        return wp.atan(a)
    if code == wp.static(_op("sinh")):
        return wp.sinh(a)
    if code == wp.static(_op("cosh")):
        return wp.cosh(a)
    if code == wp.static(_op("tanh")):
        return wp.tanh(a)
    if code == wp.static(_op("exp")):
        return wp.exp(a)
    if code == wp.static(_op("log")):
        return wp.log(a)
    if code == wp.static(_op("log10")):
        return wp.log10(a)
    if code == wp.static(_op("sqrt")):
        return wp.sqrt(a)
    if code == wp.static(_op("abs")):
        return wp.abs(a)
    if code == wp.static(_op("sign")):
        return _truth(a > wp.float64(0.0)) - _truth(a < wp.float64(0.0))
    if code == wp.static(_op("floor")):
        return wp.floor(a)
    return wp.ceil(a)


@wp.func
def _apply_binary(code: int, a: wp.float64, b: wp.float64) -> wp.float64:
    if code == wp.static(_op("add")):
        return a + b
    if code == wp.static(_op("subtract")):
        return a - b
    if code == wp.static(_op("multiply")):
        return a * b
    if code == wp.static(_op("divide")):
        return a / b
    if code == wp.static(_op("power")):
        return wp.pow(a, b)
    if code == wp.static(_op("min")):
        return wp.min(a, b)
    if code == wp.static(_op("max")):
        return wp.max(a, b)
    if code == wp.static(_op("atan2")):
        return wp.atan2(a, b)
    if code == wp.static(_op("less")):
        return _truth(a < b)
    if code == wp.static(_op("less_equal")):
        return _truth(a <= b)
    if code == wp.static(_op("greater")):
        return _truth(a > b)
    if code == wp.static(_op("greater_equal")):
        return _truth(a >= b)
    if code == wp.static(_op("equal")):
        return _truth(a == b)
    if code == wp.static(_op("not_equal")):
        return _truth(a != b)
    if code == wp.static(_op("and")):
        return _truth(a != wp.float64(0.0) and b != wp.float64(0.0))
    return _truth(a != wp.float64(0.0) or b != wp.float64(0.0))


@wp.func
def _evaluate(bank: Bank, program: int, x: wp.vec3d, t: wp.float64, slack: wp.float64) -> wp.float64:
    stack = Stack()
    top = int(-1)
    for k in range(bank.start[program], bank.start[program + 1]):
        code = bank.code[k]
        if code == wp.static(_op("constant")):
            top += 1
            stack[top] = bank.number[k]
        elif code == wp.static(_op("table")):
            top += 1
            stack[top] = _look_up(bank, int(bank.number[k]), t, slack)
        elif code == wp.static(_op("t")):
            top += 1
            stack[top] = t
        elif code <= wp.static(_op("z")):
            top += 1
            stack[top] = x[code - wp.static(_op("x"))]
        elif code < wp.static(_op("add")):
            stack[top] = _apply_unary(code, stack[top])
        else:
            top -= 1
            stack[top] = _apply_binary(code, stack[top], stack[top + 1])
    return stack[0]


@cache
def _impose_kernel(space: Space) -> wp.Kernel:
    real = space.scalar

    @wp.kernel(module="unique", enable_backward=False)
    def impose(bank: Bank, clock: wp.array(dtype=wp.float64), from_dt: wp.float64, to_dt: wp.float64, second: wp.float64,
               place: wp.array(dtype=wp.int32), program: wp.array(dtype=wp.int32), scale: wp.array(dtype=wp.float64),
               position: wp.array(dtype=wp.vec3d), state_out: wp.array(dtype=real)):  # fmt: skip
        e = wp.tid()
        dt = clock[1] * second
        t = clock[0] * second
        slack = wp.float64(1.0e-9) * dt
        value = _evaluate(bank, program[e], position[e], t + from_dt * dt, slack)
        if to_dt != from_dt:
            value = wp.float64(0.5) * (value + _evaluate(bank, program[e], position[e], t + to_dt * dt, slack))
        state_out[place[e]] = real(value * scale[e])

    return impose


@cache
def _work_kernel(space: Space, unpack: wp.Function, Fields: type) -> wp.Kernel:
    dim = space.dim

    @wp.kernel(module="unique", enable_backward=False)
    def work(count: int, clock: wp.array(dtype=wp.float64), particle: wp.array(dtype=wp.int32), axis: wp.array(dtype=wp.int32),
             area: wp.array(dtype=wp.float64), fields: Fields, power_out: wp.array(dtype=wp.float64), work_out: wp.array(dtype=wp.float64)):  # fmt: skip
        block = wp.tid()
        power = wp.float64(0.0)
        for row in range(block * 1024, wp.min((block + 1) * 1024, count)):
            i = particle[row]
            stress = unpack(fields.stress[i])
            velocity = fields.velocity[i]
            for a in range(wp.static(dim)):
                power += area[row] * wp.float64(stress[axis[row], a] * velocity[a])
        work_out[block] = work_out[block] + wp.float64(0.5) * clock[1] * (power + power_out[block])
        power_out[block] = power

    return work


class BoundaryValues:
    """The prescribed values of a body on the device, and the work they do.

    `impose(state, c)` sets them in a state at t + c dt; c = (a, b) means the mean of both times.
    """

    def __init__(self, space: Space, conditions: Conditions, state: State, position: np.ndarray,
                 units: dict[str, float], second: float, device: str):  # fmt: skip
        self.space, self._second = space, second
        place, program, scale, points, owners = [], [], [], [], []
        programs: dict[int, int] = {}
        kept: list[Prescribed] = []
        for (name, component), values in sorted(conditions.entries.items(), key=lambda item: item[0]):
            for particle, value in sorted(values.items()):
                if id(value) not in programs:
                    programs[id(value)] = len(kept)
                    kept.append(value)
                place.append(state.index(name, particle, component))
                program.append(programs[id(value)])
                scale.append(1.0 / units[name])
                points.append(position[particle])
                owners.append(particle)
        self.count = len(place)
        if self.count == 0:
            return
        self._bank = _bank(kept, device)
        padded = np.zeros((self.count, 3))
        padded[:, : position.shape[1]] = points
        self.particle = np.array(owners, np.int32)
        self.place = wp.array(place, dtype=wp.int32, device=device)
        self._program = wp.array(program, dtype=wp.int32, device=device)
        self._scale = wp.array(scale, dtype=wp.float64, device=device)
        self._position = wp.array(padded, dtype=wp.vec3d, device=device)

    def impose(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the prescribed values in `state` (a launch)."""
        if self.count == 0:
            return
        first, last = c if isinstance(c, tuple) else (c, c)
        inputs = [self._bank, clock.time, wp.float64(first), wp.float64(last), wp.float64(self._second)]
        inputs += [self.place, self._program, self._scale, self._position]
        clock.launch(_impose_kernel(self.space), self.count, inputs, [state.buffer])


class ExternalWork:
    """Work of the moved and loaded faces, by the trapezoidal rule, one slot per 1024 face particles."""

    def __init__(self, space: Space, conditions: Conditions, unpack: wp.Function, area_unit: float, device: str):
        self.count = len(conditions.work_particle)
        self._space, self._unpack = space, unpack
        if self.count:
            self._particle = wp.array(conditions.work_particle, dtype=wp.int32, device=device)
            self._axis = wp.array(conditions.work_axis, dtype=wp.int32, device=device)
            self._area = wp.array(conditions.work_area / area_unit, dtype=wp.float64, device=device)
            blocks = -(-self.count // 1024)
            self._power = wp.zeros(blocks, dtype=wp.float64, device=device)
            self._work = wp.zeros(blocks, dtype=wp.float64, device=device)

    def add(self, state: State, clock: Clock) -> None:
        """Add the work of a step whose final values stand in `state` (a launch)."""
        if self.count:
            kernel = _work_kernel(self._space, self._unpack, state.type)
            inputs = [self.count, clock.time, self._particle, self._axis, self._area, state.struct]
            clock.launch(kernel, self._work.shape[0], inputs, [self._power, self._work])

    def start(self, state: State) -> None:
        """Nothing to take: a body starts with no stress on its faces."""

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return float(self._work.numpy().sum()) if self.count else 0.0


@cache
def _constraint_kernels(space: Space) -> tuple[wp.Kernel, wp.Kernel]:
    real = space.scalar
    module = space.module("constraint")

    @wp.kernel(module=module, enable_backward=False)
    def keep(place: wp.array(dtype=wp.int32), state: wp.array(dtype=real), free_out: wp.array(dtype=real)):
        e = wp.tid()
        free_out[e] = state[place[e]]

    @wp.kernel(module=module, enable_backward=False)
    def work(count: int, place: wp.array(dtype=wp.int32), mass: wp.array(dtype=real), free: wp.array(dtype=real),
             state: wp.array(dtype=real), old_out: wp.array(dtype=real), work_out: wp.array(dtype=wp.float64)):  # fmt: skip
        block = wp.tid()
        total = wp.float64(0.0)
        for e in range(block * 1024, wp.min((block + 1) * 1024, count)):
            new = state[place[e]]
            total += wp.float64(real(0.5) * mass[e] * (new - free[e]) * (new + old_out[e]))
            old_out[e] = new
        work_out[block] = work_out[block] + total

    return keep, work


class ConstraintWork:
    """Work of prescribed velocities on a one-set body: the impulse that sets them times the mean velocity of the step."""

    def __init__(self, space: Space, boundary: BoundaryValues, mass: np.ndarray, device: str):
        self.count = boundary.count
        self._space, self._boundary = space, boundary
        if self.count:
            self._mass = wp.array(mass[boundary.particle], dtype=space.scalar, device=device)
            self._free = wp.zeros(self.count, dtype=space.scalar, device=device)
            self._old = wp.zeros(self.count, dtype=space.scalar, device=device)
            self._work = wp.zeros(-(-self.count // 1024), dtype=wp.float64, device=device)

    def before(self, state: State, clock: Clock) -> None:
        """Keep what the step gave before the velocities are set (a launch)."""
        if self.count:
            clock.launch(
                _constraint_kernels(self._space)[0], self.count, [self._boundary.place, state.buffer], [self._free]
            )

    def after(self, state: State, clock: Clock) -> None:
        """Add the work of setting them (a launch)."""
        if self.count:
            inputs = [self.count, self._boundary.place, self._mass, self._free, state.buffer]
            clock.launch(_constraint_kernels(self._space)[1], self._work.shape[0], inputs, [self._old, self._work])

    def start(self, state: State) -> None:
        """Take the prescribed velocities at the start of the run."""
        if self.count:
            self._old.assign(state.buffer.numpy()[self._boundary.place.numpy()])

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return float(self._work.numpy().sum()) if self.count else 0.0


def _bank(values: list[Prescribed], device: str) -> Bank:
    start, code, number = [0], [], []
    table_start, table_step, table_t, table_value = [0], [], [], []
    for value in values:
        if isinstance(value, Expression):
            code += [c for c, _ in value.program]
            number += [v for _, v in value.program]
        else:
            code.append(OPERATIONS["table"])
            number.append(float(len(table_step)))
            table_step.append(int(value.interp == "step"))
            table_t += value.t or ()
            table_value += value.value or ()
            table_start.append(len(table_t))
        start.append(len(code))
    bank = Bank()
    integers: Callable[[list[int]], wp.array] = lambda v: wp.array(v, dtype=wp.int32, device=device)  # noqa: E731
    doubles: Callable[[list[float]], wp.array] = lambda v: wp.array(v, dtype=wp.float64, device=device)  # noqa: E731
    bank.start, bank.code, bank.number = integers(start), integers(code), doubles(number)
    bank.table_start, bank.table_step = integers(table_start), integers(table_step or [0])
    bank.table_t, bank.table_value = doubles(table_t or [0.0]), doubles([float(v) for v in table_value] or [0.0])
    return bank
