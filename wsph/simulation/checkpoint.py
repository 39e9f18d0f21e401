"""Checkpoints: a run's whole state between two steps, so that going on from there gives the bits of never having stopped.

A file is a line that says what it is, a digest of the rest, and a npz archive: the device arrays of every body, the
clock, what has been recorded so far, and as JSON the scene, the versions and where the run stood. The digest is checked
before anything is read: a file that was cut off or altered is passed over for the one before, with a warning. Files are
data: nothing in them is executed.

A checkpoint fits a scene that differs from its own in `end`, `title`, `threads`, `output`, `fields`, `probes`, `checkpoint`
and `stop` alone, in the same precision and the same versions of wsph, Warp and the plugins. A probe that is the same goes
on; a new one begins there.
"""

# pyright: strict

import hashlib
import io
import json
import re
import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import NotRequired, TypedDict

import numpy as np

from wsph.errors import CheckpointError
from wsph.output.files import write_durably
from wsph.output.folder import OutputFolder
from wsph.output.frames import Listed
from wsph.protocols import DeviceArray
from wsph.quantities import is_list, is_table
from wsph.ranks.kept import Piece, Rows, localised
from wsph.scene.files import file_digests
from wsph.scene.scene import Scene
from wsph.simulation.checks import CheckFacts, Checks
from wsph.simulation.composing.composition import BodyRun, Composition
from wsph.simulation.ledger import Ledger
from wsph.simulation.probing.records import Recorded, Records
from wsph.simulation.starting import shards
from wsph.simulation.starting.assembled import Assembled
from wsph.simulation.starting.relaxations import Relaxations, RelaxationsFacts
from wsph.simulation.starting.shards import Shards
from wsph.simulation.step_control import StepControl, StepFacts
from wsph.simulation.summary import plugins_of
from wsph.simulation.timeline import Events

FIRST = b"wsph checkpoint 5\n"

FREE = (
    ("title",),
    ("run", "end"),
    ("run", "threads"),
    ("output",),
    ("fields",),
    ("probes",),
    ("checkpoint",),
    ("stop",),
)
"""Keys of a scene that a checkpoint leaves open."""


class BodyFacts(TypedDict):
    """Where the state of a body stands in a checkpoint: its `number` in the scene, its form, the units that its numbers are
    in (`Scales`), the name of its `array`, and of every field its start, its places and its width there."""

    number: int
    formulation: str
    scales: list[float]
    array: str
    fields: dict[str, list[int]]


class Facts(CheckFacts, StepFacts):
    """What a checkpoint says beside its arrays: the scene and the versions, at which step it stands, what the ledger began
    with, in hexadecimal, its entries then (`begun`) and what relaxations have `taken`, the frames and probes so far, what
    checks and the time step have come to, the relaxations, where the states of its bodies stand, and of processes that share
    the scene their shards."""

    identity: dict[str, object]
    step: int
    initial: str
    begun: list[str]
    taken: str
    relax: RelaxationsFacts
    bodies: dict[str, BodyFacts]
    frames: list[Listed]
    probes: list[Recorded]
    shards: NotRequired[Shards]


Found = tuple[Path, Facts, Mapping[str, np.ndarray]]
"""A checkpoint: its file, its facts and its arrays."""


_NAME = re.compile(r"checkpoint_(\d{12})\.npz")


def identity(scene: Scene, files: dict[str, str]) -> dict[str, object]:
    """The facts in which a checkpoint and a scene have to agree: the keys that matter, flat, what the `files` of its bodies
    held when they were read, and the versions."""
    from importlib.metadata import version

    data = scene.model_dump(mode="json", by_alias=True)
    for *path, key in FREE:
        place = data
        for step in path:
            place = place[step]
        place.pop(key, None)
    return {
        **_flat(data),
        **{f"content of {key}": digest for key, digest in files.items()},
        "version of wsph": version("wsph"),
        "version of warp": version("warp-lang"),
        **{f"version of {plugin}": origin for plugin, origin in plugins_of(scene).items()},
    }


def _digests(scene: Scene) -> dict[str, str]:
    """What the files of its bodies and tools hold, by their keys."""
    data = scene.data()
    return file_digests(data["bodies"]) | file_digests(data.get("tools"), "tools")


def _flat(value: object, path: str = "") -> dict[str, object]:
    if is_table(value):
        parts = [(f"{path}.{key}" if path else key, v) for key, v in value.items()]
    elif is_list(value) and any(isinstance(v, (dict, list)) for v in value):
        parts = [(f"{path}.{k}", v) for k, v in enumerate(value)]
    else:
        return {path: value}
    return {key: v for inner, part in parts for key, v in _flat(part, inner).items()}


def write(folder: Path, step: int, facts: Facts, arrays: dict[str, np.ndarray], keep: int) -> Path:
    """Write the checkpoint of `step` into `folder`, whole or not at all, and drop all but the last `keep`."""
    buffer = io.BytesIO()
    text = np.frombuffer(json.dumps(facts).encode(), dtype=np.uint8)
    np.savez(buffer, **arrays, facts=text)  # type: ignore[arg-type]
    content = buffer.getvalue()
    path = folder / f"checkpoint_{step:012d}.npz"
    write_durably(path, FIRST + hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
    for old in listed(folder)[:-keep]:
        remove(old)
    return path


def remove(path: Path) -> None:
    """Remove a checkpoint, and its shards behind it."""
    path.unlink(missing_ok=True)
    for shard in path.parent.glob(f"{path.stem}_*.npz"):
        shard.unlink(missing_ok=True)


def listed(folder: Path) -> list[Path]:
    """The checkpoints in a folder, by step."""
    return sorted(path for path in folder.glob("checkpoint_*.npz") if _NAME.fullmatch(path.name))


def read(path: Path) -> tuple[Facts, Mapping[str, np.ndarray]]:
    """Facts and arrays of a checkpoint. Raises CheckpointError for a file that is not whole."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read: {error.strerror or error}") from error
    head = len(FIRST) + 65
    if not raw.startswith(FIRST):
        raise CheckpointError(f"{path}: is no checkpoint that this version of wsph wrote")
    if len(raw) < head or hashlib.sha256(raw[head:]).hexdigest().encode() != raw[len(FIRST) : head - 1]:
        raise CheckpointError(f"{path}: is cut off or altered")
    with np.load(io.BytesIO(raw[head:]), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    facts: Facts = json.loads(arrays.pop("facts").tobytes())
    return facts, Assembled(path, facts["shards"], arrays) if "shards" in facts else arrays


def refuse_other(path: Path, facts: Facts, scene: Scene) -> None:
    """Refuse the checkpoint of another scene or version, naming what differs."""
    there, here = facts["identity"], json.loads(json.dumps(identity(scene, _digests(scene))))
    differing = sorted(key for key in {*there, *here} if there.get(key) != here.get(key))
    if differing:
        key = differing[0]
        more = f" and {len(differing) - 1} more" if len(differing) > 1 else ""
        raise CheckpointError(
            f"{path}: is of another scene: {key} is {there.get(key)!r} there and {here.get(key)!r} here{more}; run without --resume"
        )


def last(scene: Scene, folder: Path | None, overwrite: bool) -> Found:
    """The last checkpoint in a folder that is whole, which has to be of this scene. Warns of later ones that are
    damaged, and raises CheckpointError where none is whole."""
    if folder is None or overwrite:
        raise CheckpointError(
            "resuming goes on in the output folder and keeps what is there: name the folder, without overwrite"
        )
    files = listed(folder / "checkpoints")
    if not files:
        raise CheckpointError(f"{folder}: holds no checkpoint to resume from; run without --resume")
    damaged: list[str] = []
    for path in reversed(files):
        try:
            facts, arrays = read(path)
        except CheckpointError as error:
            damaged.append(str(error))
            continue
        refuse_other(path, facts, scene)
        for words in damaged:
            warnings.warn(f"{words}; the run goes on from the one before, {path.name}", RuntimeWarning, stacklevel=3)
        return path, facts, arrays
    raise CheckpointError("; ".join(damaged) + ": none is whole; run without --resume")


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


def restore(path: Path, composition: Composition, arrays: Mapping[str, np.ndarray]) -> None:
    """Put the arrays of a checkpoint back. Raises CheckpointError where they are not those of the composition."""
    for coupling in composition.joint.couplings if composition.joint is not None else ():
        coupling.as_kept(arrays)
    device = kept(composition)
    here = {name: array.numpy() for name, array in device.items()} if composition.domain.size > 1 else {}
    pieces = _pieces(composition, here) if here else {}
    for name, array in device.items():
        value, wanted = arrays.get(name), array.numpy().shape
        if (
            value is not None
            and pieces
            and len(value) == sum(each.rows.whole * max(each.width, 1) for each in pieces[name])
        ):
            value = localised(value, pieces[name])
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
        self._files = _digests(composition.scene)
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

    def _write(self, step: int) -> None:
        """Write the checkpoint of a step."""
        assert self._folder is not None
        settings = self._settings
        recorded, probes = self._records.kept()
        device = kept(self._composition) | self._relaxations.arrays()
        arrays = {name: array.numpy() for name, array in device.items()}
        shared, folder = self._domain.size > 1, self._folder.folder / "checkpoints"
        facts: Facts = {
            "identity": identity(self._composition.scene, self._files),
            "step": step,
            "initial": self._ledger.initial.hex(),
            "begun": [value.hex() for value in self._ledger.begun],
            "taken": self._ledger.taken.hex(),
            "relax": self._relaxations.kept(),
            "bodies": {run.body.name: _body_facts(k, run) for k, run in enumerate(self._composition.bodies)},
            "frames": self._folder.times,
            "probes": probes,
            **self._checks.kept(),
            **self._control.kept(),
        }
        self._records.write_tables()
        if shared:
            facts["shards"] = self._shards(folder, step, arrays)
        if self._domain.rank == 0:
            keep = settings.keep if settings is not None else 2
            write(folder, step, facts, recorded if shared else arrays | recorded, keep)
        self._domain.common(())  # all go on when it is there

    def _shards(self, folder: Path, step: int, arrays: Mapping[str, np.ndarray]) -> Shards:
        """Write the shard of this process; what a checkpoint says of all, which are whole then."""
        pieces = _pieces(self._composition, arrays) | self._relaxations.pieces()
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
        for later in listed(path.parent):
            if later.name > path.name and self._domain.rank == 0:
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
