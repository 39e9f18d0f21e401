"""Probes: records of fields at material points, kept on the device between reads.

A record is a few weighted sums over the flat state, so one kernel serves every probe of every system; rows go into a ring
indexed by the step number, and the host reads it between blocks of steps.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Protocol

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.errors import Fault, SceneError
from wsph.formulations.reading import DENSITY, Places, Reading
from wsph.formulations.system import System
from wsph.geometry.selection import select
from wsph.output import fields
from wsph.scene.tables import Body, Probe

RING = 1024
"""Steps between two reads of a probe that records every step."""


@cache
def _kernel(space: Space) -> wp.Kernel:
    real = space.scalar

    @wp.func
    def value(at: int, state: wp.array(dtype=real), derived: wp.array(dtype=real)) -> real:
        if at < state.shape[0]:
            return state[at]
        return derived[at - state.shape[0]]

    @kernel()
    def record(
        step: wp.array(dtype=wp.int64),
        offsets: wp.array(dtype=wp.int32),
        place: wp.array(dtype=wp.int32),
        weight: wp.array(dtype=real),
        state: wp.array(dtype=real),
        derived: wp.array(dtype=real),
        largest: int,
        ring_out: wp.array2d(dtype=real),
    ):
        c = wp.tid()
        row = int(step[0] % wp.int64(ring_out.shape[0]))
        total = real(0.0)
        if largest != 0:
            total = value(place[offsets[c]], state, derived)
            for k in range(offsets[c], offsets[c + 1]):
                total = wp.max(total, value(place[k], state, derived))
        else:
            for k in range(offsets[c], offsets[c + 1]):
                total += weight[k] * value(place[k], state, derived)
        ring_out[row, c] = total

    return record


class Probed(Protocol):
    """A body, as probes see it."""

    @property
    def body(self) -> Body: ...

    @property
    def system(self) -> System: ...

    @property
    def reading(self) -> Reading: ...


def _several(bodies: Sequence[Probed], key: str) -> SceneError:
    names = ", ".join(repr(b.body.name) for b in bodies)
    return SceneError("scene", [Fault(0, key, f"lies in {names}: name one with `body`")])


def _holds(run: Probed, points: np.ndarray) -> bool:
    """Whether all of the points (n, dim) [m] lie in a body."""
    geometry = run.system.geometry
    shape = run.body.shape
    inside = geometry.holds(points) if geometry.mapped or shape is None else shape.contains(points)
    return bool(inside.all())


def _at(probe: Probe, points: np.ndarray, key: str, bodies: Sequence[Probed]) -> tuple[Probed, Callable[[str], Places]]:
    """The body that holds the points of a probe, and where and with which weights a field is read at each."""
    inside = [b for b in bodies if _holds(b, points)]
    if not inside:
        text = f"{[list(p) for p in probe.at or ()]} does not lie in one body"
        raise SceneError("scene", [Fault(0, f"{key}.at", text)])
    if len(inside) > 1:
        raise _several(inside, f"{key}.at")
    reading = inside[0].reading
    return inside[0], cache(lambda name: reading.sample(points, name))


def _selected(probe: Probe, text: str, key: str, bodies: Sequence[Probed]) -> tuple[Probed, Callable[[str], Places]]:
    """The body of which a probe selects particles, and which of those a field is read at, with their weights."""

    def chosen(run: Probed, name: str) -> np.ndarray:
        # Where stresses have places of their own, those are selected.
        return np.flatnonzero(select(text, run.reading.where(name), run.system.spacing))

    hit = [run for run in bodies if len(chosen(run, "velocity"))]
    if not hit:
        raise SceneError("scene", [Fault(0, f"{key}.where", f"{probe.where!r} selects no particle")])
    if len(hit) > 1:
        raise _several(hit, f"{key}.where")

    def read(name: str) -> Places:
        there = chosen(hit[0], name)
        return [(there, np.full(len(there), 1.0 / max(len(there), 1) if probe.reduce == "mean" else 1.0))]

    return hit[0], cache(read)


class Recorder:
    """One probe on the device. `record()` is a launch; `flush(steps)` appends the rows of those steps.

    A row has c columns: for each point, the components of each primitive field. All values are nondimensional.

    _offsets  # (c + 1,) int32, where the terms of each column begin
    _place    # (terms,) int32, an index into the buffers of the state and of its derived fields
    _weight   # (terms,) scalar
    _ring     # (RING, c) scalar, the row of step s at s modulo RING; (1, c) unless every step is recorded
    """

    def __init__(self, probe: Probe, key: str, bodies: Sequence[Probed], space: Space, clock: Clock, every_step: bool):
        self.probe, self._space, self._clock, self.every_step = probe, space, clock, every_step
        able = [b for b in bodies if probe.body in (None, b.body.name)]
        if probe.at is not None:
            body, places = _at(probe, np.array(probe.at), key, able)
        else:
            body, places = _selected(probe, probe.where or "", key, able)
        self._reading = reading = body.reading
        if DENSITY in probe.fields:
            text = f"the density cannot be probed in the {body.system.formulation} form; frames carry it"
            raise SceneError("scene", [Fault(0, f"{key}.fields", text)])
        self._primitives = sorted({fields.primitive(name) for name in probe.fields})
        for name in (name for name in self._primitives if name not in reading.fields):
            raise SceneError("scene", [Fault(0, f"{key}.fields", f"body {body.body.name!r} has no field {name!r}")])
        self.points = len(places("velocity"))
        offsets: list[int] = [0]
        place: list[int] = []
        weight: list[float] = []
        for k in range(self.points):
            for name in self._primitives:
                particles, weights = places(name)[k]
                for c in range(reading.fields[name].width):
                    place += reading.index(name, particles, c).tolist()
                    weight += weights.tolist()
                    offsets.append(len(place))
        device = clock.device
        self._offsets = wp.array(offsets, dtype=wp.int32, device=device)
        self._place = wp.array(place, dtype=wp.int32, device=device)
        self._weight = wp.array(weight, dtype=space.scalar, device=device)
        self._ring = wp.zeros((RING if every_step else 1, len(offsets) - 1), dtype=space.scalar, device=device)
        self._rows: list[np.ndarray] = []
        self.steps: list[int] = []

    def record(self) -> None:
        """Store the current values in the ring (a launch)."""
        inputs = [self._clock.step, self._offsets, self._place, self._weight]
        inputs += [*self._reading.buffers, int(self.probe.reduce == "max")]
        self._clock.launch(_kernel(self._space), self._ring.shape[1], inputs, [self._ring])

    def flush(self, steps: list[int]) -> None:
        """Read the rows of `steps` (all still in the ring)."""
        if steps:
            ring = self._ring.numpy()
            self._rows.append(ring[[s % len(ring) for s in steps]].astype(np.float64))
            self.steps += steps

    def kept(self) -> tuple[np.ndarray, list[int]]:
        """The rows read so far, (steps, c), and their steps."""
        width = self._ring.shape[1]
        return (np.concatenate(self._rows) if self._rows else np.zeros((0, width))), self.steps

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        """Take up a record where a checkpoint left it."""
        self._rows, self.steps = ([rows] if len(rows) else []), list(steps)

    def columns(self) -> dict[str, np.ndarray]:
        """The record so far, SI: one array (records,) per field component, `FIELD[k]` for the k-th of several points."""
        reading = self._reading
        rows, _ = self.kept()
        rows = rows.reshape(len(rows), self.points, self._ring.shape[1] // self.points)
        values: dict[str, np.ndarray] = {}
        start = 0
        for name in self._primitives:
            field = reading.fields[name]
            values[name] = rows[:, :, start : start + field.width] * field.scale
            start += field.width
        result: dict[str, np.ndarray] = {}
        for name in self.probe.fields:
            for column in fields.columns(name, reading.labels, self._space.dim):
                series = fields.component(column, values[fields.primitive(column)], reading.labels)
                for k in range(self.points):
                    result[column if self.points == 1 else f"{column}[{k}]"] = series[:, k]
        return result
