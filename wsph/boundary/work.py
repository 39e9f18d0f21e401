"""External work of prescribed motion and loads on a body."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import warp as wp

from wsph.backend.clock import Clock, dt_of, time_of
from wsph.backend.domain import WHOLE, Domain, Share, any_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK, Segments
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.backend.tensors import determinant_and_inverse
from wsph.boundary.conditions import Conditions, Owned
from wsph.boundary.loads.carried import Carried
from wsph.boundary.values import BoundaryValues
from wsph.constitutive.evolution import volume_ratio
from wsph.constitutive.laws import Laws
from wsph.constitutive.stress_state import packing
from wsph.output.fields import AXES
from wsph.parts.works import PowerWorks
from wsph.ranks.kept import Rows
from wsph.reporting import Term


@cache
def _work_kernel(space: Space, laws: Laws, layout: Layout) -> wp.Kernel:
    dim, real, vec, mat = space.dim, space.scalar, space.vec, space.mat
    Fields, deformed = fields_struct(space, layout), "deformation" in dict(layout)
    inverse, unpack = determinant_and_inverse(space)[1], packing(space, laws.state)[0]
    ratio = volume_ratio(space, laws, layout)

    @kernel(ranged=True)
    def work(
        first: int,
        axes: mat,
        fields: Fields,
        clock: wp.array(dtype=wp.float64),
        particle: wp.array(dtype=wp.int32),
        axis: wp.array(dtype=wp.int32),
        area: wp.array(dtype=wp.float64),
        power_out: wp.array2d(dtype=wp.float64),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        row = first + wp.tid()
        i = particle[row]
        # Nanson: the current area vector is J F^-T N times the reference area.
        normal = vec()
        for a in range(wp.static(dim)):
            normal[a] = axes[a, axis[row]]
        if wp.static(deformed):
            F = wp.identity(n=dim, dtype=real) + fields.deformation[i]
            normal = ratio(fields, i) * (wp.transpose(inverse(F)) * normal)
        stress = unpack(fields.stress[i])
        velocity = fields.velocity[i]
        power = wp.float64(0.0)
        for a in range(wp.static(dim)):
            for b in range(wp.static(dim)):
                power += area[row] * wp.float64(stress[a, b] * normal[b] * velocity[a])
        work_out[row, 0] = work_out[row, 0] + wp.float64(0.5) * dt_of(clock) * (power + power_out[row, 0])
        power_out[row, 0] = power

    return work


class ExternalWork(PowerWorks):
    """Work of the moved and loaded faces of a two-set body, by f rows of a particle on a face, in the order of the
    particles: each has sums of its own, which processes that share a face put together.

    _particle  # (f,) int32
    _axis      # (f,) int32, the face's axis of the grid
    _area      # (f,) float64, nondimensional, with the sign of the outward normal
    """

    columns = 1

    def __init__(
        self,
        space: Space,
        conditions: Conditions,
        laws: Laws,
        area_unit: float,
        axes: object,
        layout: Layout,
        device: str,
        share: Share,
        domain: Domain = WHOLE,
    ):
        """`share`: the particles that are here, of which its own count."""
        rows = np.argsort(conditions.work_particle, kind="stable")
        rows = rows[share.owns(conditions.work_particle[rows])]
        super().__init__(0, any_of(domain, len(rows) > 0), device, domain)
        self._axes, self._kernel = axes, _work_kernel(space, laws, layout)
        if self._acts:
            self._particle = wp.array(conditions.work_particle[rows], dtype=wp.int32, device=device)
            self._axis = wp.array(conditions.work_axis[rows], dtype=wp.int32, device=device)
            self._area = wp.array(conditions.work_area[rows] / area_unit, dtype=wp.float64, device=device)
            self._work, self._power = (wp.zeros((len(rows), 1), dtype=wp.float64, device=device) for _ in range(2))

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        inputs = [self._axes, state.struct, clock.time, self._particle, self._axis, self._area]
        return self._kernel, inputs, [self._power]

    def rows(self, share: Share) -> Rows:
        """Where its rows stand among those of all processes."""
        particle = self._particle.numpy() if self._acts else np.zeros(0, np.int32)
        keys = share.first + particle.astype(np.int64)[:, None]
        return Rows.by_keys(keys, np.ones(len(keys), bool), self._domain)

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        return self._total(0)


@cache
def _rows_struct(space: Space) -> type:
    """Struct of prescribed components, row by row, in blocks: `ConstraintWork` has its fields."""
    annotations = {
        "starts": wp.array(dtype=wp.int32),
        "place": wp.array(dtype=wp.int32),
        "mass": wp.array(dtype=space.scalar),
        "begins": wp.array(dtype=wp.float64),
        "ends": wp.array(dtype=wp.float64),
        "second": wp.float64,
    }
    return wp.struct(type("ConstraintRows", (), {"__annotations__": annotations, "__module__": __name__}))


@cache
def _constraint_kernels(space: Space, shared: bool) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels that keep velocities, and add the work of setting them. `shared`: components are of several boundaries, of
    each in windows of time."""
    real, Rows = space.scalar, _rows_struct(space)
    module = space.module("constraint_in_steps" if shared else "constraint")

    @kernel(ranged=True, module=module)
    def keep(first: int, place: wp.array(dtype=wp.int32), state: wp.array(dtype=real), free_out: wp.array(dtype=real)):
        e = first + wp.tid()
        free_out[e] = state[place[e]]

    @kernel(ranged=True, module=module)
    def work(
        first: int,
        rows: Rows,
        free: wp.array(dtype=real),
        state: wp.array(dtype=real),
        clock: wp.array(dtype=wp.float64),
        step: wp.array(dtype=wp.int64),
        part: wp.float64,
        old_out: wp.array(dtype=real),
        sums_out: wp.array2d(dtype=wp.float64),
        last_out: wp.array(dtype=wp.int64),
    ):
        block = first + wp.tid()
        total = wp.float64(0.0)
        impulse = wp.float64(0.0)
        for e in range(rows.starts[block], rows.starts[block + 1]):
            new = state[rows.place[e]]
            change = rows.mass[e] * (new - free[e])
            if wp.static(shared):
                # As `wsph.boundary.programs.stack_machine.holding` has it.
                t = (time_of(clock) + (part - wp.float64(1.0e-9)) * dt_of(clock)) * rows.second
                if not (rows.begins[e] < t and t <= rows.ends[e]):
                    change = real(0.0)
            total += wp.float64(real(0.5) * change * (new + old_out[e]))
            impulse += wp.float64(change)
            old_out[e] = new
        force = impulse / dt_of(clock)
        # Velocities are set several times in a step: the first time of each begins anew.
        if last_out[block] == step[0]:
            force += sums_out[block, 1]
        last_out[block] = step[0]
        sums_out[block, 0] = sums_out[block, 0] + total
        sums_out[block, 1] = force

    return keep, work


def _by_owners(owners: Sequence[Owned], share: np.ndarray) -> tuple[np.ndarray, ...]:
    """Of the components and whose they are when, of the entries `share` (k,), the rows: number of the entry, owner, from
    when and up to when [s]. What is one boundary's, in whatever windows, is one row: where it does not hold it changes
    nothing."""
    rows: list[tuple[int, int, float, float]] = []
    for entry in share.tolist():
        owned = owners[entry]
        if len({owner for _, _, owner in owned}) == 1:
            rows.append((entry, owned[0][2], -np.inf, np.inf))
        else:
            rows += [(entry, owner, start, end) for start, end, owner in owned]
    entry, owner, begins, ends = zip(*rows, strict=True) if rows else ((), (), (), ())
    return np.array(entry, int), np.array(owner, int), np.array(begins, float), np.array(ends, float)


class ConstraintWork:
    """Work of prescribed velocities on a one-set body: the impulse that sets them, times the mean velocity of the step. Of k
    prescribed components, nondimensional, in the order of their boundaries and components, each with sums of its own, which
    processes that share a boundary put together; a component that boundaries prescribe one after the other is there once
    for each window of each:

    _rows    # starts of the rows (k + 1,) int32; place (k,) int32, where each stands in the buffer of the state; mass
             # of its particle (k,) scalar; and where several boundaries prescribe one component, from when and up to when
             # each does, begins and ends (k,) float64 [s], second: the clock's unit [s]
    _free    # the value that the step gave before it was set, (k,) scalar
    _old     # the value at the end of the last step, (k,) scalar
    _sums    # (k, 2) float64, works so far, and the mean force of the last step: that impulse over dt
    _last    # (k,) int64, the step that it is of
    """

    def __init__(
        self,
        space: Space,
        boundary: BoundaryValues,
        mass: np.ndarray,
        device: str,
        share: Share | None = None,
        domain: Domain = WHOLE,
    ):
        """`share`: the particles that count."""
        mine = boundary.count > 0 and (share or Share.all(len(mass))).owns(boundary.particle)
        self.count = int(np.count_nonzero(mine))
        self._space, self._domain, self._some = space, domain, any_of(domain, self.count > 0)
        self._known = np.zeros(0, int)
        if self._some:
            # Of boundary k the component a is owner k dim + a.
            dim = space.dim
            entry, owner, begins, ends = _by_owners(boundary.owners, np.flatnonzero(mine))
            self._shared = any_of(domain, len(entry) > self.count)
            self.count = len(entry)
            keys = owner * dim + boundary.component[entry] if self.count else owner
            self._known = np.unique(domain.joined(np.unique(keys)))
            self._segments = segments = Segments.of(keys, 1)
            entry = entry[segments.order]
            self._rows = rows = _rows_struct(space)()
            place, particle = (boundary.place.numpy(), boundary.particle) if self.count else (entry, entry)
            self._place = wp.array(place[entry], dtype=wp.int32, device=device)
            rows.place, rows.starts = self._place, wp.array(segments.starts, dtype=wp.int32, device=device)
            rows.mass = wp.array(mass[particle[entry]], dtype=space.scalar, device=device)
            rows.second = wp.float64(boundary.second)
            if self._shared:
                rows.begins, rows.ends = (
                    wp.array(each[segments.order], dtype=wp.float64, device=device) for each in (begins, ends)
                )
            self._free = wp.zeros(self.count, dtype=space.scalar, device=device)
            self._old = wp.zeros(self.count, dtype=space.scalar, device=device)
            self._sums = wp.zeros((segments.count, 2), dtype=wp.float64, device=device)
            self._last = wp.full(segments.count, -1, dtype=wp.int64, device=device)

    def before(self, state: State, clock: Clock) -> None:
        """Keep the velocities that the step gave, before they are set (a launch)."""
        if self.count:
            keep, _ = _constraint_kernels(self._space, self._shared)
            clock.launch(keep, self.count, [self._place, state.buffer], [self._free])

    def after(self, state: State, clock: Clock, c: float | tuple[float, float]) -> None:
        """Add the work of setting them to what holds at t + c dt (a launch)."""
        if self.count:
            part = wp.float64(max(c) if isinstance(c, tuple) else c)
            inputs = [self._rows, self._free, state.buffer, clock.time, clock.counted, part]
            outputs = [self._old, self._sums, self._last]
            _, work = _constraint_kernels(self._space, self._shared)
            clock.launch(work, self._segments.count, inputs, outputs)

    def settled(self, state: State, carried: Carried, clock: Clock) -> None:
        """Between the two: take what was set in the states that this one was made from for a part of it (launches)."""
        if self.count:
            carried.count(state, self._place, self._free, clock)

    def kept(self) -> dict[str, wp.array]:
        """The arrays that a checkpoint holds of it, by name."""
        return {"old": self._old, "work": self._sums, "last": self._last} if self._some else {}

    def start(self, state: State, clock: Clock) -> None:
        """Take the prescribed velocities at the start of the run."""
        if self.count:
            self._old.assign(state.buffer.numpy()[self._place.numpy()])
            self._sums.zero_()
            self._last.fill_(-1)

    @property
    def total(self) -> float:
        """Work so far, nondimensional."""
        if not self._some:
            return 0.0
        return float(self._segments.whole(self._sums.numpy(), self._domain).T[0].sum(dtype=np.float64))

    def rows(self, share: Share) -> Rows:
        """Where its rows stand among those of all processes."""
        if not self._some:
            return Rows(0, np.zeros(0, int), np.zeros(0, bool))
        keys = self._segments.owner[:, None]
        return Rows.by_keys(keys, np.ones(len(keys), bool), self._domain)

    def terms(self, owner: int) -> dict[str, list[Term]]:
        """What the boundary of a number has of it: the terms of its force and its work."""
        found: dict[str, list[Term]] = {}
        dim = self._space.dim if self._some else 0
        for axis in range(dim):
            key, names = owner * dim + axis, ("work", f"force_{AXES[axis]}")
            mine = self._segments.terms(key, self._sums, names)
            if not mine and key in self._known:
                mine = self._segments.none(self._sums, names)
            for name, terms in mine.items():
                found.setdefault(name, []).extend(terms)
        return found


@cache
def _drag_kernel(space: Space, layout: Layout, holding: bool) -> wp.Kernel:
    vec, Fields, drags = space.vec, fields_struct(space, layout), "drag" in dict(layout)

    @kernel(ranged=True)
    def work(
        first: int,
        fields: Fields,
        clock: wp.array(dtype=wp.float64),
        hold: wp.array(dtype=vec),
        mass: wp.array(dtype=space.scalar),
        low: int,
        end: int,
        drag_out: wp.array(dtype=vec),
        old_out: wp.array(dtype=vec),
        power_out: wp.array2d(dtype=wp.float64),
        work_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        dragged = wp.float64(0.0)
        held = wp.float64(0.0)
        for i in range(low + block * BLOCK, wp.min(low + (block + 1) * BLOCK, end)):
            v = fields.velocity[i]
            if wp.static(drags):
                # What it has changed times the mean velocity of the step: exact where the velocity is free, however long the
                # step is beside the time in which it acts.
                dragged -= wp.float64(mass[i] * wp.dot(drag_out[i], v + old_out[i]))
                old_out[i] = v
                drag_out[i] = vec()
            if wp.static(holding):
                held -= wp.float64(mass[i] * wp.dot(hold[i], v))
        work_out[block, 0] = work_out[block, 0] + wp.float64(0.5) * dragged
        if wp.static(holding):
            half = wp.float64(0.5) * dt_of(clock)
            work_out[block, 1] = work_out[block, 1] + half * (held + power_out[block, 1])
            power_out[block, 1] = held

    return work


class DragWork(PowerWorks):
    """Work of the viscosity of a one-set body, from the velocities that it adds, and of the forces that hold spurious modes
    (per mass). `before`, (n,) vec, holds the velocities at the start of a step, where there is drag."""

    def __init__(
        self,
        space: Space,
        state: State,
        hold: wp.array | None,
        mass: np.ndarray,
        device: str,
        share: Share | None = None,
        domain: Domain = WHOLE,
    ):
        """`share`: the particles that count."""
        self._drags = "drag" in state.widths
        super().__init__(share or Share.all(state.n), self._drags or hold is not None, device, domain)
        self._kernel = _drag_kernel(space, state.layout, hold is not None)
        self.before = wp.zeros(state.n if self._drags else 1, dtype=space.vec, device=device)
        if self._acts:
            # What the kernel leaves out it is given all the same.
            self._hold = hold if hold is not None else self.before
            self._mass = wp.array(mass, dtype=space.scalar, device=device)

    def _launch(self, state: State, clock: Clock) -> tuple[wp.Kernel, list[object], list[object]]:
        drag = state.struct.drag if self._drags else self.before
        inputs = [state.struct, clock.time, self._hold, self._mass, self._low, self._n]
        return self._kernel, inputs, [drag, self.before, self._power]

    def kept(self) -> dict[str, wp.array]:
        return super().kept() | ({"before": self.before} if self._drags else {})

    @property
    def dragged(self) -> float:
        """Energy that drag has taken so far, nondimensional."""
        return self._total(0)

    @property
    def held(self) -> float:
        """Work done against the holding forces so far, nondimensional."""
        return self._total(1)
