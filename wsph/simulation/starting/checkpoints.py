"""The checkpoints of one run: what of it is kept, put away and put back (`wsph.simulation.checkpoint` has their files)."""

# pyright: strict

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wsph.errors import CheckpointError
from wsph.output.folder import OutputFolder
from wsph.protocols import DeviceArray
from wsph.ranks.kept import Piece, Rows
from wsph.simulation.checkpoint import BodyFacts, Facts, Found, digests, identity, listed, remove, write
from wsph.simulation.checks import Checks
from wsph.simulation.composing.composition import BodyRun, Composition
from wsph.simulation.ledger import Ledger
from wsph.simulation.probing.records import Records
from wsph.simulation.starting import shards
from wsph.simulation.starting.carried import Carried
from wsph.simulation.starting.relaxations import Relaxations
from wsph.simulation.starting.shards import Shards
from wsph.simulation.starting.source import here
from wsph.simulation.step_control import StepControl
from wsph.simulation.timeline import Events


def kept(composition: Composition) -> dict[str, DeviceArray]:
    """The device arrays that a run goes on from, by name."""
    found: dict[str, DeviceArray] = {"clock.step": composition.clock.step, "clock.time": composition.clock.time}
    for number, run in enumerate(composition.bodies):
        found |= {f"body{number}.{name}": array for name, array in run.system.arrays.kept.items()}
    for interaction in composition.between:
        found.update(interaction.kept())
    return found


def _pieces(composition: Composition, arrays: Mapping[str, np.ndarray]) -> dict[str, list[Piece]]:
    """Where what this process keeps, `arrays`, stands in those of all that share the scene."""
    domain = composition.domain
    found = {name: [Piece(0, 0, Rows.alike(len(array), domain))] for name, array in arrays.items()}
    for number, run in enumerate(composition.bodies):
        if run.system.domain.size > 1:
            found |= {f"body{number}.{name}": pieces for name, pieces in run.system.pieces().items()}
    couplings = composition.joint.couplings if composition.joint is not None else ()
    for each in (*composition.between, *couplings):
        found |= {name: [Piece(0, 0, Rows.of(share))] for name, share in each.shares().items()}
    return found


def restore(path: Path | None, composition: Composition, arrays: Mapping[str, np.ndarray]) -> None:
    """Put the arrays of a checkpoint back. Raises CheckpointError where they are not those of the composition."""
    for coupling in composition.joint.couplings if composition.joint is not None else ():
        coupling.as_kept(arrays)
    device, shared = kept(composition), composition.domain.size > 1
    pieces = _pieces(composition, {name: array.numpy() for name, array in device.items()}) if shared else {}
    for name, array in device.items():
        value, wanted = here(arrays, name, pieces.get(name)), array.numpy().shape
        if value is None or value.shape != wanted:
            shape = "absent" if value is None else f"of shape {value.shape}"
            raise CheckpointError(f"{path}: {name} is {shape}, not of shape {wanted}: of another composition")
        array.assign(value)
    for run in composition.bodies:
        run.system.restored()
    for interaction in composition.between:
        interaction.restored()


def _body_facts(number: int, run: BodyRun) -> BodyFacts:
    """Where the state of a body stands, in the array of all processes."""
    state, scales = run.system.state, run.system.scales
    shares, start, fields = (run.system.share, run.system.point_share), 0, dict[str, list[int]]()
    for name in state.start:
        own = next((each for each in shares if each.held == state.counts[name]), None)
        count, width = state.counts[name] if own is None else own.whole, state.widths[name]
        fields[name] = [start, count, width]
        start += count * width
    return {
        "number": number,
        "formulation": run.system.formulation,
        "scales": [scales.length, scales.time, scales.density],
        "array": f"body{number}.state0",
        "fields": fields,
    }


class Checkpoints:
    """Checkpoints of one run: when each is due, what it holds, and its file in the run's folder."""

    def __init__(
        self,
        composition: Composition,
        folder: OutputFolder | None,
        ledger: Ledger,
        checks: Checks,
        control: StepControl,
        records: Records,
        relaxations: Relaxations,
    ):
        self._relaxations, self._relaxed = relaxations, 0
        self._domain = composition.domain
        self._composition, self._folder, self._ledger = composition, folder, ledger
        self._files = digests(composition.scene)
        self._checks, self._control, self._records = checks, control, records
        self._timeline = composition.time_step.timeline
        self._settings = settings = composition.scene.checkpoint
        self._written = time.perf_counter()
        self._events = None
        if settings is not None and isinstance(settings.every, int):
            self._events = Events(settings.every, self._timeline)
            self._events.skip(0)

    def due(self) -> list[int]:
        """Steps at which one is due that a block of steps has to end at."""
        return [self._events.next] if self._events is not None else []

    def keep(self, step: int, asked: bool = False) -> None:
        """Write one, where it is due or the run is asked to end."""
        if self._folder is None:
            return
        settings, due = self._settings, asked
        if self._events is not None:
            due |= self._events.next <= step
            self._events.skip(step)
        elif settings is not None and settings.every is not None:
            every = settings.every
            due |= self._domain.told(lambda: self._late(every))
        ended = step >= self._timeline.last
        if not (settings is not None and settings.final) if ended else not due:
            return
        self._written = time.perf_counter()
        self._write(step)

    def _late(self, every: float) -> bool:
        """Whether the last one was written longer ago than it is to be [s]."""
        return time.perf_counter() - self._written > every

    def keep_relaxing(self, step: int, asked: bool = False) -> None:
        """The same after steps of a relaxation before a step, which an integer counts as it counts those of the run."""
        relaxation, settings = self._relaxations.current, self._settings
        if self._folder is None or relaxation is None:
            return
        due = asked
        if settings is not None and isinstance(settings.every, int):
            due |= relaxation.steps // settings.every > self._relaxed // settings.every
        elif settings is not None and settings.every is not None:
            every = settings.every
            due |= self._domain.told(lambda: self._late(every))
        self._relaxed = relaxation.steps
        if due:
            self._written = time.perf_counter()
            self._write(step)

    def carried(self, step: int) -> Found:
        """One of a step that is not written: what processes that share the scene go on from with other parts of it."""
        facts, arrays, recorded = self._taken(step)
        mine = {name: array.copy() for name, array in arrays.items()}
        return None, facts, Carried(self._domain, mine, self._pieces(arrays), recorded)

    def _pieces(self, arrays: Mapping[str, np.ndarray]) -> dict[str, list[Piece]]:
        return _pieces(self._composition, arrays) | self._relaxations.pieces()

    def _taken(self, step: int) -> tuple[Facts, dict[str, np.ndarray], dict[str, np.ndarray]]:
        """What the checkpoint of a step says, its arrays, and those of what has been recorded."""
        recorded, probes = self._records.kept()
        device = kept(self._composition) | self._relaxations.arrays()
        arrays = {name: array.numpy() for name, array in device.items()}
        facts: Facts = {
            "identity": identity(self._composition.scene, self._files),
            "step": step,
            "initial": self._ledger.initial.hex(),
            "begun": [value.hex() for value in self._ledger.begun],
            "taken": self._ledger.taken.hex(),
            "relax": self._relaxations.kept(),
            "bodies": {run.body.name: _body_facts(k, run) for k, run in enumerate(self._composition.bodies)},
            "frames": self._folder.times if self._folder is not None else [],
            "probes": probes,
            **self._checks.kept(),
            **self._control.kept(),
        }
        return facts, arrays, recorded

    def _write(self, step: int) -> None:
        """Write the checkpoint of a step."""
        assert self._folder is not None
        settings = self._settings
        facts, arrays, recorded = self._taken(step)
        shared, folder = self._domain.size > 1, self._folder.folder / "checkpoints"
        self._records.write_tables()
        if shared:
            facts["shards"] = self._shards(folder, step, arrays)
        if self._domain.rank == 0:
            keep = settings.keep if settings is not None else 2
            write(folder, step, facts, recorded if shared else arrays | recorded, keep)
        self._domain.common(())  # all go on when it is there

    def _shards(self, folder: Path, step: int, arrays: Mapping[str, np.ndarray]) -> Shards:
        """Write the shard of this process; what a checkpoint says of all, which are whole then."""
        pieces = self._pieces(arrays)
        rank = self._domain.rank
        digest = shards.write(folder, shards.name_of(step, rank), arrays, pieces)
        digests: list[str] = self._domain.joined(np.array([digest])).tolist()
        names = [[shards.name_of(step, by), each] for by, each in enumerate(digests)]
        return {"files": names, "arrays": shards.described(arrays, pieces)}

    def resume(self, found: Found) -> int:
        """Restore a checkpoint; returns its step. Raises CheckpointError."""
        path, facts, arrays = found
        step = facts["step"]
        self._control.restore(facts)
        if step >= self._timeline.last:
            way = "raise run.end" if self._composition.scene.run.end is not None else "it is complete"
            raise CheckpointError(f"{path}: stands at step {step}; the run ends at step {self._timeline.last}: {way}")
        self._relaxations.restore(facts["relax"], step, arrays)
        restore(path, self._composition, arrays)
        for later in listed(path.parent) if path is not None else []:
            if path is not None and later.name > path.name and self._domain.rank == 0:
                remove(later)  # damaged, or this would not be the last: they would take the places of those to come
        self._relaxed = self._relaxations.current.steps if self._relaxations.current is not None else 0
        if step == 0 and self._relaxations.current is not None:
            return step  # Nothing has been recorded.
        self._ledger.initial = float.fromhex(facts["initial"])
        self._ledger.taken = float.fromhex(facts["taken"])
        self._ledger.begun = [float.fromhex(value) for value in facts["begun"]]
        self._checks.restore(facts)
        self._records.restore(step, facts["probes"], arrays)
        if self._events is not None:
            self._events.skip(step)
        return step
