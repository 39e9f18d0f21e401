"""Studies: a scene under a grid of overrides, one row of cost and error each, and the front that they make.

schema = 1
scene = "../shock_bar.toml"
[[variants]]                      # what is compared; every one with every combination of the grid
name = "tsph"
set = { "run.support" = 1.2 }
[grid]
"run.cfl" = [0.5, 0.9]
[oracle]                          # the exact answer, an expression of x, y, z, t
probe = "fixed-end"               # or field = "velocity_x" at the end of the run
column = "stress_xx"
exact = "-8e5*(t > 5e-3 and t <= 7.5e-3)"   # or reference = "file.csv": a time and a value a row
norm = 1

A reference is compared with where it has values; a row that ran further says so in its column `compared`.
"""

# pyright: strict

import hashlib
import itertools
import json
import multiprocessing
import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import warp as wp

from wsph.backend.device import pick_device
from wsph.backend.threads import cores, keep_to
from wsph.errors import Refused, WsphError
from wsph.scene.files import file_digests
from wsph.scene.scene import Scene
from wsph.simulation.run import run
from wsph.study.tables import Study

SPREAD_SECONDS = 5.0
"""Estimated time after the first run [s] below which a study stays in its process: another takes two seconds to start."""

Planned = tuple[str, dict[str, object], Scene]
"""A run to be made: the variant's name, its place in the grid, and the scene."""

Row = dict[str, str | int | float]
"""Values of a run by column: what it was, its cost and its error."""


def scenes(study: Study, scene: Scene) -> Iterator[Planned]:
    """Every variant at every place of the grid. Raises SceneError for an override that the scene cannot take."""
    for variant in study.variants:
        for values in itertools.product(*study.grid.values()):
            place = dict(zip(study.grid, values, strict=True))
            yield variant.name, place, scene.with_(**variant.set, **place)


def digests(study: Study, scene: Scene, folder: Path) -> list[str]:
    """A digest of everything that a row follows from, for each run in order: the row of another study that has it is the
    same but for its seconds. Raises SceneError for a reference that cannot be read."""
    oracle = study.oracle
    answer = [oracle.model_dump_json(), oracle.content(folder)] if oracle is not None else []
    shared = [*answer, version("wsph"), version("warp-lang")]
    found: list[str] = []
    for name, place, changed in scenes(study, scene):
        whole = changed.model_dump(mode="json", by_alias=True)
        facts = json.dumps([name, place, whole, file_digests(whole["bodies"]), shared], default=str)
        found.append(hashlib.sha256(facts.encode()).hexdigest())
    return found


def run_study(
    study: Study,
    scene: Scene,
    folder: Path,
    progress: Callable[[int, int], None] | None = None,
    workers: int = 1,
    *,
    known: Sequence[Row | None] | None = None,
    keep: Callable[[Sequence[Row | None]], None] | None = None,
) -> list[Row]:
    """Run a study whose files are in `folder`: one row of plain data a run. What is refused or unstable is a row that says
    so.

    With more than one of `workers` (0: as many as there are cores for) every run that leaves its threads open takes one
    core, and those after the first go to processes of their own where that is worth it: the same rows, but for their
    seconds. Processes import the main module, which has to be importable. An interrupt ends the study (KeyboardInterrupt).
    `known` rows, in the order of the runs, are not made again; `keep` is called with all rows whenever there is one more.
    Raises SceneError before the first run for an answer that cannot be compared with.
    """
    planned = list(scenes(study, scene))
    if study.oracle is not None:
        for _, _, changed in planned:
            study.oracle.check(changed, folder)
    rows: list[Row | None] = list(known or [None] * len(planned))

    def note(place: int, row: Row) -> None:
        rows[place] = row
        if keep is not None:
            keep(rows)
        if progress is not None:
            progress(sum(each is not None for each in rows), len(planned))

    todo = [place for place, row in enumerate(rows) if row is None]
    if todo:
        _make(study, folder, [(place, planned[place]) for place in todo], workers, note)
    return [row for row in rows if row is not None]


def _make(
    study: Study, folder: Path, wanted: list[tuple[int, Planned]], workers: int, note: Callable[[int, Row], None]
) -> None:
    """Make rows, and note each at its place."""
    (first, begin), *rest = wanted
    changes = [changed for _, (_, _, changed) in wanted]
    each_takes = max(1, *(changed.run.threads for changed in changes))
    workers = min(workers or len(cores()) // each_takes, len(rest))
    if any(_on_cuda(changed) for changed in changes):
        workers = 1
    row = partial(_row, study, folder, threads=1 if workers > 1 else None)
    started = time.perf_counter()
    note(first, row(begin))
    if workers < 2 or (time.perf_counter() - started) * len(rest) < SPREAD_SECONDS:
        for place, each in rest:
            note(place, row(each))
        return
    context = multiprocessing.get_context("spawn")
    own = [cores()[k * each_takes : (k + 1) * each_takes] for k in range(max(len(cores()) // each_takes, 1))]
    shares = context.Queue()
    for k in range(workers):
        shares.put(own[k % len(own)])
    with ProcessPoolExecutor(workers, context, _begin, (shares,)) as pool:
        try:
            found = pool.map(partial(_in_process, row), [each for _, each in rest])
            for (place, _), made in zip(rest, found, strict=True):
                note(place, made)
        except BrokenProcessPool:
            raise WsphError(
                "a process of the study ended, by an interrupt or for lack of memory perhaps: use --workers 1"
            ) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _on_cuda(scene: Scene) -> bool:
    try:
        return wp.get_device(pick_device(scene.run.device)).is_cuda
    except Refused:  # which its row will say
        return False


def _in_process(row: Callable[[Planned], Row], planned: Planned) -> Row:
    """A row made by a process of its own, which an interrupt ends."""
    try:
        return row(planned)
    except KeyboardInterrupt:
        os._exit(130)


def _begin(shares: Any) -> None:
    """Start a process of a study, on cores of its own and with warnings off: the table reports them."""
    warnings.simplefilter("ignore")
    keep_to(shares.get())


def _row(study: Study, folder: Path, planned: Planned, threads: int | None = None) -> Row:
    """One run, with `threads` threads where the scene leaves their number open."""
    name, place, changed = planned
    if threads is not None and changed.run.threads == 0:
        changed = changed.with_(threads=threads)
    row: Row = {
        "variant": name,
        **{k: v if isinstance(v, (int, float, str)) else json.dumps(v) for k, v in place.items()},
    }
    try:
        result = run(changed, throw=False)
    except Refused as error:
        return row | {"status": "refused", "reason": str(error).splitlines()[0]}
    if result.status == "interrupted":
        raise KeyboardInterrupt
    s = result.summary
    rate, energy = s["particle_steps_per_second"], s["energy"]
    row |= {
        "status": result.status,
        "reason": result.reason.split(":")[0],
        "particles": s["particles"],
        "steps": s["steps"],
        "right_hand_sides": s["right_hand_sides"],
        "pair_visits": s["pairs"] * s["right_hand_sides"],
        "seconds": s["particles"] * s["steps"] / rate if rate > 0.0 else 0.0,
        "energy_residual": energy["residual"] / energy["external_work"] if energy["external_work"] else 0.0,
    }
    if study.oracle is not None and result.status == "completed":
        compared = study.oracle.error(result, folder)
        row |= {"error": compared.error, "compared": compared.over or "whole run"}
    return row
