"""Dynamic relaxation: bodies brought to rest before the clock starts, by kinetic damping (see `quench` beside this).

The steps are those of the run, with its integrator, its masses and its time step, while the clock is still: loads are those
of t = 0, and what is driven stays where it is. A body is at rest where its kinetic energy has stayed below a part of the
energy that it has stored for as long as the longest way between two of its peaks, while nothing was stopped: the slowest of
its motions would have shown in that time.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TypedDict, cast

import numpy as np

from wsph.backend.arrays import Arrays, put
from wsph.backend.domain import ending_together
from wsph.backend.graph import Program
from wsph.backend.state import State
from wsph.errors import Unstable
from wsph.plugins import integrators
from wsph.protocols import DeviceArray, Stepped
from wsph.ranks.blocks import own_sum
from wsph.ranks.kept import Piece
from wsph.scene.states import Relax
from wsph.simulation.composing.bodies import give_velocity
from wsph.simulation.composing.composition import BodyRun, Composition, Step, integrators_of
from wsph.simulation.composing.joint import JointState
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.starting.quench import AGO, HIGHEST, KINETIC, LONGEST, PEAKS, TAKEN, Quench
from wsph.simulation.starting.source import here

LATER = 1e-6
"""The part of a step ahead of the clock at which values are those of the step of [[steps]] that begins there."""

SURE = 0.8
"""The part of `relax.until` that is waited for: not all that still swings has its kinetic energy at one time."""

LOOK = 32
"""Steps between two looks of the host."""

COLUMNS = (
    "step",
    "kinetic",
    "strain",
    "kinetic_over_strain",
    "out_of_balance",
    "out_of_balance_part",
    "peaks",
    "energy_taken",
)
"""Columns of relax.csv: the kinetic energy is the largest since the row before [J]; the ratio is that of the body which is
furthest from rest; the force out of balance is the root of the sum of squares over free components [N], and beside it stands
its part of the largest so far."""

NO_REST = "relaxation"
"""The field of the error of bodies that do not come to rest."""

AT_REST, NOT_AT_REST = "at rest", "not at rest"


class Rested(TypedDict):
    """What summary.json says of a relaxation; energies [J], the force out of balance as in the last row of relax.csv."""

    status: str
    steps: int
    peaks: int
    kinetic_over_strain: float
    out_of_balance: float
    out_of_balance_part: float
    energy_taken: float


class RelaxFacts(TypedDict):
    """What a checkpoint holds of a relaxation in progress beside its arrays: its rows, the largest kinetic energies
    of the last looks by body, and the largest force out of balance."""

    rows: list[list[float]]
    highest: list[list[float]]
    largest: float


class Relaxation:
    """A relaxation, which in the end is `done`, of so many `steps`."""

    def __init__(
        self,
        composition: Composition,
        asked: Relax,
        step: int,
        name: str,
        settle: Callable[[int, Sequence[BodySums]], None],
        finite: Callable[[Sequence[BodySums], int], None],
    ):
        """Before the `step` of the run at which a step of [[steps]] with that `name` begins. `settle` follows the
        deformation with the time step, `finite` refuses a state that the run could not go on from; both raise Unstable."""
        self._step, self._name, self.taken = step, name, 0.0
        self._time = composition.time_step.timeline.time(step)
        self._composition, self._clock, self._bodies = composition, composition.clock, composition.bodies
        self._until, self._most = asked.until, asked.max_steps
        self._settle, self._finite = settle, finite
        arrays = Arrays(composition.device)
        self._quenches = [
            Quench(
                composition.space,
                run.system.state.layout,
                run.system.density * run.system.volume,
                run.system.arrays,
                arrays.part(f"{k}"),
                run.system.share,
                run.system.domain,
                run.system.bring if run.system.traits.pairs_follow else None,
            )
            for k, run in enumerate(self._bodies)
        ]
        self.done, self.steps = False, 0
        self.rows: list[list[float]] = []
        self._highest = [deque[float]() for _ in self._bodies]
        self._largest = 0.0
        self._rates: list[State] = []
        plain = Step(self._bodies, composition.joint, composition.interactions, self._clock, [])

        def damped() -> None:
            plain()
            for run, quench in zip(self._bodies, self._quenches, strict=True):
                quench.act(self._stepped(run), self._clock)

        plan = composition.program
        self._program = Program(
            damped, self._clock, composition.pairs, plan.asked, plain.before, hosted=plan.hosted, on=plan.on
        )

    @staticmethod
    def _stepped(run: BodyRun) -> State:
        """What a step of a body has advanced: of methods that keep variables of their own, these."""
        return run.system.accepted[0] if run.system.accepted is not None else run.system.state

    def compile(self) -> None:
        """Compile what it launches beside the steps of the run."""
        self._program.compile([kernel for quench in self._quenches for kernel in quench.kernels])

    def prepare(self) -> None:
        """Stop the clock, and let nothing be driven."""
        self._clock.still, self._clock.ahead = True, LATER if self._step > 0 else 0.0
        for run in self._bodies:
            if self._step > 0:
                # What stops of a motion that was driven is work of that.
                run.system.constrain(run.system.state, 0.0)  # pyright: ignore[reportAttributeAccessIssue]
            else:
                run.system.hold(run.system.state, 0.0)
            self._rates.append(run.system.temporary())  # pyright: ignore[reportAttributeAccessIssue, reportUnknownArgumentType]
        self._set_tools()

    def _set_tools(self) -> None:
        """Give what steps beside the bodies the velocities that are prescribed now."""
        for member in self._tools.values():
            member.impose(member.state, 0.0)

    @property
    def _tools(self) -> dict[str, Stepped]:
        """What steps beside the bodies, by name."""
        joint = self._composition.joint
        couplings = joint.couplings if joint is not None else ()
        return {name: member for coupling in couplings for name, member in coupling.members().items()}

    def begin(self) -> None:
        """Take what is there before the first step."""
        for run in self._bodies if self._step == 0 else ():
            run.system.start_works()
        for integrator in integrators_of(self._bodies):
            integrators.begin(integrator)
        for interaction in self._composition.interactions if self._step == 0 else ():
            interaction.start()
        if self._composition.joint is not None and self._step == 0:
            self._composition.joint.start()
        self._largest = self._unbalance()

    def run(self, stop: Callable[[], bool], between: Callable[[int, int], None]) -> None:
        """Step until all bodies are at rest, or it is asked to stop; `between(steps, most)` is called after every look.
        Raises Unstable where they are not in the most steps that the scene allows."""
        while not self.done and not stop():
            count = min(LOOK - self.steps % LOOK, self._most - self.steps)
            self._program.prepare(count)
            self.steps += self._steps(count, stop)
            if self.steps % LOOK and self.steps < self._most:
                return
            resting = self._look()
            if resting:
                self.done = True
            elif self.steps >= self._most:
                raise self._failure()
            between(self.steps, self._most)
        if self.done:
            self._release()

    def _steps(self, count: int, stop: Callable[[], bool]) -> int:
        """Run some steps, fewer where it is asked to stop; processes that share the bodies are asked between them."""
        domain = self._composition.domain
        if domain.size == 1:
            return self._program.run(count, stop)
        with ending_together(domain):
            return self._program.run(count)

    def _look(self) -> bool:
        """Add a row; whether all bodies are at rest."""
        self._composition.publish()
        sums = [run.diagnostics.measure(run.system.state) for run in self._bodies]
        self._finite(sums, self.steps)
        low = [SURE * self._until * each.strain for each in sums]
        memories = [quench.read(floor) for quench, floor in zip(self._quenches, low, strict=True)]
        worst, resting = 0.0, True
        for each, memory, highest in zip(sums, memories, self._highest, strict=True):
            highest.append(float(memory[HIGHEST]))
            # As many looks as cover the longest way between two peaks, and one.
            looks = 1 + math.ceil(float(memory[LONGEST]) / LOOK)
            while len(highest) > max(looks, 1):
                highest.popleft()
            kinetic = max(highest)
            still = memory[PEAKS] == 0.0 and kinetic == 0.0
            ratio = 0.0 if still else kinetic / each.strain if each.strain > 0.0 else math.inf
            moves = memory[PEAKS] == 0.0 and not still
            resting &= not moves and ratio <= SURE * self._until and len(highest) >= looks
            worst = max(worst, ratio)
        unbalance = self._unbalance()
        self._largest = max(self._largest, unbalance)
        scales, dim = self._composition.scales, self._composition.scene.dim
        joule = scales.stress * scales.length**dim
        taken = sum(float(memory[TAKEN]) for memory in memories)
        taken += sum(float(memory[KINETIC]) for memory in memories) * resting
        self.taken = taken
        row = [
            sum(float(memory[HIGHEST]) for memory in memories) * joule,
            sum(each.strain for each in sums) * joule,
            worst,
        ]
        row += [unbalance * joule / scales.length, unbalance / self._largest if self._largest > 0.0 else 0.0]
        row += [sum(float(memory[PEAKS]) for memory in memories), taken * joule]
        self.rows.append([self.steps, *row])
        if not resting:
            self._settle(self._step, sums)
        return resting

    def _unbalance(self) -> float:
        """The force out of balance, nondimensional: the root of the sum of squares over free components. Not a number where
        bodies push each other by impulses between steps."""
        if self._composition.interactions:
            return math.nan
        rates = dict(zip([run.body.name for run in self._bodies], self._rates, strict=True))
        states = {run.body.name: run.system.state for run in self._bodies}
        for name, tool in self._tools.items():
            states[name], rates[name] = tool.state, tool.temporary()  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
        joint = self._composition.joint
        for run in self._bodies:
            if joint is None or run.body.name not in joint.names:
                run.system.rate(run.system.state, rates[run.body.name], "velocity")  # pyright: ignore[reportAttributeAccessIssue]
        if joint is not None:
            joint.rate(JointState(states), JointState(rates), "velocity")
        total = 0.0
        for run in self._bodies:
            free = cast(Callable[[np.ndarray, float], np.ndarray], run.system.project_free)  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
            root = np.sqrt(np.repeat(run.system.density * run.system.volume, self._composition.scene.dim))
            pulled = free(
                root * rates[run.body.name].read("velocity").ravel(), self._time + 1e-6 * self._composition.time_step.dt
            )
            squares = ((root * pulled) ** 2).reshape(-1, self._composition.scene.dim).sum(1)
            total += own_sum(squares, run.system.share, run.system.domain)
        return math.sqrt(total)

    def _release(self) -> None:
        """Let the clock go from a state at rest; before the first step with what bodies start with."""
        self._clock.still = False
        for run in self._bodies:
            system = run.system
            system.bring()
            system.state.write("velocity", np.zeros((system.count, self._composition.scene.dim)))
            if self._step == 0:
                give_velocity(self._composition.scene, run.body, system)
                system.hold(system.state, 0.0)
                system.refresh(system.state)
                system.start_works()
        self._set_tools()
        for integrator in integrators_of(self._bodies):
            integrators.begin(integrator)

    def _failure(self) -> Unstable:
        """The error of bodies that are not at rest."""
        _, _, _, ratio, _, part, peaks, _ = self.rows[-1]
        part_said = f", the force out of balance is {part:.2g} of the largest" if math.isfinite(part) else ""
        held = "" if peaks else ": none has passed a peak, as of a body that nothing holds"
        what = (
            f"relaxation{self._place}: not at rest after {self.steps} steps: kinetic energy is {ratio:.3g} of the energy stored, relax.until ="
            f" {self._until:g}{part_said}{held}; raise relax.max_steps, or relax.until, or hold what moves"
        )
        return Unstable(what, step=self._step, time=self._time, dt=self._composition.time_step.dt, field=NO_REST)

    @property
    def _place(self) -> str:
        """Of a relaxation in the middle of a run, where."""
        return f" before step {self._name}, t = {self._time:.6g} s" if self._step > 0 else ""

    @property
    def summary(self) -> Rested:
        """What summary.json says of it."""
        _, _, _, ratio, unbalance, part, peaks, taken = self.rows[-1] if self.rows else [0.0] * len(COLUMNS)
        status = AT_REST if self.done else NOT_AT_REST
        return {
            "status": status,
            "steps": self.steps,
            "peaks": int(peaks),
            "kinetic_over_strain": ratio,
            "out_of_balance": unbalance,
            "out_of_balance_part": part,
            "energy_taken": taken,
        }

    def arrays(self) -> dict[str, DeviceArray]:
        """The device arrays that a checkpoint holds of it, by name."""
        found: dict[str, DeviceArray] = {}
        for k, each in enumerate(self._quenches):
            kept: Mapping[str, DeviceArray] = each.kept()
            found |= {f"relax{k}.{name}": array for name, array in kept.items()}
        return found

    def pieces(self) -> dict[str, list[Piece]]:
        """Where they stand in those of all processes that share the bodies."""
        found: dict[str, list[Piece]] = {}
        for k, (run, each) in enumerate(zip(self._bodies, self._quenches, strict=True)):
            found |= {f"relax{k}.{name}": pieces for name, pieces in each.pieces(run.system.pieces()).items()}
        return found

    def kept(self) -> RelaxFacts:
        """The numbers that a checkpoint holds of it."""
        highest = [list(each) for each in self._highest]
        return {"rows": self.rows, "highest": highest, "largest": self._largest}

    def restore(self, facts: RelaxFacts, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on with what `kept` gave, and the arrays of a checkpoint."""
        pieces = self.pieces() if self._composition.domain.size > 1 else {}
        for name, array in self.arrays().items():
            value = here(arrays, name, pieces.get(name))
            put(array, arrays[name] if value is None else value)
        self.rows, self._largest = facts["rows"], facts["largest"]
        self._highest = [deque(each) for each in facts["highest"]]
        self.steps = int(self._quenches[0].memory.numpy()[AGO])
