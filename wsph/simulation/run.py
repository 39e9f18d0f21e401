"""Running a scene: blocks of steps between events, checks, records, output."""

import importlib.util
import platform
import signal
import threading
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

from wsph.errors import CheckpointError, OutputError, Unstable
from wsph.output import fields
from wsph.output.files import check_writable
from wsph.output.folder import OutputFolder
from wsph.plugins import registry
from wsph.scene.load import load
from wsph.scene.scene import Scene
from wsph.simulation import checkpoint
from wsph.simulation.compose import compose
from wsph.simulation.composition import BodyRun, Composition
from wsph.simulation.diagnostics import Ledger
from wsph.simulation.interrupts import Interrupts
from wsph.simulation.probes import RING, Recorder
from wsph.simulation.result import Result
from wsph.simulation.step_control import Watch, warn
from wsph.simulation.timeline import Events, Timeline

CHECK_STEPS = 100
"""Steps between checks where steps are not captured in blocks; those are checked at the end of a block. A check costs about
half a step (tests/benchmarks/guards.py)."""

HISTORY_ROWS = 100

Found = tuple[Path, dict[str, Any], dict[str, np.ndarray]]
"""A checkpoint: its file, its facts and its arrays."""

_ONE_RUN = threading.RLock()
ENERGY_WARNING, LOSS_WARNING, ENERGY_AFTER = 0.02, 0.10, 20

TABLE_SECONDS = 5.0
"""With frames, tables are written at most this often, and at the end: each time all their rows."""


def run(scene: Scene | str | Path, out: str | Path | None = None, *, overwrite: bool = False, resume: bool = False, throw: bool = True,
        progress: Callable[[int, int, float], None] | None = None, **overrides: Any) -> Result:  # fmt: skip
    """Run a scene (or a scene file) and return its result; with `out`, write the output folder too.

    With `resume` it goes on from the last checkpoint in `out`, which must fit the scene: the bits of never having stopped.
    `overrides` are those of `Scene.with_`. `progress(step, steps, time)` is called between blocks of steps. Raises
    SceneError, Refused, PluginError or OutputError before anything is written, and Unstable where the run left what it
    can vouch for, unless `throw` is False: then the result says so. SIGINT and SIGTERM end the run after a whole step,
    the folder is written, and the signal takes its course (a KeyboardInterrupt); with `throw` False the result says
    "interrupted". Runs of one process, from any thread, follow one another.
    """
    if isinstance(scene, (str, Path)):
        scene = load(scene)
    if overrides:
        scene = scene.with_(**overrides)
    folder = Path(out) if out is not None else None
    if folder is not None:
        check_writable(folder, overwrite, resume)
        if "xdmf" in scene.output.formats and importlib.util.find_spec("h5py") is None:
            raise OutputError('the format xdmf needs h5py: pip install "wsph[xdmf]"')
    started = time.perf_counter()
    found = _last_checkpoint(scene, folder, overwrite) if resume else None
    # Capturing a graph takes in what any thread launches: runs of one process follow one another.
    with _ONE_RUN, np.errstate(over="ignore", invalid="ignore"):  # the finite check speaks, numpy need not
        composition = compose(scene)
        composition.compile()
        result, asked = Simulation(composition, folder, started, found).run(progress)
    if throw and result.failure is not None:
        raise result.failure
    if throw and asked:
        signal.raise_signal(asked)
    return result


def _last_checkpoint(scene: Scene, folder: Path | None, overwrite: bool) -> Found:
    """The last checkpoint in a folder, whole and of this scene. Raises CheckpointError."""
    if folder is None or overwrite:
        raise CheckpointError(
            "resuming goes on in the output folder and keeps what is there: name the folder, without overwrite"
        )
    files = checkpoint.listed(folder / "checkpoints")
    if not files:
        raise CheckpointError(f"{folder}: holds no checkpoint to resume from; run without --resume")
    facts, arrays = checkpoint.read(files[-1])
    checkpoint.refuse_other(files[-1], facts, scene)
    return files[-1], facts, arrays


class Simulation:
    """One run in progress."""

    def __init__(self, composition: Composition, folder: Path | None, started: float, found: Found | None = None):
        self.c = composition
        self.scene = composition.scene
        self._started = started
        self._time = Timeline(self.scene.run.end, composition.dt)
        self._last = self._time.last
        self._inside = 0.0
        output = self.scene.output
        self._found, frames = found, found[1]["frames"] if found is not None else None
        self._writer = OutputFolder(folder, output.formats, self.scene.dim, frames) if folder is not None else None
        self._first, self._kept_at = 0, started
        every = self.scene.checkpoint.every if self.scene.checkpoint is not None else None
        self._checkpoints = Events(every, self._time) if isinstance(every, int) else None
        if self._checkpoints is not None:
            self._checkpoints.skip(0)
        history = output.history or max(self._last // HISTORY_ROWS, 1)
        self._history = Events(history, self._time)
        self._frames = Events(output.every, self._time)
        self._slow = [(p, Events(p.probe.every, self._time)) for p in composition.probes if not p.every_step]
        self._fast = [(p, Events(p.probe.every, self._time)) for p in composition.probes if p.every_step]
        self._watch = Watch(composition, self._time)
        self._rows: list[list[float]] = []
        self._largest = 0.0
        self._warned = False
        self._stiffening = 0.0
        self._written = 0.0
        s = composition.scales
        self._energy = s.stress * s.length**self.scene.dim
        self._impulse = s.density * s.length**self.scene.dim * s.velocity
        self._units = {"velocity": s.velocity, "stress": s.stress, "displacement": s.length, "damage": 1.0}

    def run(self, progress: Callable[[int, int, float], None] | None) -> tuple[Result, int]:
        """Run to the end, to a failure or to an interrupt: the result, and the signal that asked for it or 0."""
        status, reason, failure = "completed", "", None
        step = 0 if self._found is None else self._resume(*self._found)
        for probe in (p for p, _ in self._fast if step == 0):
            probe.record()
        with Interrupts() as interrupts:
            try:
                if step == 0:
                    ledgers = self._check(step)
                    self._initial = self._total(ledgers)
                    self._handle(step, ledgers)
                while step < self._last and not interrupts.asked:
                    block = self._block(step)
                    self.c.program.prepare(block)
                    before = time.perf_counter()
                    step += self.c.program.run(block, lambda: bool(interrupts.asked))
                    wp.synchronize_device(self.c.device)
                    self._inside += time.perf_counter() - before
                    self._collect(step)
                    self._handle(step, self._check(step))
                    self._keep(step)
                    if progress is not None:
                        progress(step, self._last, self._time.time(step))
                if interrupts.asked and step < self._last:
                    # First what is kept: a run that goes on from there has the records of one that never stopped.
                    self._keep(step, asked=True)
                    self._handle(step, self._check(step), final=True)
            except Unstable as error:
                # Energy that grew is a stop that the scene asks for; a state that is not finite is not.
                status, reason, failure = "stopped" if error.field == "energy" else "unstable", str(error), error
            if interrupts.asked and failure is None and step < self._last:
                status, reason = "interrupted", f"interrupted at step {step}"
        return self._finish(step, status, reason, failure), interrupts.asked

    def _block(self, step: int) -> int:
        """Steps until something is due, or the rings are full, or the state has to be checked."""
        program = self.c.program
        events = [self._history, self._frames, *(e for _, e in self._slow)]
        if self._checkpoints is not None:
            events.append(self._checkpoints)
        due = [e.next for e in events if e.next > step]
        if self._watch.adapts:
            due.append(self._watch.look)
        return min(min([self._last, *due]) - step, RING if program.batched else CHECK_STEPS)

    def _keep(self, step: int, asked: bool = False) -> None:
        """Write a checkpoint, where one is due or the run is asked to end."""
        if self._writer is None:
            return
        settings = self.scene.checkpoint
        due = asked
        if self._checkpoints is not None:
            due |= self._checkpoints.next <= step
            self._checkpoints.skip(step)
        elif settings is not None:
            due |= time.perf_counter() - self._kept_at > settings.every
        if not due or step >= self._last:
            return
        self._kept_at = time.perf_counter()
        arrays = {name: array.numpy() for name, array in checkpoint.kept(self.c).items()}
        arrays["history"] = np.array(self._rows)
        probes = {}
        for number, recorder in enumerate(self.c.probes):
            arrays[f"probe{number}"], probes[number] = recorder.kept()
        facts = {
            "identity": checkpoint.identity(self.scene),
            "step": step,
            "initial": self._initial.hex(),
            "largest": self._largest.hex(),
            "warned": self._warned,
            "frames": self._writer.times,
            "timeline": self._time.pieces,
            "watch": self._watch.kept(),
            "probes": [[p.probe.model_dump_json(), probes[k]] for k, p in enumerate(self.c.probes)],
        }
        self._write_tables()
        checkpoint.write(
            self._writer.folder / "checkpoints", step, facts, arrays, settings.keep if settings is not None else 2
        )

    def _resume(self, path: Path, facts: dict[str, Any], arrays: dict[str, np.ndarray]) -> int:
        """Put back what a checkpoint holds; the step that it was made at."""
        step = facts["step"]
        self._time.pieces[:] = [tuple(piece) for piece in facts["timeline"]]
        self._last = self._time.last
        self._watch.restore(facts["watch"])
        if step >= self._last:
            raise CheckpointError(f"{path}: stands at step {step}; the run ends at step {self._last}: raise run.end")
        checkpoint.restore(path, self.c, arrays)
        self._initial, self._largest = float.fromhex(facts["initial"]), float.fromhex(facts["largest"])
        self._warned, self._first = facts["warned"], step
        self._rows = arrays["history"].tolist()
        there = {name: (k, steps) for k, (name, steps) in enumerate(facts["probes"])}
        for recorder, events in (*self._slow, *self._fast):
            if (known := there.get(recorder.probe.model_dump_json())) is not None:
                recorder.go_on(arrays[f"probe{known[0]}"], known[1])
            else:
                warn(f"probe {recorder.probe.name!r} is not one of the checkpoint's: its record begins at step {step}")
            events.skip(step)
        for events in (self._history, self._frames, *([self._checkpoints] if self._checkpoints is not None else [])):
            events.skip(step)
        return step

    def _check(self, step: int) -> list[Ledger]:
        """The ledgers, after the finite check and the energy stop."""
        if step > 0:
            self.c.publish()
        else:
            for run in self.c.bodies:
                run.system.refresh(run.system.state)
        ledgers = [run.diagnostics.measure(run.system.state) for run in self.c.bodies]
        self._stiffening = sum(e.value() for run in self.c.bodies for e in run.system.ledger if e.column == "hourglass")
        for run, ledger in zip(self.c.bodies, ledgers, strict=True):
            if ledger.bad >= 0:
                name, what = self._broken(run, ledger.bad)
                raise self._watch.unstable(step, run, name, what, ledger.bad, run.system.position[ledger.bad])
        self._watch.check_limits(step, ledgers)
        if step > ENERGY_AFTER:
            total, work = self._total(ledgers), self._work()
            self._largest = max(self._largest, abs(total), abs(work))
            created = (total - work) / self._largest if self._largest > 0.0 else 0.0
            if created > self.scene.stop.energy:
                self._row(step, ledgers)
                share, bound = f"{100 * created:.3g} %", f"{self.scene.stop.energy:g}"
                what = f"energy was created: {share} of the largest seen, beyond stop.energy = {bound}"
                raise self._watch.unstable(step, self.c.bodies[0], "energy", what)
            if created > ENERGY_WARNING and not self._warned:
                self._warned = True
                warn(f"step {step}: energy was created, {100 * created:.3g} % of the largest seen")
            if step == self._last and -created > LOSS_WARNING:
                warn(f"energy was lost by the end, {-100 * created:.3g} % of the largest seen: numerical dissipation")
        if self._watch.follow(step, ledgers):
            self._last = self._time.last
            for events in (self._history, self._frames, *(e for _, e in (*self._slow, *self._fast))):
                events.retimed()
        self._watch.clump(step)
        return ledgers

    def _broken(self, run: BodyRun, particle: int) -> tuple[str, str]:
        """What is wrong with a particle's state: field and words."""
        state = run.system.state
        finite = all(np.isfinite(state.read(name)[particle]).all() for name in ("velocity", "stress"))
        if finite and "deformation" in state.widths:
            return "deformation", "has turned it inside out (J <= 0)"
        return "velocity or stress", "is not finite" if not finite else "is too large to square"

    def _dissipated(self, ledgers: list[Ledger]) -> float:
        systems = [run.system for run in self.c.bodies]
        parts = (sum(e.value() for e in s.ledger if e.column == "dissipated") for s in systems)
        return sum(e.dissipated for e in ledgers) + sum(parts)

    def _total(self, ledgers: list[Ledger]) -> float:
        held = self._stiffening + self._contact()
        return sum(e.kinetic + e.strain for e in ledgers) + self._dissipated(ledgers) + held

    def _contact(self) -> float:
        """Energy that contacts have taken from the bodies."""
        return self.c.contacts.energy if self.c.contacts is not None else 0.0

    def _work(self) -> float:
        """Work done on the bodies, what they started with included."""
        held = self.c.contacts.held_work if self.c.contacts is not None else 0.0
        return (
            self._initial + held + sum(run.system.work.total + run.system.force.gravity_work for run in self.c.bodies)
        )

    def _collect(self, step: int) -> None:
        """Read what the rings hold up to `step`."""
        for probe, events in self._fast:
            due = []
            while events.next <= step:
                due.append(events.next)
                events.advance()
            probe.flush(due)

    def _handle(self, step: int, ledgers: list[Ledger], final: bool = False) -> None:
        """Everything that is due at `step`; where the run ends early (`final`), what is due at its end."""
        if step == 0:
            self._collect(0)
        if self._history.next <= step or final:
            self._row(step, ledgers)
            self._history.advance()
        for probe, events in self._slow:
            if events.next <= step or final:
                probe.record()
                probe.flush([step])
                events.advance()
        if self._frames.next <= step or final:
            self._frames.advance()
            if self._writer is not None:
                everything = self._fields(self.scene.output.fields)
                moved = np.concatenate([run.system.current_position() for run in self.c.bodies])
                self._writer.frame(
                    self._time.time(step), moved, {k: v for k, v in everything.items() if k != "position"}
                )
                if time.perf_counter() - self._written > TABLE_SECONDS:
                    self._write_tables()

    def _row(self, step: int, ledgers: list[Ledger]) -> None:
        """Append a row of the history; at most one a step."""
        if self._rows and self._rows[-1][0] == step:
            return
        total, work = self._total(ledgers), self._work()
        sums = [
            sum(e.kinetic for e in ledgers),
            sum(e.strain for e in ledgers),
            self._dissipated(ledgers),
            self._stiffening,
            self._contact(),
        ]
        momentum = sum(e.momentum for e in ledgers)
        energies = [x * self._energy for x in (*sums, work, work - total)]
        self._rows.append([step, self._time.time(step), self._time.dt, *energies, *(momentum * self._impulse)])

    def _write_tables(self) -> None:
        self._written = time.perf_counter()
        if self._writer is not None:
            self._writer.table("history.csv", self._history_columns())
            for probe in self.c.probes:
                self._writer.table(f"probes/{probe.probe.name}.csv", self._probe_columns(probe))

    def _history_columns(self) -> dict[str, np.ndarray]:
        names = [
            "step",
            "time",
            "dt",
            "kinetic",
            "strain",
            "dissipated",
            "hourglass",
            "contact",
            "external_work",
            "residual",
        ]
        names += [f"momentum_{axis}" for axis in "xyz"[: self.scene.dim]]
        table = np.array(self._rows).reshape(len(self._rows), len(names))
        return {name: table[:, k].astype(int) if name == "step" else table[:, k] for k, name in enumerate(names)}

    def _probe_columns(self, probe: Recorder) -> dict[str, np.ndarray]:
        scales = self._units | probe.body.constitutive.internal_scales
        columns = probe.columns(scales, probe.body.density * self.c.scales.density)
        return {"time": self._time.times(probe.steps), **columns}

    def _fields(self, names: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Fields of all bodies, SI, with position, id and body."""
        parts: dict[str, list[np.ndarray]] = {}
        wanted = {fields.primitive(name) for name in names}
        first = 0
        for number, run in enumerate(self.c.bodies):
            system, labels = run.system, run.constitutive.state.labels
            n = system.count
            values = {name: system.filtered(name) * self._units[name] for name in system.state.widths if name in wanted}
            own = [name for name in run.constitutive.internals if name in wanted]
            if own:
                internals, order = system.filtered("internals"), list(run.constitutive.internals)
                for name in own:
                    values[name] = internals[:, [order.index(name)]] * run.constitutive.internal_scales[name]
            values["density"] = system.current_density()[:, None] * self.c.scales.density
            parts.setdefault("position", []).append(system.position)
            for name in (n for n in names if n not in fields.ALWAYS):
                base = values.get(fields.primitive(name))
                if base is None:
                    parts.setdefault(name, []).append(np.full(n, np.nan))
                elif name == "stress":
                    parts.setdefault(name, []).append(fields.tensor(base, labels))
                elif name in ("velocity", "displacement"):
                    parts.setdefault(name, []).append(base)
                else:
                    parts.setdefault(name, []).append(fields.component(name, base, labels))
            parts.setdefault("id", []).append(np.arange(first, first + n))
            parts.setdefault("body", []).append(np.full(n, number))
            first += n
        return {name: np.concatenate(values) for name, values in parts.items()}

    def _fracture(self) -> dict[str, dict[str, float]]:
        """Of every body that can break: the energy set free and that of the crack surfaces [J], and broken particles."""
        found = {}
        for run in (run for run in self.c.bodies if run.system.breaks):
            parts = run.system.fracture()
            found[run.body.name] = {k: v * self._energy if "energy" in k else v for k, v in parts.items()}
        return found

    def _finish(self, step: int, status: str, reason: str, failure: Unstable | None) -> Result:
        wall = time.perf_counter() - self._started
        columns = self._history_columns()
        last = {name: float(values[-1]) if len(values) else 0.0 for name, values in columns.items()}
        evaluations = getattr(self.c.bodies[0].integrator, "evaluations", 1)
        summary: dict[str, Any] = {
            "status": status,
            "reason": reason,
            "steps": step,
            "time": self._time.time(step),
            "dt": self._time.dt,
            "particles": self.c.particles,
            "pairs": self.c.pairs,
            "right_hand_sides": step * evaluations,
            "wall_seconds": wall,
            "particle_steps_per_second": self.c.particles * (step - self._first) / self._inside
            if self._inside > 0.0
            else 0.0,
            "bytes_per_particle": sum(r.system.nbytes for r in self.c.bodies) / self.c.particles,
            # external_work includes what the bodies started with: the residual is it less all the others.
            "energy": {
                **{name: last[name] for name in ("kinetic", "strain", "dissipated", "hourglass", "contact")},
                "external_work": last["external_work"],
                "residual": last["residual"],
            },
            **({"fracture": self._fracture()} if any(r.system.breaks for r in self.c.bodies) else {}),
            # Of the last good state: where the run ended in a state that is not finite, before its last step.
            "energy_step": int(last["step"]),
            "momentum": [last[f"momentum_{axis}"] for axis in "xyz"[: self.scene.dim]],
            "device": self.c.device,
            "versions": {
                name: metadata.version(package)
                for name, package in (("wsph", "wsph"), ("warp", "warp-lang"), ("numpy", "numpy"), ("meshio", "meshio"))
            }
            | {"python": platform.python_version()},
            "plugins": {
                f"integrator {self.scene.run.integrator.name}": registry.origin(
                    "integrators", self.scene.run.integrator.name
                ),
                **{
                    f"material {b.material.model}": registry.origin("materials", b.material.model)
                    for b in self.scene.bodies
                },
            },
            "scene": self.scene.data(),
        }
        probes = {p.probe.name: self._probe_columns(p) for p in self.c.probes}
        if self._writer is not None:
            self._write_tables()
            self._writer.summary(summary)
        wanted = tuple(dict.fromkeys(("velocity", "stress", *self.scene.output.fields)))
        return Result(
            self.scene, status, reason, self._time.time(step), columns, probes, self._fields(wanted), summary, failure
        )
