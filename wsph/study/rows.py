"""One row of a study: a run, its cost and its error, as plain data that any executor can carry."""

# pyright: strict

import json
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wsph.accuracy.running.wanted import run_for_whom_waits
from wsph.errors import Fault, Refused, SceneError
from wsph.simulation.result import Result
from wsph.study.energy import EnergyMeter
from wsph.study.plan import Planned
from wsph.study.tables import Study

Row = dict[str, str | int | float | None]
"""Values of a run by column: what it was, its cost and its error. None is what is not known."""


@dataclass
class Made:
    """A row, and the judged columns of its probes: `series` by PROBE.COLUMN, times [s] and values, (2, n)."""

    row: Row
    series: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])


def make(study: Study, folder: Path, planned: Planned, threads: int | None = None, alone: bool = True) -> Made:
    """Make one run, with `threads` threads where the scene leaves their number open. What is refused or unstable is a row
    that says so. `folder` has the reference's file. `alone`: no other run takes the machine's energy meanwhile. Raises
    SceneError for columns that the run does not have, KeyboardInterrupt, and Lost on a worker that nobody waits for."""
    scene = planned.scene
    if threads is not None and scene.run.threads == 0:
        scene = scene.with_(threads=threads)
    row: Row = {"variant": planned.variant, **{key: _cell(value) for key, value in planned.place.items()}}
    meter, cpu = EnergyMeter(), time.process_time()
    try:
        result = run_for_whom_waits(scene)
    except Refused as error:
        return Made(row | {"status": "refused", "reason": str(error).splitlines()[0]})
    row |= _cost(result) | {"cpu_seconds": time.process_time() - cpu, "joules": meter.joules if alone else None}
    if result.status != "completed":
        return Made(row)
    if study.oracle is not None:
        compared = study.oracle.error(result, folder)
        row |= {"error": compared.error, "compared": compared.over or "whole run"}
    return Made(row, _series(study, result))


def _cell(value: object) -> str | int | float:
    return value if isinstance(value, (int, float, str)) else json.dumps(value)


def _cost(result: Result) -> Row:
    """What a run took. Of its CPU and wall seconds setting up and compiling are a part, of `seconds` they are not."""
    s, energy = result.summary, result.summary["energy"]
    cracks = {"crack_area": result.crack_area} if "fracture" in s else {}
    return {
        "status": result.status,
        "reason": result.reason.split(":")[0],
        "particles": s["particles"],
        "steps": s["steps"],
        "right_hand_sides": s["right_hand_sides"],
        "pair_visits": result.work,
        "bytes": round(s["bytes_per_particle"] * s["particles"]),
        "seconds": result.seconds,
        "wall_seconds": s["wall_seconds"],
        "energy_residual": energy["residual"] / energy["external_work"] if energy["external_work"] else 0.0,
        **cracks,
    }


def _series(study: Study, result: Result) -> dict[str, np.ndarray]:
    """The columns that the rows are judged by. Raises SceneError for one that the run does not have."""
    there = result.recorded()
    oracle = study.oracle
    wanted = study.judged or (
        list(there) if oracle is None else [f"{oracle.probe}.{oracle.column}"] * bool(oracle.probe)
    )
    if missing := [name for name in wanted if name not in there]:
        words = f"no column {missing[0]!r} of a probe; there is {', '.join(there) or 'no probe'}"
        raise SceneError("study", [Fault(0, "judged", words)])
    return {name: np.array(there[name], float) for name in wanted}
