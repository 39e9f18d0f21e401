"""Running a scene: blocks of steps, and between them checks, records and checkpoints."""

# pyright: strict

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import warp as wp

from wsph.backend.arrays import host
from wsph.backend.device import give_back
from wsph.backend.domain import WHOLE, Domain, any_of, ending_together, failing_together
from wsph.backend.graph import BLOCKS
from wsph.doubts import doubt, keeping
from wsph.errors import Unstable
from wsph.formulations.updated.sharing.anew import Anew
from wsph.output import fields, formats
from wsph.output.claim import Claim
from wsph.output.folder import OutputFolder, PartedFolder, UnwrittenFolder
from wsph.output.frames import Listed
from wsph.output.interrupts import Interrupts
from wsph.output.view.bar import Bar
from wsph.scene.load import prepared
from wsph.scene.scene import Scene
from wsph.simulation import checkpoint
from wsph.simulation.checkpoint import Found
from wsph.simulation.checks import Checks, warn
from wsph.simulation.compose import compose
from wsph.simulation.composing.composition import Composition
from wsph.simulation.composing.idle import untouched
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.ledger import Account, Ledger
from wsph.simulation.probing.pieces import in_parts
from wsph.simulation.probing.recorder import RING
from wsph.simulation.probing.records import Records
from wsph.simulation.result import Result
from wsph.simulation.starting.checkpoints import Checkpoints
from wsph.simulation.starting.going_on import GoingOn
from wsph.simulation.starting.relaxation import NO_REST
from wsph.simulation.starting.relaxations import Relaxations
from wsph.simulation.step_control import StepControl
from wsph.simulation.summary import Ending, TableUnits, summary

CHECK_STEPS = 100
"""Steps between checks where steps are not captured in blocks; those are checked at the end of a block. A check costs about
half a step (tests/benchmarks/guards.py)."""

WATCHED = 32
"""Parts of its steps that a run is watched in, where somebody may have had enough of it."""

TOGETHER_SECONDS = 0.25
"""Time between two words of processes that share a scene on whether one has been asked to end [s]."""

Progress = Callable[[int, int, float], None]
"""Called between blocks of steps with the step, the last step and the time [s]."""

ONE_RUN = threading.RLock()
"""Capturing a graph takes in what any thread launches: runs of one process follow one another."""


def run(scene: Scene | str | Path, out: str | Path | None = None, *, overwrite: bool = False, resume: bool = False, throw: bool = True,
        progress: Progress | bool | None = None, domain: Domain = WHOLE, composed: Composition | None = None,
        enough: Callable[[], bool] | None = None, **overrides: object) -> Result:  # fmt: skip
    """Run a scene (or a scene file) and return its result; with `out`, write the output folder too.

    With `resume` it goes on from the last checkpoint in `out`, which must fit the scene: the bits of never having
    stopped. `overrides` are those of `Scene.with_`. `progress(step, steps, time)` is called between blocks of steps;
    True shows a bar. Raises SceneError, Refused, PluginError or OutputError before anything is written, and Unstable
    where the run left what it can vouch for, unless `throw` is False: then the result says so. SIGINT, SIGTERM and
    SIGUSR1 end the run after a whole step, the folder is written, and the signal takes its course (a KeyboardInterrupt);
    with `throw` False the result says "interrupted". Runs of one process, from any thread, follow one another; two never
    write into one folder at a time, of whatever processes: the later is refused (OutputError).

    `domain`: the part of the scene that this process has, of those that share it (`wsph.ranks.mpi.Ranks`); all of them call
    this alike. The first of them writes, and its result is that of the whole; where frames are in parts (`output.parts`)
    each writes its own, and has the particles of that in its result. `composed`: the scene as `compose` has made it ready,
    and as nobody has run it yet. `enough` is asked between stretches of steps: where it says so the run ends after
    a whole step, and its result says "interrupted".
    """
    if progress is True:
        with Bar() as bar:
            return run(
                scene,
                out,
                overwrite=overwrite,
                resume=resume,
                throw=throw,
                progress=bar,
                domain=domain,
                composed=composed,
                enough=enough,
                **overrides,
            )
    folder = Path(out) if out is not None else None
    claim = Claim(folder, overwrite, resume) if folder is not None and domain.rank == 0 else None
    interrupts = Interrupts(enough)
    with failing_together(domain):
        scene = prepared(scene, overrides)
        with claim or nullcontext():
            if folder is not None:
                formats.check_installed(scene.output.formats)
            started = time.perf_counter()
            found = checkpoint.last(scene, folder, overwrite) if resume else None
            with ONE_RUN, np.errstate(over="ignore", invalid="ignore"):  # the finite check speaks, numpy need not
                composition = composed or compose(scene, domain)
                for words in composed.said if composed is not None else ():
                    doubt(words, stacklevel=2)
                composition.compile()
                give_back(composition.particles)
                with interrupts:
                    if claim is not None:
                        claim.make()
                    running = Running(composition, folder, started, found)
                    watched = any_of(domain, enough is not None)
                    del composition, composed  # what is made anew is not to be there twice
                    while True:
                        try:
                            result = running.run(progress or None, interrupts, WATCHED if watched else 1)
                            break
                        except Anew as anew:
                            of = running.remade(anew)
                        del running
                        running = Running.going_on(of)
                        del of  # what it goes on from, once it has
    asked = interrupts.asked
    if throw and result.failure is not None:
        raise result.failure
    if throw and asked > 0:
        signal.raise_signal(asked)
    return result


class Running:
    """One run in progress: a composition, and what looks at it between blocks of its steps."""

    def __init__(
        self,
        composition: Composition,
        folder: Path | None,
        started: float,
        found: Found | None = None,
        *,
        inside: float = 0.0,
        began: int | None = None,
    ):
        """`started` is when the run was asked for, by `time.perf_counter`; `found` the checkpoint that it goes on from; of a
        run whose bodies have been made anew, the seconds in its steps so far, and the step from which on it ran."""
        scene, self._started, self._found = composition.scene, started, found
        self._composition, self._timeline = composition, composition.time_step.timeline
        frames = found[1]["frames"] if found is not None else None
        names = [run.body.name for run in composition.bodies]
        self._domain, self._on_cuda = composition.domain, wp.get_device(composition.device).is_cuda
        self._folder = self._opened(folder, frames, names) if folder is not None else None
        bodies = composition.bodies
        self._ledger = Ledger([run.system.ledger for run in bodies], [each.ledger for each in composition.between])
        self._control = StepControl(composition)
        touching = {frozenset(contact.names): contact.law != "pinball" for contact in scene.contact}
        self._checks = Checks(bodies, self._timeline, scene.stop.energy, touching)
        self._records = Records(composition, self._ledger.columns, self._folder)
        self._relaxations = Relaxations(composition, self._control, self._checks)
        self._checkpoints = Checkpoints(
            composition, self._folder, self._ledger, self._checks, self._control, self._records, self._relaxations
        )
        self._first = self._step = 0
        self._inside, self._began = inside, began
        self._under_way = False
        self._failure: Unstable | None = None
        self._apart = 1
        """Steps between two words of processes that share the scene."""
        self._said_at_end: list[str] = []

    def _opened(self, folder: Path, frames: list[Listed] | None, names: list[str]) -> OutputFolder:
        """The folder that it writes, or has a part in."""
        composition, formats = self._composition, self._composition.scene.output.formats
        if in_parts(composition):
            return PartedFolder(folder, formats, frames, names, composition.domain)
        return (OutputFolder if composition.domain.rank == 0 else UnwrittenFolder)(folder, formats, frames, names)

    def run(self, progress: Progress | None, interrupts: Interrupts, parts: int = 1) -> Result:
        """Run to the end, to a failure or to an interrupt, in so many parts of its steps at least."""
        for step in self.blocks(interrupts, progress, lambda: self._parts(parts)):
            if progress is not None and step > self._first:
                progress(step, self._timeline.last, self._timeline.time(step))
        return self.end(interrupts)

    def blocks(
        self, interrupts: Interrupts, progress: Progress | None = None, due: Callable[[], Sequence[int]] = tuple
    ) -> Iterator[int]:
        """Run block after block of steps, to the end, to a failure or to an interrupt: the step that each has come to, the
        first of them before any. `due` are steps, from outside, that blocks end at."""
        found, relaxations = self._found, self._relaxations
        step = self._checkpoints.resume(found) if found is not None else 0
        self._first = step if self._began is None else self._began
        self._found, self._under_way = None, True
        try:
            if step == 0 and self._relax(step, progress, interrupts):
                self._begin()
            yield step
            while (
                step < self._timeline.last and not self._asked(interrupts) and self._relax(step, progress, interrupts)
            ):
                step += self._steps(self._block(step, due()), interrupts)
                self._records.collect(step)
                self._records.take(step, self.check(step))
                self._checkpoints.keep(step)
                self._step = step
                yield step
            if relaxations.current is not None:
                self._checkpoints.keep_relaxing(step, asked=True)
            elif self._asked(interrupts) and step < self._timeline.last:
                # First what is kept: a run that goes on from there has the records of one that never stopped.
                self._checkpoints.keep(step, asked=True)
                self._records.take(step, self.check(step), final=True)
        except Unstable as error:
            self._failure = error
        self._step = step

    def _parts(self, count: int) -> Sequence[int]:
        """The steps at which so many equal parts of all steps end, but for the last; on the CPU more, so that no graph has
        to be captured for them that takes longer than it saves."""
        last = self._timeline.last
        # Steps that adapt end blocks by themselves, and would adapt at others.
        if not 1 < count <= last or self._control.adapts:
            return ()
        size = last // count if self._on_cuda else min(last // count, BLOCKS[0] - 1)
        return range(size, last, size)

    def end(self, interrupts: Interrupts) -> Result:
        """The result of the run as far as it has come."""
        status, reason, step, failure = "completed", "", self._step, self._failure
        if failure is not None:
            # Energy that grew is a stop that the scene asks for, and so is no rest; a state that is not finite is not.
            status, reason = "stopped" if failure.field in ("energy", NO_REST) else "unstable", str(failure)
        elif step < self._timeline.last:
            status, reason = "interrupted", f"interrupted at step {step}"
            if (current := self._relaxations.current) is not None:
                reason = f"interrupted in a relaxation before step {step}, after {current.steps} steps of it"
        wall = time.perf_counter() - self._started
        ending = Ending(status, reason, step, self._first, wall, self._inside)
        return self._result(ending, failure)

    def remade(self, asked: Anew) -> GoingOn:
        """What a run goes on from that has come to where this one has, with a body that is made anew."""
        step, found, first = int(host(self._composition.clock.step)[0]), self._found, self._began
        if self._under_way and (step > 0 or self._relaxations.current is not None):
            self._composition.publish()
            self._records.collect(step)
            found, first = self._checkpoints.carried(step), self._first
        folder = self._folder.folder if self._folder is not None else None
        return GoingOn.of(self._composition, asked, folder, self._started, self._inside, found, first)

    @classmethod
    def going_on(cls, of: GoingOn) -> "Running":
        """The run that goes on."""
        return cls(of.composed(), of.folder, of.started, of.found, inside=of.inside, began=of.first)

    @property
    def composition(self) -> Composition:
        """What runs."""
        return self._composition

    @property
    def failure(self) -> Unstable | None:
        """What ended it before its time."""
        return self._failure

    @property
    def units(self) -> TableUnits:
        """SI units of the columns of its history and of every probe, by name."""
        return self._records.table_units()

    def numbers(self) -> dict[str, float]:
        """The columns of the history at the step that it has come to."""
        return self._records.numbers(*self._last)

    def latest(self, probe: str, column: str) -> float:
        """The last record of a probe's column; NaN where there is none yet."""
        values = self._records.probes()[probe][column]
        return float(values[-1]) if len(values) else math.nan

    @property
    def ledger(self) -> Ledger:
        """Its energies and works."""
        return self._ledger

    def _relax(self, step: int, progress: Progress | None, interrupts: Interrupts) -> bool:
        """Bring the bodies to rest, where that is due before a step; False where it was asked to end before they were.
        Raises Unstable where they do not come to rest."""
        relaxations = self._relaxations
        if relaxations.current is None and (relaxations.due is None or step < relaxations.due):
            return True
        relaxation = relaxations.current or relaxations.start(step)
        relaxation.compile()
        if relaxation.steps == 0:
            relaxation.begin()

        def between(steps: int, most: int) -> None:
            self._checkpoints.keep_relaxing(step)
            if progress is not None:
                progress(steps, most, self._timeline.time(step))

        try:
            relaxation.run(lambda: self._asked(interrupts), between)
        finally:
            if self._folder is not None:
                self._folder.table("relax.csv", relaxations.columns)
        if relaxation.done:
            taken = relaxations.end()
            self._composition.program.forget()  # its pairs may have been found anew
            # Before the first step the ledger has not begun.
            self._ledger.taken += taken if step > 0 else 0.0
            self._records.retimed()
        return relaxation.done

    def _begin(self) -> None:
        """Take the state at the start: its energy is what the ledger begins with."""
        # After a relaxation the forces between bodies stand: depths at a start are taken as none.
        if not self._relaxations.before_the_start:
            for interaction in self._composition.interactions:
                interaction.start()
            if self._composition.joint is not None:
                self._composition.joint.start()
        account = self.check(0)
        # Works that stand after a relaxation are not of the run.
        self._records.begin()
        self._records.collect(0)
        self._records.take(0, account)

    def _block(self, step: int, outside: Sequence[int] = ()) -> int:
        """Steps until something is due, or the rings are full, or the state has to be checked."""
        due = [self._timeline.last, self._checks.watch.due, *self._records.due(), *self._checkpoints.due(), *outside]
        due += [self._relaxations.due] if self._relaxations.due is not None else []
        if self._control.adapts:
            due.append(self._control.look)
        most = RING if self._composition.program.looked else CHECK_STEPS
        due.append(step - step % most + most)  # wherever the run has been taken up
        return min(each for each in due if each > step) - step

    def _steps(self, count: int, interrupts: Interrupts) -> int:
        """Run `steps` steps, fewer where the run is asked to end; returns how many."""
        program = self._composition.program
        program.prepare(count)
        before = time.perf_counter()
        if self._domain.size == 1:
            done = program.run(count, lambda: bool(interrupts.asked))
        else:
            done = self._steps_together(count, interrupts)
        wp.synchronize_device(self._composition.device)
        self._inside += time.perf_counter() - before
        return done

    def record(self) -> None:
        """Record the state that the run has come to, which its result is taken at, in place of what was recorded at this
        step before the state was changed."""
        account = self._ledger.account(self._sums(self._step))
        self._last = self._step, account
        self._records.collect(self._step)
        self._records.end(self._step, account)

    def _steps_together(self, count: int, interrupts: Interrupts) -> int:
        """The same in processes that share the scene: now and then they hear whether one has been asked to end."""
        done = 0
        while done < count and not (done > 0 and self._asked(interrupts)):
            steps, began = min(self._apart, count - done), time.perf_counter()
            with ending_together(self._domain):
                done += self._composition.program.run(steps)
            pace = int(TOGETHER_SECONDS * steps / max(time.perf_counter() - began, 1e-9))
            self._apart = self._domain.told(lambda pace=pace: min(max(pace, 1), 4 * self._apart))
        return done

    def _asked(self, interrupts: Interrupts) -> bool:
        """Whether any process has been asked to end: then all are."""
        asked = interrupts.asked
        if self._domain.size > 1:
            signal_of, enough = self._domain.max(np.array([asked, -asked])).tolist()  # ENOUGH is below zero
            # What comes in the meantime is for the next question: all have one answer.
            if asked := signal_of or -enough:
                interrupts.asked = asked
        return bool(asked)

    def _sums(self, step: int) -> list[BodySums]:
        """Bring the state of a step up to date, and sum it up. Raises Unstable where it is not finite."""
        bodies = self._composition.bodies
        if step > 0:
            self._composition.publish()
        else:
            for run in bodies:
                run.system.refresh(run.system.state)
        sums = [run.diagnostics.measure(run.system.state) for run in bodies]
        self._checks.finite(step, sums)
        return sums

    def check(self, step: int) -> Account:
        """The ledger of a state that the run may go on from. Raises Unstable where it may not."""
        # What is said of the end is not of a run that goes on from there.
        with keeping(self._checks.said if step < self._timeline.last else self._said_at_end):
            return self._look(step)

    def _look(self, step: int) -> Account:
        sums = self._sums(step)
        self._checks.apart(step)
        account = self._ledger.account(sums) if step > 0 else self._ledger.open(sums)
        self._control.check_limits(step, sums)
        stop = self._checks.energy(step, account)
        if stop is not None:
            self._records.row(step, account)
            raise stop
        self._last = step, account
        self._checks.findings.look(step, self._timeline.time(step), sums, account)
        if self._control.follow(step, sums):
            self._records.retimed()
        self._control.clump(step)
        return account

    def _result(self, ending: Ending, failure: Unstable | None) -> Result:
        """The result of the run; written, where it has a folder."""
        scene, history = self._composition.scene, self._records.history()
        with keeping(self._said_at_end):
            for words in untouched(scene, history) if ending.first == 0 and failure is None else ():
                warn(f"unlikely: {words}")
        found = dict.fromkeys(
            [*self._checks.findings.words, *self._composition.said, *self._checks.said, *self._said_at_end]
        )
        said = summary(self._composition, self._ledger, history, ending, list(found))
        if self._relaxations.asked:
            said["relaxation"] = self._relaxations.summary
        said["units"] = self._records.table_units()
        if self._folder is not None:
            self._records.write_tables()
            self._folder.summary(said)
        wanted = tuple(dict.fromkeys(("velocity", "stress", *scene.output.fields)))
        particles, t = self._records.particles(wanted), self._timeline.time(ending.step)
        probes = self._records.probes()
        cells = self._records.cells(wanted)
        read = [
            fields.primitive(key.partition("[")[0]) for columns in probes.values() for key in columns if key != "time"
        ]
        units = self._records.units(tuple(dict.fromkeys((*wanted, *read))))
        return Result(scene, ending.status, ending.reason, t, history, probes, particles, said, failure, cells, units)
