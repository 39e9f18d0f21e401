"""What of a valid scene does nothing, and likely was meant to: said before a run, in words with the way out."""

# pyright: strict

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from wsph.backend.domain import any_of
from wsph.boundary.loads.rows import FORCE
from wsph.boundary.programs.functions import Function
from wsph.boundary.programs.motion import UNITS
from wsph.boundary.programs.prescribed import nonzero
from wsph.boundary.tables import Boundary
from wsph.geometry.selection import select
from wsph.quantities import Value, is_list, is_table
from wsph.ranks.blocks import own_mean
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import BodyRun


def idle(scene: Scene, bodies: Sequence[BodyRun], dt: float) -> Iterator[str]:
    """What of a scene whose steps are of `dt` [s] does nothing."""
    if not _acts(scene):
        yield (
            "nothing moves: no body has a velocity or an initial stress, and nothing prescribes, loads or pulls one; give bodies.0.velocity,"
            " a [[boundary]] with velocity, traction or pressure, or [gravity]"
        )
    yield from _tables(scene)
    yield from _records(scene, dt)
    yield from _held_loads(scene)
    yield from _all_held(scene, bodies)
    yield from _strangers(scene, bodies)


def _acts(scene: Scene) -> bool:
    """Whether anything sets a body in motion."""
    started = any(body.velocity or body.initial or body.body_force for body in scene.bodies)
    tools = any(tool.velocity or tool.turn or tool.free for tool in scene.tools)
    pulled = any(nonzero(scene.value(value, "m/s2")) for value in scene.gravity.values())
    return started or tools or pulled or any(_moves(scene, each) for each in scene.boundary)


def _moves(scene: Scene, condition: Boundary) -> bool:
    tables = [(getattr(condition, key), unit) for key, unit in UNITS.items()]
    tables += [(condition.stress, "Pa"), (condition.traction, "Pa"), (condition.force, FORCE[scene.dim])]
    tables += [({"": condition.normal}, "m/s")] if condition.normal is not None else []
    return "pressure" in condition.acting or any(
        nonzero(scene.value(value, unit)) for table, unit in tables for value in table.values()
    )


MOST_FRAMES = 3_000
"""Frames of a run that nobody looks at."""


def _records(scene: Scene, dt: float) -> Iterator[str]:
    """Records that are never due, or in nearly every step."""
    output = scene.output
    named = sorted({"fields", "formats", "positions"} & output.model_fields_set)
    if named and output.every is None:
        yield (
            f"output.{named[0]}: frames are those of the start and the end alone, as output.every is not given: write"
            f' every = "{scene.end / 20:.2g} s", if more are wanted'
        )
    cadences = [
        ("output.every", output.every),
        *((f"probes.{k}.every", each.every) for k, each in enumerate(scene.probes)),
    ]
    for key, every in cadences:
        if every is None:
            continue
        seconds = every * dt if isinstance(every, int) else every
        if seconds > scene.end and not (isinstance(every, int) and every == 1):
            yield f"{key}: {seconds:.3g} s is longer than the run of {scene.end:.3g} s: only its start and its end are recorded"
        elif key == "output.every" and scene.end / max(seconds, dt) > MOST_FRAMES:
            yield f"{key}: {scene.end / max(seconds, dt):.2g} frames are to be written: is it in ms or us?"


def _strings(data: object) -> Iterator[str]:
    """Every string in plain data."""
    if isinstance(data, str):
        yield data
    elif is_table(data):
        for each in data.values():
            yield from _strings(each)
    elif is_list(data):
        for each in data:
            yield from _strings(each)


def _tables(scene: Scene) -> Iterator[str]:
    """Functions that nothing names, and those whose table changes after the end of the run alone."""
    named = set(_strings({key: value for key, value in scene.data().items() if key != "functions"}))
    for name, function in scene.functions.items():
        if name not in named:
            yield f'functions.{name}: nothing names it: write it where its value belongs, as in traction = {{ y = "{name}" }}'
            continue
        if function.t is None or len(function.t) < 2:
            continue
        if not function.axis and len(set(function.column)) < 2:
            continue
        yield from (f"functions.{name}: {said}" for said in _late(function, function.t, scene.end))


def _late(function: Function, t: tuple[float, ...], end: float) -> Iterator[str]:
    """What of a table with entries at `t` [s] begins to act after the `end` [s] alone."""
    if function.axis or (t[-1] > end and function.at(end) != function.at(0.0)):
        if t[1] > end:
            reached = "" if function.axis else f", where it is {function.at(end):.3g} of {function.column[1]:g}"
            yield (
                f"its table begins to act after the end of the run at {end:g} s{reached}: its next entry is at {t[1]:g} s; is t in ms"
                f' (write "{t[1]:g} ms"), or run.end too short?'
            )
    elif t[-1] > end:
        begins = next(t for t, value in zip(t, function.column, strict=True) if value != function.at(0.0))
        yield (
            f"is {function.at(0.0):g} to the end of the run at {end:g} s: its table changes towards {begins:g} s alone; is t in ms"
            f' (write "{begins:g} ms"), or run.end too short?'
        )


def _chosen(condition: Boundary) -> tuple[str, str | None, str | None, str | None]:
    return condition.body, condition.face, condition.patch, condition.where


def _held_loads(scene: Scene) -> Iterator[str]:
    """Loads on particles that another entry holds, by the same selection."""
    for k, condition in enumerate(scene.boundary):
        for load, axis in ((key, axis) for key in ("traction", "force") for axis in getattr(condition, key)):
            for j, other in enumerate(scene.boundary):
                holds = axis in (*other.fixed, other.symmetry, *(a for key in UNITS for a in getattr(other, key)))
                meets = not (condition.steps and other.steps) or bool({*condition.steps} & {*other.steps})
                if holds and meets and _chosen(condition) == _chosen(other):
                    yield (
                        f"boundary.{k}.{load}.{axis}: pulls at particles that boundary.{j} holds or moves along {axis}: it changes"
                        " nothing there; load another face, or leave one of both out"
                    )


def _all_held(scene: Scene, bodies: Sequence[BodyRun]) -> Iterator[str]:
    """Selections that take in the whole of a body whose motion they prescribe."""
    by_name = {run.body.name: run for run in bodies}
    for k, condition in enumerate(scene.boundary):
        prescribes = condition.fixed or any(getattr(condition, key) for key in UNITS)
        if condition.where is None or not prescribes:
            continue
        run = by_name[condition.body]
        selected = select(condition.where, run.system.position, run.system.spacing)
        if not any_of(run.system.domain, not selected.all()):
            low, high = run.bounds
            yield (
                f"boundary.{k}.where: {condition.where!r} selects every particle of body {run.body.name!r}, which then moves as"
                f" prescribed and does not deform: it reaches from {_place(low)} to {_place(high)} m"
            )


def _strangers(scene: Scene, bodies: Sequence[BodyRun]) -> Iterator[str]:
    """Bodies whose ways meet and that nothing acts between. Those that overlap from the start are told of elsewhere."""
    known = {frozenset(contact.names) for contact in scene.contact}
    if len(bodies) > len(known) + 40:
        return  # of many bodies every pair would be looked at
    ways = [_Way.of(scene, run) for run in bodies] if len(bodies) > 1 else []
    for one, other in combinations(ways, 2):
        names = [one.name, other.name]
        if frozenset(names) not in known and one.meets(other, scene.end):
            yield (
                f"bodies {names[0]!r} and {names[1]!r} meet on their ways and nothing acts between them: they pass through each"
                f" other; write [[contact]] between = {json.dumps(names)}"
            )


def _speed(scene: Scene, run: BodyRun) -> np.ndarray:
    """The mean velocity of a body at the start [m/s], or that which a boundary prescribes as a number."""
    system = run.system
    velocity = own_mean(system.state.read("velocity"), system.share, system.domain) * system.scales.velocity
    first = system.domain.told(lambda: system.position[:1])
    for condition in scene.boundary:
        if condition.body == run.body.name:
            given: Mapping[str, Value] = condition.velocity
            for axis, value in given.items():
                made = scene.value(value, "m/s")
                most = made.at(scene.end) if isinstance(made, Function) else float(made(first, 0.0)[0])
                velocity["xyz".index(axis)] = most
    return np.asarray(velocity, float)


@dataclass(frozen=True)
class _Way:
    """The bounds of a body at the start [m], what they are wider by, and its velocity [m/s]."""

    name: str
    low: np.ndarray
    high: np.ndarray
    half: float
    velocity: np.ndarray

    @classmethod
    def of(cls, scene: Scene, run: BodyRun) -> "_Way":
        """That of a body."""
        half = 0.5 * (run.system.spacing if run.system.traits.pairwise else 0.0)
        return cls(run.body.name, *run.bounds, half, _speed(scene, run))

    def meets(self, other: "_Way", end: float) -> bool:
        """Whether the bounds of both come to overlap by the end, which do not at the start."""
        velocity = self.velocity - other.velocity
        low, high = other.low - self.high - self.half, other.high - self.low + self.half
        if (low < 0.0).all() and (high > 0.0).all():
            return False
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.stack([low, high]) / velocity
        still = velocity == 0.0
        if (still & ((low >= 0.0) | (high <= 0.0))).any() or still.all():
            return False
        enter = float(times.min(0)[~still].max())
        leave = float(times.max(0)[~still].min())
        return max(enter, 0.0) < min(leave, end)


def _place(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ")"


def untouched(scene: Scene, history: Mapping[str, np.ndarray]) -> Iterator[str]:
    """Contacts and tools that had no force in any row of the history of a run."""
    for kind, each in [*(("contact", c) for c in scene.contact if c.law != "tie"), *(("tool", t) for t in scene.tools)]:
        columns = [values for name, values in history.items() if name.startswith(f"{kind}_{each.name}_")]
        if columns and not any(np.any(values) for values in columns):
            rows = len(columns[0])
            yield f"{kind} {each.name!r} had no force in any of the {rows} rows of the history: nothing came to touch"
