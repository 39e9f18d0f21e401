"""Probes: records of fields at material points, kept on the device between reads.

A record is a few weighted sums over the flat state, so one kernel serves every probe of every system; rows go into a ring
indexed by the step number, and the host reads it between blocks of steps.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.errors import Fault, SceneError
from wsph.geometry.selection import select
from wsph.output import fields
from wsph.scene.tables import Probe

Places = list[tuple[np.ndarray, np.ndarray]]
"""Particles and weights, for each point of a probe."""

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


def _several(bodies: list[Any], key: str) -> SceneError:
    names = ", ".join(repr(b.body.name) for b in bodies)
    return SceneError("scene", [Fault(0, key, f"lies in {names}: name one with `body`")])


def _holds(run: Any, points: np.ndarray) -> bool:
    """Whether all of the points (n, dim) [m] lie in a body."""
    lattice = run.system.lattice
    if not lattice.mapped:
        return bool(run.body.shape.contains(points).all())
    # In a mapped body: as near to the centre of a cell as its corners are.
    reach = np.linalg.norm(lattice.nodes[lattice.corners] - lattice.cells[:, None], axis=2).max(1)
    gaps = np.linalg.norm(points[:, None] - lattice.cells, axis=2)
    return bool((gaps <= 1.001 * reach).any(1).all())


class Recorder:
    """One probe on the device. `record()` is a launch; `flush(steps)` appends the rows of those steps."""

    def __init__(self, probe: Probe, key: str, bodies: list[Any], space: Space, clock: Clock, every_step: bool):
        self.probe, self._space, self._clock, self.every_step = probe, space, clock, every_step
        self._body, places = self._sample(probe, key, bodies)
        system = self._body.system
        if "density" in probe.fields and "deformation" in system.state.widths:
            text = f"the density cannot be probed in the {system.formulation} form; frames carry it"
            raise SceneError("scene", [Fault(0, f"{key}.fields", text)])
        self._primitives = sorted({fields.primitive(name) for name in probe.fields} - {"density"})
        offsets, place, weight = [0], [], []
        self._internals = list(system.constitutive.internals)
        for k in range(len(places("velocity"))):
            for name in self._primitives:
                particles, weights = places("internals" if name in self._internals else name)[k]
                for c in self._components(name):
                    place += system.state.index("internals" if name in self._internals else name, particles, c).tolist()
                    weight += weights.tolist()
                    offsets.append(len(place))
        self.points = len(places("velocity"))
        device = clock.device
        self._offsets = wp.array(offsets, dtype=wp.int32, device=device)
        self._place = wp.array(place, dtype=wp.int32, device=device)
        self._weight = wp.array(weight, dtype=space.scalar, device=device)
        self._ring = wp.zeros((RING if every_step else 1, len(offsets) - 1), dtype=space.scalar, device=device)
        self._rows: list[np.ndarray] = []
        self.steps: list[int] = []

    def _components(self, name: str) -> list[int]:
        """Components of a primitive in the state: all of a field, one of the internals."""
        return [self._internals.index(name)] if name in self._internals else list(range(self.body.state.widths[name]))

    @property
    def body(self) -> Any:
        """The system that the probe reads."""
        return self._body.system

    @staticmethod
    def _sample(probe: Probe, key: str, bodies: list[Any]) -> tuple[Any, Callable[[str], Places]]:
        """The body that a probe reads, and where and with which weights a field is read, for each point."""
        bodies = [b for b in bodies if probe.body in (None, b.body.name)]
        if probe.at is not None:
            points = np.array(probe.at)
            inside = [b for b in bodies if _holds(b, points)]
            if not inside:
                text = f"{[list(p) for p in probe.at]} does not lie in one body"
                raise SceneError("scene", [Fault(0, f"{key}.at", text)])
            if len(inside) > 1:
                raise _several(inside, f"{key}.at")
            return inside[0], cache(lambda name: inside[0].system.sample(points, name))
        chosen = [(b, np.flatnonzero(select(probe.where or "", b.system.position, b.system.spacing))) for b in bodies]
        chosen = [(b, particles) for b, particles in chosen if len(particles)]
        if not chosen:
            raise SceneError("scene", [Fault(0, f"{key}.where", f"{probe.where!r} selects no particle")])
        if len(chosen) > 1:
            raise _several([b for b, _ in chosen], f"{key}.where")
        body, particles = chosen[0]

        def read(name: str) -> Places:
            # Where stresses have places of their own, those are selected.
            there = particles
            if body.system.state.counts.get(name, body.system.count) != body.system.count:
                there = np.flatnonzero(select(probe.where or "", body.system.lattice.cells, body.system.spacing))
            return [(there, np.full(len(there), 1.0 / max(len(there), 1) if probe.reduce == "mean" else 1.0))]

        return body, read

    def record(self) -> None:
        """Store the current values in the ring (a launch)."""
        inputs = [self._clock.step, self._offsets, self._place, self._weight]
        state = self._body.system.state
        derived = state.derived.buffer if state.derived is not None else state.buffer
        inputs += [state.buffer, derived, int(self.probe.reduce == "max")]
        self._clock.launch(_kernel(self._space), self._ring.shape[1], inputs, [self._ring])

    def flush(self, steps: list[int]) -> None:
        """Read the rows of `steps` (all still in the ring)."""
        if steps:
            ring = self._ring.numpy()
            self._rows.append(ring[[s % len(ring) for s in steps]].astype(np.float64))
            self.steps += steps

    def kept(self) -> tuple[np.ndarray, list[int]]:
        """What has been read so far: rows and their steps."""
        width = self._ring.shape[1]
        return (np.concatenate(self._rows) if self._rows else np.zeros((0, width))), self.steps

    def go_on(self, rows: np.ndarray, steps: list[int]) -> None:
        """Take up a record where a checkpoint left it."""
        self._rows, self.steps = ([rows] if len(rows) else []), list(steps)

    def columns(self, scales: dict[str, float], density: float) -> dict[str, np.ndarray]:
        """The record so far, SI: one array (records,) per field component, `FIELD[k]` for the k-th of several points."""
        system = self._body.system
        rows, _ = self.kept()
        rows = rows.reshape(len(rows), self.points, self._ring.shape[1] // self.points)
        values, start = {}, 0
        for name in self._primitives:
            width = len(self._components(name))
            values[name] = rows[:, :, start : start + width] * scales.get(name, 1.0)
            start += width
        values["density"] = np.full((len(rows), self.points, 1), density)
        labels = system.constitutive.state.labels
        result = {}
        for field in self.probe.fields:
            for column in fields.columns(field, labels, self._space.dim):
                series = fields.component(column, values[fields.primitive(column)], labels)
                for k in range(self.points):
                    result[column if self.points == 1 else f"{column}[{k}]"] = series[:, k]
        return result
