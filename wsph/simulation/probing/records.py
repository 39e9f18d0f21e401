"""The records of a run: rows of its history, probes, frames; and when each is due."""

# pyright: strict

import time
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from wsph.output import fields
from wsph.output.cells import Cells, Gathered
from wsph.output.fields import Formulas
from wsph.output.folder import OutputFolder
from wsph.simulation.checks import warn
from wsph.simulation.composing.composition import BodyRun, Composition
from wsph.simulation.ledger import Account
from wsph.simulation.probing.numbers import Numbers
from wsph.simulation.probing.recorder import Recorder
from wsph.simulation.summary import TableUnits
from wsph.simulation.timeline import Events

Recorded = tuple[str, list[int]]
"""What a checkpoint holds of a probe: its keys, as JSON, and its steps."""

HISTORY_ROWS = 100

TABLE_SECONDS = 5.0
"""With frames, tables are written at most this often, and at the end: each time all their rows."""


class Records:
    """History, probes and frames of one run. With a folder, frames and tables are written as they come."""

    _framed = -1
    """The step of the last frame."""

    def __init__(self, composition: Composition, energies: Sequence[str], folder: OutputFolder | None):
        """`energies` are the columns of the ledger."""
        self._bodies, self._timeline = composition.bodies, composition.time_step.timeline
        self._probes, self._folder, self._written = composition.probes, folder, 0.0
        scene, scales = composition.scene, composition.scales
        self._formulas = scene.formulas
        self._wanted, self._single = scene.output.fields, composition.space.precision == "f32"
        self._moved, self._dim = scene.output.positions == "current", scene.dim
        axes = [f"momentum_{axis}" for axis in "xyz"[: scene.dim]]
        self._domain = composition.domain
        shared = composition.shared_numbers
        self._numbers = Numbers(composition.reported, scales, scene.dim, self._domain, shared)
        self._names = ["step", "time", "dt", *energies, *axes, *self._numbers.units]
        self._rows: list[list[float]] = []
        self._energy = scales.stress * scales.length**scene.dim
        self._impulse = scales.density * scales.length**scene.dim * scales.velocity
        every = scene.output.history or max(self._timeline.last // HISTORY_ROWS, 1)
        self._history = Events(every, self._timeline)
        self._frames = Events(scene.output.every, self._timeline)
        timed = [(probe, Events(probe.probe.every, self._timeline)) for probe in self._probes]
        self._slow = [(probe, events) for probe, events in timed if not probe.every_step]
        self._fast = [(probe, events) for probe, events in timed if probe.every_step]

    def due(self) -> list[int]:
        """Steps at which something is due that a block of steps has to end at."""
        return [events.next for events in (self._history, self._frames, *(e for _, e in self._slow))]

    def retimed(self) -> None:
        """Recompute the steps at which records are due: the timeline has changed."""
        for events in (self._history, self._frames, *(e for _, e in (*self._slow, *self._fast))):
            events.retimed()

    def begin(self) -> None:
        """Begin to count works, and record the start in the probes that the steps themselves record from then on."""
        self._numbers.open()
        self._begin_probes()
        for probe, _ in self._fast:
            probe.record()

    def _begin_probes(self) -> None:
        for probe in self._probes:
            probe.begin(self._numbers.stood)

    def collect(self, step: int) -> None:
        """Read what the probes of every step hold up to `step`, before they need the room again."""
        for probe, events in self._fast:
            due: list[int] = []
            while events.next <= step:
                due.append(events.next)
                events.advance()
            probe.flush(due)

    def take(self, step: int, account: Account, final: bool = False) -> None:
        """Everything that is due at `step`; where the run ends early (`final`), what is due at its end."""
        if self._history.next <= step or final:
            self.row(step, account)
            self._history.advance()
        for probe, events in self._slow:
            if events.next <= step or final:
                probe.record()
                probe.flush([step])
                events.advance()
        if self._frames.next <= step or final:
            self._frames.advance()
            self.frame(step)

    def end(self, step: int, account: Account) -> None:
        """Record the state at `step`, where the run ends, in place of what was recorded there before it was changed."""
        if self._rows and self._rows[-1][0] == step:
            self._rows.pop()
        self.row(step, account)
        for probe in self._probes:
            probe.again(step)
        if self._framed != step:
            self.frame(step)

    def row(self, step: int, account: Account) -> None:
        """Append a row of the history; at most one a step."""
        if not self._rows or self._rows[-1][0] != step:
            self._rows.append(self._row(step, account))

    def numbers(self, step: int, account: Account) -> dict[str, float]:
        """What a row of the history would hold, by column."""
        return dict(zip(self._names, self._row(step, account), strict=True))

    def _row(self, step: int, account: Account) -> list[float]:
        energies = [value * self._energy for value in account.energies.values()]
        momentum = account.momentum * self._impulse
        times = [step, self._timeline.time(step), self._timeline.dt]
        return [*times, *energies, *momentum, *self._numbers.values()]

    def frame(self, step: int) -> None:
        """Write a frame of the state, which is that after `step`, where there is a format for it."""
        self._framed = step
        if self._folder is None or not self._folder.formats:
            return
        everything = self.particles(self._wanted)
        moved = everything["position"]
        if self._moved:
            moved = np.concatenate([_of_whole(run, run.reading.current_positions) for run in self._bodies])
        fine = 1e-3 * min(run.system.spacing for run in self._bodies)
        if self._single and np.abs(moved).max() * np.finfo(np.float32).eps < fine:
            moved = moved.astype(np.float32)
        data = {name: values for name, values in everything.items() if name != "position"}
        of = "current" if self._moved else "reference"
        self._folder.frame(
            self._timeline.time(step), moved, data, self.units(self._wanted), self.cells(self._wanted), of
        )
        if self._domain.told(lambda: time.perf_counter() - self._written > TABLE_SECONDS):
            self.write_tables()

    @cached_property
    def _gathered(self) -> Gathered | None:
        """The cells of all bodies, None where no body has any."""
        blocks = [_blocks(run) for run in self._bodies]
        if not any(blocks):
            return None
        return Gathered(blocks, [run.system.share.whole for run in self._bodies], self._dim)

    def cells(self, names: Sequence[str]) -> Cells | None:
        """The cells of all bodies: with their body, and those of the fields that stand at points inside, as computed."""
        if self._gathered is None:
            return None
        standing = [
            name
            for name in names
            if name not in fields.ALWAYS
            and any(_inside(run, base) for run in self._bodies for base in fields.primitives(name, self._formulas))
        ]
        parts = [_cell_fields(run, number, standing, self._formulas) for number, run in enumerate(self._bodies)]
        whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        if self._single:
            whole = {name: _single(values) if name not in fields.ALWAYS else values for name, values in whole.items()}
        return self._gathered.having(whole)

    def units(self, names: Sequence[str]) -> dict[str, str]:
        """SI units of fields by their names."""
        found: dict[str, str] = {}
        for name in (name for name in names if name not in fields.ALWAYS):
            if name in self._formulas:
                found[name] = self._formulas[name].unit
                continue
            having = [run.reading for run in self._bodies if fields.primitive(name) in run.reading.names]
            found[name] = having[0].unit(fields.primitive(name)) if having else ""
        return found

    def table_units(self) -> TableUnits:
        """SI units of the columns of the history and of every probe, by name."""
        per = ("/m2", "/m", "")[self._dim - 1]
        units = dict.fromkeys(self._names, f"J{per}")
        units |= {name: f"N s{per}" for name in self._names if name.startswith("momentum_")} | self._numbers.units
        units |= {"step": "1", "time": "s", "dt": "s"}
        probes = {each.probe.name: {"time": "s"} | each.units for each in self._probes}
        return {"history": {name: units[name] for name in self._names}, "probes": probes}

    def write_tables(self) -> None:
        """Write the history and the probes, whole."""
        self._written = time.perf_counter()
        if self._folder is not None:
            self._folder.table("history.csv", self.history())
            for name, columns in self.probes().items():
                self._folder.table(f"probes/{name}.csv", columns)

    def history(self) -> dict[str, np.ndarray]:
        """The columns of history.csv."""
        table = np.array(self._rows).reshape(len(self._rows), len(self._names))
        return {name: table[:, k].astype(int) if name == "step" else table[:, k] for k, name in enumerate(self._names)}

    def probes(self) -> dict[str, dict[str, np.ndarray]]:
        """The columns of every probe, by its name."""
        return {each.probe.name: {"time": self._timeline.times(each.steps), **each.columns()} for each in self._probes}

    def particles(self, names: Sequence[str]) -> dict[str, np.ndarray]:
        """Fields of all bodies' particles, one body after the other, SI, in the precision of the run, with position, id and
        body."""
        parts = [_fields(run, number, names, self._formulas) for number, run in enumerate(self._bodies)]
        whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        if self._single:
            whole = {name: _single(values) if name not in fields.ALWAYS else values for name, values in whole.items()}
        # Of bodies that processes share all but the first have their own rows.
        before = np.cumsum([0, *(run.system.share.whole for run in self._bodies)])
        ids = [
            first + run.system.share.low + np.arange(len(part["body"]))
            for run, first, part in zip(self._bodies, before[:-1], parts, strict=True)
        ]
        return whole | {"id": np.concatenate(ids), "body": whole.pop("body")}

    def kept(self) -> tuple[dict[str, np.ndarray], list[Recorded]]:
        """The records that a checkpoint holds: arrays, and of each probe its keys and its steps."""
        arrays = {"history": np.array(self._rows), "stood": np.array(list(self._numbers.stood.values()))}
        probes = list[Recorded]()
        for number, recorder in enumerate(self._probes):
            arrays[f"probe{number}"], steps = recorder.kept()
            probes.append((recorder.probe.model_dump_json(), steps))
        return arrays, probes

    def restore(self, step: int, probes: Sequence[Recorded], arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from `step` with what `kept` gave. A probe that it does not have begins there."""
        self._rows = arrays["history"].tolist()
        self._numbers.stood = dict(zip(self._numbers.stood, arrays["stood"].tolist(), strict=True))
        self._begin_probes()
        there = {name: (k, steps) for k, (name, steps) in enumerate(probes)}
        timed: list[tuple[Recorder, Events]] = [*self._slow, *self._fast]
        for recorder, events in timed:
            if (known := there.get(recorder.probe.model_dump_json())) is not None:
                recorder.go_on(arrays[f"probe{known[0]}"], known[1])
            else:
                warn(f"probe {recorder.probe.name!r} is not one of the checkpoint's: its record begins at step {step}")
            events.skip(step)
        self._history.skip(step)
        self._frames.skip(step)


def _single(values: np.ndarray) -> np.ndarray:
    """In single precision, unless SI units lead out of what that holds."""
    sizes = np.abs(values[np.isfinite(values) & (values != 0.0)])
    limits = np.finfo(np.float32)
    return values if len(sizes) and not limits.tiny < sizes.max() < limits.max else values.astype(np.float32)


def _fields(run: BodyRun, number: int, names: Sequence[str], formulas: Formulas) -> dict[str, np.ndarray]:
    """Fields of a body's particles by name, NaN where the body has no such field, with position and body."""
    reading = run.reading
    found = _shown(run, names, reading.si, reading.positions, formulas)
    found = {"position": reading.positions, **found, "body": np.full(reading.count, number)}
    return {name: _of_whole(run, values) for name, values in found.items()}


def _of_whole(run: BodyRun, values: np.ndarray) -> np.ndarray:
    """Rows of all particles of a body in the first process, from those (n, ...) of the particles here."""
    system = run.system
    return values if system.share.complete else system.domain.gathered(values[system.share.own])


def _blocks(run: BodyRun) -> Sequence[np.ndarray]:
    """The cells of a body, as `wsph.formulations.reading.Reading.cells` has them, of all of it in the first process."""
    geometry, split = run.system.geometry, run.system.geometry.split
    if split.domain.size == 1 or not run.reading.cells:
        return run.reading.cells
    own = zip(geometry.blocks, geometry.own_cells, strict=True)
    return [split.domain.gathered(corners[mine] + split.nodes.first) for corners, mine in own]


def _cell_fields(run: BodyRun, number: int, names: Sequence[str], formulas: Formulas) -> dict[str, np.ndarray]:
    """The same of a body's cells, without their position."""
    reading = run.reading
    places = [reading.positions[corners].mean(1) for corners in reading.cells] or [reading.positions]
    position = np.concatenate(places)
    found = _shown(run, names, reading.of_cells, position, formulas)
    found = {**found, "body": np.full(len(position), number)}
    geometry, split = run.system.geometry, run.system.geometry.split
    if split.domain.size == 1:
        return found
    if not reading.cells:
        return {name: split.domain.gathered(values[run.system.share.own]) for name, values in found.items()}
    own, ends = geometry.own_cells, np.cumsum([len(corners) for corners in reading.cells])[:-1]
    blocks = {name: zip(np.split(values, ends), own, strict=True) for name, values in found.items()}
    # Block after block, as one process has them.
    return {
        name: np.concatenate([split.domain.gathered(values[mine]) for values, mine in each])
        for name, each in blocks.items()
    }


def _shown(
    run: BodyRun, names: Sequence[str], read: Callable[[str], np.ndarray], position: np.ndarray, formulas: Formulas
) -> dict[str, np.ndarray]:
    """Fields of a body at places (n, dim) of the reference, of primitives that are `read` there."""
    reading, count = run.reading, len(position)
    known = {base for name in names for base in fields.primitives(name, formulas)}.intersection(reading.names)
    # In an order that all processes have: they read a field together.
    values = {name: read(name) for name in sorted(known)}
    found: dict[str, np.ndarray] = {}
    for name in (n for n in names if n not in fields.ALWAYS):
        if name in formulas:
            there = known.issuperset(fields.primitives(name, formulas))
            found[name] = formulas[name].of(values, reading.labels, position) if there else np.full(count, np.nan)
            continue
        base = values.get(fields.primitive(name))
        found[name] = np.full(count, np.nan) if base is None else fields.shown(name, base, reading.labels)
    return found


def _inside(run: BodyRun, name: str) -> bool:
    """Whether a primitive field stands at points inside a body's cells."""
    return name in run.reading.fields and run.reading.apart(name)
