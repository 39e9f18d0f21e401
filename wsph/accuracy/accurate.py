"""An answer within a tolerance, or the most accurate one that a budget pays for, of a scene.

answer = accurate(wsph.load("scene.toml"), tolerance=0.01)
answer.status, answer.data["bar"], answer.result.probes
"""

# pyright: strict

import time
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from pathlib import Path

from wsph.accuracy import report
from wsph.accuracy.budget import spend
from wsph.accuracy.columns import Aim, aims
from wsph.accuracy.limits import Limit
from wsph.accuracy.planning.watch import Due
from wsph.accuracy.report import Answer
from wsph.accuracy.row import Halted
from wsph.accuracy.rows import Rows, Tell, clear
from wsph.accuracy.running.elsewhere import Elsewhere
from wsph.accuracy.running.order import Runner
from wsph.accuracy.running.together import Together
from wsph.accuracy.schemes import second
from wsph.accuracy.schemes.advice import best
from wsph.accuracy.search import Found, search
from wsph.backend.domain import WHOLE, Domain
from wsph.errors import Fault, OutputError, Refused, SceneError
from wsph.output import formats
from wsph.output.claim import Claim
from wsph.scene.outputs import Accuracy
from wsph.scene.scene import Scene
from wsph.simulation.run import Progress

UNJUDGED = 0.01
"""The tolerance by which a budget's columns are compared with each other, where none is given."""

SINGLE = 0.005
"""The tolerance from which single precision is enough: below it its rounding is no small part."""


def accurate(
    scene: Scene,
    out: Path | None = None,
    *,
    tolerance: float | None = None,
    limit: Limit | None = None,
    sure: bool | None = None,
    check: bool = False,
    overwrite: bool = False,
    tell: Tell | None = None,
    progress: Progress | None = None,
    domain: Domain = WHOLE,
    executor: Executor | None = None,
) -> Answer:
    """Search for the `tolerance`, the scene's own where none is given; without any, spend the limit. `check`: ask another
    scheme too. With `out`, the folder holds the output of the finest row and accuracy.json. Raises SceneError where nothing
    is judged, Refused where no row can be made, and what a run raises before it writes anything. `domain`: of the first of
    processes that share the rows, while the others `wsph.accuracy.running.together.follow`. `executor`: where rows are run
    instead, those side by side that do not depend on each other: the same answer, but for seconds. A limit is of those that
    pass here. Its workers write the rows, so that they have to see `out`; without it they need no folder."""
    if executor is not None and domain.size > 1:
        raise Refused("rows are shared by processes or go to an executor: give a domain or an executor, not both")
    runner: Runner = Elsewhere(executor) if executor is not None else Together(domain)
    try:
        runner.refuse(scene)
        return _answer(scene, out, tolerance, limit, sure, check, overwrite, tell, progress, runner)
    finally:
        runner.end()


def _answer(
    scene: Scene,
    out: Path | None,
    tolerance: float | None,
    limit: Limit | None,
    sure: bool | None,
    check: bool,
    overwrite: bool,
    tell: Tell | None,
    progress: Progress | None,
    runner: Runner,
) -> Answer:
    begun = time.perf_counter()
    asked = scene.accuracy or Accuracy()
    tolerance = tolerance if tolerance is not None else asked.tolerance
    given = limit or _limit(asked)
    limit = given or Limit()
    own = [probe.tolerance for probe in scene.probes if probe.tolerance]
    if tolerance is None and given is None and not own:
        text = 'neither a tolerance nor a budget is given: write tolerance = "1%", or budget = "30 s"'
        raise scene.located(SceneError("scene", [Fault(0, "accuracy", text)]))
    wanted = aims(scene, tolerance or UNJUDGED)
    formats.check_installed(scene.output.formats)
    claim = Claim(out, overwrite) if out is not None else None
    with claim or nullcontext():
        rows, notes = _rows(scene, asked, tolerance, lambda of: Rows(of, out, tell, progress, begun, runner))
        rows.due = limit.due
        if claim is not None and out is not None:
            claim.make()
            clear(out)
        try:
            if tolerance is None and not own:
                found = spend(rows, wanted, limit)
            else:
                found = search(rows, wanted, limit, asked.sure if sure is None else sure)
            said = _checked(rows, wanted, found, check)
            answer = report.answer(rows, wanted, found, tolerance, limit.data(), [*notes, *said])
        finally:
            if out is not None:
                clear(out)
        if out is not None and answer.result is not None:
            report.write(answer.data, out)
    return answer


def _limit(asked: Accuracy) -> Limit | None:
    if asked.budget is None and asked.work is None:
        return None
    return Limit(asked.budget, asked.work)


def _rows(
    scene: Scene, asked: Accuracy, tolerance: float | None, rows: Callable[[Scene], Rows]
) -> tuple[Rows, list[str]]:
    """The rows of a scene at the largest time step that its integrator, materials and contacts take: a smaller one costs
    more and is in no scene more accurate for its work. What was changed, in words."""
    notes: list[str] = []
    chosen = tuple(key for key in asked.free if key in ("integrator", "formulation"))
    if chosen and (changes := best(scene, chosen)):
        scene = scene.with_(**changes)
        notes.append(f"{scene.run.integrator.name} in the {scene.run.formulation} form, by the table of wsph advise")
    on_gpu = scene.run.precision == "f64" and scene.run.device.startswith("cuda")
    if on_gpu and "precision" in asked.free and tolerance is not None and tolerance >= SINGLE:
        scene = scene.with_(precision="f32")
        notes.append("precision f32")
    if scene.run.cfl == "auto":
        return rows(scene), notes
    try:
        return rows(scene.with_(cfl="auto")), [*notes, 'cfl = "auto"']
    except Refused as error:
        return rows(scene), [*notes, f"the scene's own time step: {str(error).splitlines()[0]}"]


def _checked(rows: Rows, wanted: dict[str, Aim], found: Found, check: bool) -> list[str]:
    """What another scheme says of the answer, where it is asked."""
    if not check or not found.seen or found.status == "interrupted":
        return []
    due, rows.due = rows.due, Due()  # what it takes is beside the limit
    try:
        return second.opinion(rows, wanted, found.seen)
    except Halted as halt:
        if halt.status == "interrupted":
            return ["interrupted before another scheme had its say"]
        return [f"another scheme was asked: {halt}"]
    except (Refused, SceneError, OutputError) as error:  # which leaves the answer what it is
        return [f"another scheme was asked: {str(error).splitlines()[0]}"]
    finally:
        rows.due = due
