"""The rows of a search: runs of one scene on lattices of it, each with its cost planned before and measured after.

With a folder, a row is written into a folder inside of it, and takes the place of the one before when it is complete:
what is in the folder is at any time the ordinary output of the best row so far, also after an interrupt. Where seconds are
limited, a row that turns out to take longer than there is left is ended (`wsph.accuracy.planning.watch`). Who runs rows is
in `wsph.accuracy.running`.
"""

# pyright: strict

import shutil
import time
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor
from pathlib import Path

from wsph.accuracy.planning.cost import Costs, Plan
from wsph.accuracy.planning.formal import Formal, formal_order
from wsph.accuracy.planning.lattices import Lattices
from wsph.accuracy.planning.rate import Rate
from wsph.accuracy.planning.took import Took
from wsph.accuracy.planning.watch import Due
from wsph.accuracy.row import Halted, Late, Row, in_seconds
from wsph.accuracy.running.order import Order, Runner, Unfit
from wsph.accuracy.running.together import Together
from wsph.backend.domain import WHOLE
from wsph.errors import Refused, SceneError
from wsph.output.files import ROW
from wsph.output.formats import own_files
from wsph.scene.scene import Scene
from wsph.simulation.composing.composition import Composition
from wsph.simulation.run import Progress

LATE, EARLY = (
    "would have gone beyond the limit and was ended",
    "takes so little that a finer one is paid for, and was ended",
)

Tell = Callable[[str], None]
"""Called with a sentence of what is going on."""


class Rows:
    """The rows of a scene so far, coarsest first (`made`), and what is needed to make more. `formal` is its order. Seconds
    are counted from `begun` on, by `time.perf_counter`, `due` says by which a run has to end. `runner`: who runs them."""

    def __init__(
        self,
        scene: Scene,
        folder: Path | None = None,
        tell: Tell | None = None,
        progress: Progress | None = None,
        begun: float | None = None,
        runner: Runner | None = None,
    ):
        self._begun, self.due = begun if begun is not None else time.perf_counter(), Due()
        self.scene, self._folder, self._progress = scene, folder, progress
        self._runner: Runner = runner or Together(WHOLE)
        self.tell: Tell = tell or (lambda _: None)
        self.lattices = Lattices(scene)
        self.costs, self.rate = Costs(self.lattices, keep=self._runner.takes_composed), Rate()
        self.first = self._first()
        self.formal: Formal = formal_order(self.lattices.scene_at(self.first))
        self.made: list[Row] = []
        self.spent = 0.0

    @property
    def seconds(self) -> float:
        """Since the search began [s]."""
        return time.perf_counter() - self._begun

    def _first(self) -> int:
        """The coarsest lattice that can be set up: walls may be too thin for it, or a selection empty."""
        cells = self.lattices.first
        while True:
            try:
                self.costs.plan(cells)
            except (SceneError, Refused):
                if cells >= self.lattices.own:
                    raise
                cells = min(self.lattices.next(1.15 * cells), max(self.lattices.own, self.lattices.next(cells + 0.5)))
            else:
                return cells

    def ahead(self, scenes: Iterable[Scene]) -> int:
        """Have rows begun that do not depend on each other, by who can run several at a time: `run` has them then; returns
        how many were. The scenes are not asked for where nobody can."""
        return self._runner.ahead(self._order(each) for each in scenes)

    def make(self, cells: int) -> Row:
        """Run a lattice. Raises Halted where it does not come to its end, Late where it would come to it too late."""
        plan = self.costs.plan(cells)
        expected = self.rate.expected(plan)
        self.tell(self._in_words(cells, plan, expected))
        try:
            row = self.run(self.lattices.scene_at(cells), cells, expected.work, self._progress, self.costs.ready(cells))
        except Late as late:
            if late.row.steps:
                self._learn(plan, late.row, late.row.steps / expected.steps)
            raise
        self._learn(plan, row)
        self.made.append(row)
        if self._folder is not None:
            _replace(self._folder, _row_of(self._folder))
        return row

    def _learn(self, plan: Plan, row: Row, part: float = 1.0) -> None:
        """Note what a row took, or a `part` of one."""
        wall = row.wall_seconds - row.composing
        inside = min(row.result.seconds, wall)
        composing = self.costs.taken.get(row.cells, 0.0) + row.composing
        self.rate.learn(Took(plan, row.work, inside, composing, wall - inside, part))

    def _in_words(self, cells: int, plan: Plan, expected: Plan) -> str:
        """What a row is `expected` to take, by the rows before it; the least where there are none and steps get shorter."""
        seconds = self.rate.seconds(plan)
        took = f", about {in_seconds(seconds)}" if seconds == seconds else ""
        least = "at least " if plan.shrinks and not self.made else ""
        why = f" (steps get shorter: {plan.shrinks})" if least else ""
        return (
            f"{cells} cells: {plan.particles:.0f} particles, {least}{expected.steps:.0f} steps, {expected.work:.3g} pair"
            f" visits{took}{why}"
        )

    def scaled(self, cells: float) -> Plan:
        """The plan of a lattice that need not be one, by that of the last row."""
        last = self.made[-1]
        return self.costs.plan(last.cells).finer(cells / last.cells, self.scene.dim)

    def run(
        self,
        scene: Scene,
        cells: int,
        planned: float,
        progress: Progress | None = None,
        composed: Composition | None = None,
    ) -> Row:
        """Run a scene, which may be `composed` already, as a row that is not kept among those of the ladder. Raises as
        `make` does."""
        try:
            ran = self._runner.run(self._order(scene), progress, composed)
        except BrokenExecutor as error:
            raise Halted("refused", f"the run with {cells} cells is lost: {error}") from None
        except Unfit as error:
            if not self.made:
                raise
            raise Halted("refused", str(error)) from None
        except KeyboardInterrupt:
            raise Halted("interrupted", f"interrupted in the run with {cells} cells") from None
        result = ran.result
        row = Row(
            cells, self.lattices.spacing(cells), planned, ran.wall_seconds, ran.cpu_seconds, result, ran.composing
        )
        self.spent += row.work
        if result.status == "interrupted" and ran.ended:
            raise Late(f"the row with {cells} cells {EARLY if ran.early else LATE}", row, ran.early)
        if result.status == "interrupted":
            raise Halted("interrupted", f"interrupted in the run with {cells} cells")
        if result.failure is not None:
            raise Halted("refused", f"the run with {cells} cells is {result.status}: {result.reason}")
        return row

    def _order(self, scene: Scene) -> Order:
        """What is said to who runs it: it is due as rows are now."""
        return Order(scene, _row_of(self._folder) if self._folder is not None else None, self.due, self._begun)


def clear(folder: Path) -> None:
    """Take away what a search that was cut off left of a row."""
    shutil.rmtree(folder / ROW, ignore_errors=True)


def _row_of(folder: Path) -> Path:
    """Where a row is written that may become a search's answer; beside it is what who runs it needs."""
    return folder / ROW / "row"


def _replace(folder: Path, inside: Path) -> None:
    """Put the files of a row that is complete in the place of those of the one before."""
    for path in own_files(folder):
        path.unlink(missing_ok=True)
    for path in sorted(each for each in inside.rglob("*") if each.is_file()):
        target = folder / path.relative_to(inside)
        target.parent.mkdir(parents=True, exist_ok=True)
        path.replace(target)
    shutil.rmtree(inside)
