"""Probes of fields at material points.

A record is a few weighted averages over the flat state, so one kernel serves every probe of every system. A field at a
particle is that of frames.
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
from wsph.formulations.reading import DENSITY, Reading
from wsph.formulations.system import System
from wsph.geometry.selection import select
from wsph.output import fields
from wsph.output.fields import Formulas
from wsph.scene.probes import Probe
from wsph.scene.tables import Body
from wsph.simulation.probing.read_in import inside
from wsph.simulation.probing.recorder import Recorder
from wsph.sph.averages import Averages
from wsph.units import rounded


@cache
def record_kernel(space: Space) -> wp.Kernel:
    real = space.scalar

    @wp.func
    def value(at: int, state: wp.array(dtype=real), derived: wp.array(dtype=real)) -> real:
        if at < state.shape[0]:
            return state[at]
        return derived[at - state.shape[0]]

    @kernel()
    def record(
        step: wp.array(dtype=wp.int64),
        columns: wp.array(dtype=wp.int32),
        share: wp.array(dtype=real),
        bounded: wp.array(dtype=wp.int32),
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
        for e in range(columns[c], columns[c + 1]):
            low = value(place[offsets[e]], state, derived)
            high = low
            x = real(0.0)
            for k in range(offsets[e], offsets[e + 1]):
                v = value(place[k], state, derived)
                x += weight[k] * v
                if v < low:
                    low = v
                if v > high:
                    high = v
            # Comparisons, where a clamp would hide what is not a number.
            if bounded[c] != 0 and x < low:
                x = low
            if bounded[c] != 0 and x > high:
                x = high
            if largest == 0:
                total += share[c] * x
            elif e == columns[c] or x > total:
                total = x
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


Places = Callable[[str], list[list[Averages]]]
"""Of a field, for each number that a probe records of it, how its components are read, a target of averages a place."""

Sizes = Callable[[str], np.ndarray]
"""Of a field, the volumes of the places that a probe selects [m^dim]."""


def no_field(run: Probed, name: str, key: str) -> SceneError:
    """The error of a primitive field that a body does not have."""
    if name == fields.DEFORMATION:
        text = f"the {run.system.formulation} form of body {run.body.name!r} follows no deformation: there is no strain"
        return fault(f"{key}.fields", text)
    return fault(f"{key}.fields", f"body {run.body.name!r} has no field {name!r}")


def unit_of(name: str, reading: Reading, formulas: Formulas) -> str:
    """The SI unit of a column."""
    return formulas[name].unit if name in formulas else reading.unit(fields.primitive(name))


def fault(key: str, text: str) -> SceneError:
    return SceneError("scene", [Fault(0, key, text)])


def _several(bodies: Sequence[Probed], key: str) -> SceneError:
    names = ", ".join(repr(b.body.name) for b in bodies)
    return fault(key, f"lies in {names}: name one with `body`")


def _extent(run: Probed) -> str:
    nodes, shape = run.system.geometry.nodes, run.body.shape
    said = f"{run.body.name!r} reaches from {rounded(nodes.min(0))} to {rounded(nodes.max(0))} m"
    corners = nodes if shape is None or run.system.geometry.mapped else shape.corners()
    low, high = corners.min(0), corners.max(0)
    if np.allclose([low, high], [nodes.min(0), nodes.max(0)], rtol=1e-6, atol=1e-6 * np.ptp(nodes)):
        return said
    return f"{said} with its cells, and its shape from {rounded(low)} to {rounded(high)} m"


def _at(points: np.ndarray, key: str, bodies: Sequence[Probed]) -> tuple[Probed, Places]:
    """The body that holds the points (n, dim) [m] of a probe, and how a field is read at each."""
    there = [b for b in bodies if inside(b.body, b.system.geometry, points).all()]
    if not there:
        text = f"{points.tolist()} does not lie in one body; {'; '.join(map(_extent, bodies))}"
        raise fault(f"{key}.at", text)
    if len(there) > 1:
        raise _several(there, f"{key}.at")
    reading = there[0].reading

    def read(name: str) -> list[list[Averages]]:
        try:
            found = reading.sample(points, name)
        except ValueError as error:
            raise fault(f"{key}.at", f"{error}: name a point beside it") from None
        for empty in np.flatnonzero(np.diff(found[0].offsets) == 0):
            text = f"{points[empty].tolist()} is too far from every place where {name!r} stands: name a point inside the cells"
            raise fault(f"{key}.at", text)
        return [[each.only(np.array([k])) for each in found] for k in range(len(points))]

    return there[0], read


def selected(
    probe: Probe, text: str, key: str, bodies: Sequence[Probed], formulas: Formulas
) -> tuple[Probed, Places, Sizes, Sizes]:
    """The body of which a probe selects places, and how those are read that a field stands at. Between the particles, where
    nothing stands, it selects the middles of the cells."""

    def chosen(run: Probed, name: str) -> np.ndarray:
        # Where stresses have places of their own, those are selected.
        return np.flatnonzero(select(text, run.reading.where(name), run.system.spacing))

    def within(run: Probed) -> np.ndarray:
        return select(text, run.system.geometry.cells, run.system.spacing)

    def middles(run: Probed) -> np.ndarray:
        return run.system.geometry.cells[within(run)]

    wanted = {"velocity", *(base for name in probe.fields for base in fields.primitives(name, formulas))}
    hit = [run for run in bodies if any(len(chosen(run, name)) for name in wanted.intersection(run.reading.fields))]
    between = not hit
    hit = hit or [run for run in bodies if len(middles(run))]
    if not hit:
        among = "; ".join(map(_extent, bodies))
        raise fault(f"{key}.where", f"{probe.where!r} selects no particle; {among}")
    if len(hit) > 1:
        raise _several(hit, f"{key}.where")
    run = hit[0]

    def read(name: str) -> list[list[Averages]]:
        if between:
            return [run.reading.sample(middles(run), name)]
        there = chosen(run, name)
        if not len(there):
            where = "at the points inside the cells" if run.reading.apart(name) else "at the particles"
            raise fault(
                f"{key}.where",
                f"{probe.where!r} selects no place of {name!r}, which stands {where} of body {run.body.name!r}: widen it by half"
                f" a spacing ({0.5 * run.system.spacing:.6g} m), or name points with `at`, which reads every field at any point",
            )
        return [run.reading.at_places(there, name)]

    def sizes(name: str) -> np.ndarray:
        geometry = run.system.geometry
        return geometry.cell_volume[within(run)] if between else run.reading.volumes(name)[chosen(run, name)]

    def stand(name: str) -> np.ndarray:
        return middles(run) if between else run.reading.where(name)[chosen(run, name)]

    return run, read, sizes, stand


class PointRecorder(Recorder):
    """A probe of fields. A row has c columns: for each point, the components of each primitive field. A column is the sum,
    or the largest, of what is read at entries, e of them in all, each an average over places.

    _columns  # (c + 1,) int32, where the entries of each column begin
    _share    # (c,) scalar, factor of the entries of a column
    _bounded  # (c,) int32, whether an entry stays within the range of its places
    _offsets  # (e + 1,) int32, where the terms of each entry begin
    _place    # (terms,) int32, an index into the buffers of the state and of its derived fields
    _weight   # (terms,) scalar
    """

    def __init__(
        self,
        probe: Probe,
        key: str,
        bodies: Sequence[Probed],
        space: Space,
        clock: Clock,
        every_step: bool,
        formulas: Formulas,
    ):
        self._space, self._formulas = space, formulas
        able = [b for b in bodies if probe.body in (None, b.body.name)]
        if DENSITY in probe.fields:
            text = f"the density cannot be probed in the {able[0].system.formulation} form; frames carry it"
            raise fault(f"{key}.fields", text)
        if probe.points is not None:
            body, places = _at(np.array(probe.points), key, able)
        else:
            body, places, *_ = selected(probe, probe.where or "", key, able, formulas)
        self._reading = reading = body.reading
        self._primitives = sorted({base for name in probe.fields for base in fields.primitives(name, formulas)})
        for name in (name for name in self._primitives if name not in reading.fields):
            raise no_field(body, name, key)
        read = {name: places(name) for name in self._primitives}
        self.points = len(read[self._primitives[0]])
        made = [
            self._column(probe, name, c, read[name][k][c])
            for k in range(self.points)
            for name in self._primitives
            for c in range(reading.fields[name].width)
        ]
        super().__init__(probe, clock, len(made), space.scalar, every_step=every_step)
        entries = [np.diff(each.offsets) for _, _, each in made]
        kinds = (
            (np.cumsum([0, *map(len, entries)]), wp.int32),
            ([share for share, _, _ in made], space.scalar),
            ([int(bounded) for _, bounded, _ in made], wp.int32),
            (np.cumsum([0, *np.concatenate(entries)]), wp.int32),
            (np.concatenate([each.places for _, _, each in made]), wp.int32),
            (np.concatenate([each.weights for _, _, each in made]), space.scalar),
        )
        arrays = [wp.array(numbers, dtype=kind, device=clock.device) for numbers, kind in kinds]
        self._columns, self._share, self._bounded, self._offsets, self._place, self._weight = arrays

    def _column(self, probe: Probe, name: str, component: int, read: Averages) -> tuple[float, bool, Averages]:
        """A column's factor, whether its entries are bounded, and the entries, over the buffers."""
        share = 1.0 / read.count if probe.reduce == "mean" else 1.0
        # Where no weight is negative an average is within the range of its places by itself.
        bounded = self._reading.fields[name].bounded and bool((read.weights < 0.0).any())
        if probe.reduce in ("mean", "sum") and not bounded:
            read, share = read.together(share), 1.0
        return share, bounded, Averages(read.offsets, self._reading.index(name, read.places, component), read.weights)

    def record(self) -> None:
        """Store the current values in the ring (a launch)."""
        inputs = [self._clock.step, self._columns, self._share, self._bounded, self._offsets, self._place, self._weight]
        inputs += [*self._reading.buffers, int(self.probe.reduce == "max")]
        self._clock.launch(record_kernel(self._space), self._ring.shape[1], inputs, [self._ring])

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
            if name in self._formulas:
                places = np.array(self.probe.points)
                series = self._formulas[name].of(values, reading.labels, places)
                result |= {name if self.points == 1 else f"{name}[{k}]": series[:, k] for k in range(self.points)}
                continue
            for column in fields.columns(name, reading.labels, self._space.dim):
                series = fields.component(column, values[fields.primitive(column)], reading.labels)
                for k in range(self.points):
                    result[column if self.points == 1 else f"{column}[{k}]"] = series[:, k]
        return result

    @property
    def units(self) -> dict[str, str]:
        names: list[str] = []
        for name in self.probe.fields:
            names += [name] if name in self._formulas else fields.columns(name, self._reading.labels, self._space.dim)
        each = [(name, unit_of(name, self._reading, self._formulas)) for name in names]
        return {name if self.points == 1 else f"{name}[{k}]": unit for name, unit in each for k in range(self.points)}
