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
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import NotRequired, TypedDict

import numpy as np

from wsph.errors import CheckpointError
from wsph.output.files import write_durably
from wsph.output.frames import Listed
from wsph.quantities import is_list, is_table
from wsph.scene.files import file_digests
from wsph.scene.scene import Scene
from wsph.simulation.checks import CheckFacts
from wsph.simulation.probing.records import Recorded
from wsph.simulation.starting.assembled import Assembled
from wsph.simulation.starting.relaxations import RelaxationsFacts
from wsph.simulation.starting.shards import Shards
from wsph.simulation.step_control import StepFacts
from wsph.simulation.summary import plugins_of

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


Found = tuple[Path | None, Facts, Mapping[str, np.ndarray]]
"""A checkpoint: its file, where it has one, its facts and its arrays."""


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


def digests(scene: Scene) -> dict[str, str]:
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
    there, here = facts["identity"], json.loads(json.dumps(identity(scene, digests(scene))))
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
