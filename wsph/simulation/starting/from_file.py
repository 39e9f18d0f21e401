"""The state that a body had in a checkpoint, as the one that it begins with.

A checkpoint holds the whole state of the body at the places where it is computed; a frame has stresses recovered at nodes
and in the precision of its format, which no run can go on from: frames are refused. Taken are displacement, deformation,
stress and internals, and what the form remembers of the motion; velocities are not, nor what was recorded.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from wsph.backend.domain import Share
from wsph.errors import CheckpointError, Refused
from wsph.formulations.system import System
from wsph.plugins.traits import internal_units
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation import checkpoint
from wsph.simulation.checkpoint import BodyFacts
from wsph.units import Scales

FREE = ("name", "velocity", "damping", "initial.file")
"""Keys of a body in which it may differ from the one in the checkpoint."""

SHARED = ("dim", "run.kernel", "run.support", "run.correction", "run.seed")
"""Keys of the scene that say what its bodies are made of."""


class Made(Protocol):
    """A body with its system."""

    @property
    def body(self) -> Body: ...

    @property
    def system(self) -> System: ...


def put_states(scene: Scene, made: Sequence[Made]) -> None:
    """Put bodies into the states of the files that they name. Raises Refused for a file that is no checkpoint, or not one of
    the same body."""
    for number, each in enumerate(made):
        path = each.body.initial.file if each.body.initial is not None else None
        if path is not None:
            _put_state(scene, number, each.system, Path(path))


def _put_state(scene: Scene, number: int, system: System, path: Path) -> None:
    key = f"bodies.{number}.initial.file"
    if not path.is_file():
        raise Refused(f"{key} = {str(path)!r}: no such file")
    try:
        facts, arrays = checkpoint.read(path)
    except CheckpointError as error:
        text = "a checkpoint holds the whole state of a body; a frame has stresses recovered at the nodes"
        raise Refused(f"{key}: {error}: {text}") from error
    there = facts["bodies"].get(system.name)
    if there is None:
        raise Refused(f"{key}: {path}: has no body {system.name!r}; there is {', '.join(facts['bodies'])}")
    _refuse_other(key, path, scene, number, facts["identity"], there, system)
    buffer, scales = arrays[there["array"]], Scales(*there["scales"])
    leading = {field.name for field in system.state.layout.fields if field.leads}
    for name in (name for name in system.state.start if name not in leading):
        start, count, width = there["fields"][name]
        values = buffer[start : start + count * width].reshape(count, width)[_share(name, system).window].astype(float)
        system.state.write(name, values * _units(name, system, scales))
    system.placed()
    system.begin()
    system.hold(system.state, 0.0)
    system.refresh(system.state)
    system.start_works()


def _share(name: str, system: System) -> Share:
    """The rows of a field that are here, of those of the whole body."""
    share = system.point_share if system.state.layout.by_name[name].at_points else system.share
    count = system.state.counts[name]
    return share if share.held == count else Share.all(count)  # some fields have places of their own


def _units(name: str, system: System, scales: Scales) -> np.ndarray:
    """What one unit of a field in the file is here, by its components."""
    field = system.state.layout.by_name[name]
    units = [field.unit] * field.width
    if name == "internals":
        own = internal_units(system.constitutive.material)
        units = [own.get(each, "Pa" if each == "stored_energy" else "") for each in system.constitutive.internals]
    same = scales == system.scales
    return np.array([1.0 if same or not unit else scales.of(unit) / system.scales.of(unit) for unit in units])


def _refuse_other(
    key: str,
    path: Path,
    scene: Scene,
    number: int,
    identity: Mapping[str, object],
    there: BodyFacts,
    system: System,
) -> None:
    """Refuse the checkpoint of another body, naming what differs."""
    if there["formulation"] != system.formulation:
        raise Refused(f"{key}: {path}: is of the form {there['formulation']!r}, here it is {system.formulation!r}")
    here = checkpoint.identity(scene, {})
    theirs, ours = _of_body(identity, there["number"]), _of_body(here, number)
    theirs |= {each: identity.get(each) for each in SHARED}
    ours |= {each: here.get(each) for each in SHARED}
    differing = sorted(each for each in {*theirs, *ours} if theirs.get(each) != ours.get(each))
    if differing:
        name = differing[0]
        raise Refused(
            f"{key}: {path}: is of another body: {name} is {theirs.get(name)!r} there and {ours.get(name)!r} here"
        )
    for name, start in system.state.start.items():
        wanted = [_share(name, system).whole, system.state.widths[name]]
        if there["fields"].get(name, [start])[1:] != wanted and not system.state.layout.by_name[name].leads:
            raise Refused(f"{key}: {path}: has no {name} of this body")


def _of_body(identity: Mapping[str, object], number: int) -> dict[str, object]:
    """The keys of a body, without those in which it may differ."""
    prefix = f"bodies.{number}."
    own = {key.removeprefix(prefix): value for key, value in identity.items() if key.startswith(prefix)}
    return {
        k: v
        for k, v in own.items()
        if v is not None and not any(k == free or k.startswith(free + ".") for free in FREE)
    }
