"""The relaxations of a run, one after the other: that before the first step, and those before steps of [[steps]]."""

# pyright: strict

from collections.abc import Mapping
from typing import TypedDict

import numpy as np

from wsph.protocols import DeviceArray
from wsph.ranks.kept import Piece
from wsph.scene.states import Relax
from wsph.simulation.checks import Checks
from wsph.simulation.composing.composition import Composition
from wsph.simulation.starting.relaxation import COLUMNS, Relaxation, RelaxFacts, Rested
from wsph.simulation.step_control import StepControl

START = "start"
"""The name of the relaxation before the first step where no step of [[steps]] has it."""


class Done(TypedDict):
    """A relaxation that is over: before which step of [[steps]], at which time [s], its rows, and what it came to."""

    name: str
    time: float
    rows: list[list[float]]
    summary: Rested


class RelaxationsFacts(TypedDict):
    """What a checkpoint holds of the relaxations: those that are over, and the one in whose middle it stands."""

    done: list[Done]
    current: RelaxFacts | None


class Relaxations:
    """The relaxations of one run: the one that is in progress (`current`), and the others."""

    def __init__(self, composition: Composition, control: StepControl, checks: Checks):
        scene = composition.scene
        self._composition, self._control, self._checks = composition, control, checks
        self._plans: list[tuple[str, float, Relax]] = []
        if scene.relax is not None:
            self._plans.append((START, 0.0, scene.relax))
        stages = zip(scene.steps, scene.begins, strict=False)
        self._plans += [(stage.name, begins, stage.relax) for stage, begins in stages if stage.relax is not None]
        self._done: list[Done] = []
        self.current: Relaxation | None = None

    @property
    def asked(self) -> bool:
        """Whether the scene asks for any."""
        return bool(self._plans)

    @property
    def before_the_start(self) -> bool:
        """Whether there is one before the first step."""
        return bool(self._plans) and self._plans[0][1] == 0.0

    @property
    def due(self) -> int | None:
        """The step before which the next one is to be; None where there is none any more."""
        if len(self._done) == len(self._plans):
            return None
        time = self._plans[len(self._done)][1]
        return 0 if time == 0.0 else self._composition.time_step.timeline.at_or_after(time)

    def start(self, step: int) -> Relaxation:
        """Stop the clock at a step, for the next one."""
        name, _, asked = self._plans[len(self._done)]
        self.current = Relaxation(self._composition, asked, step, name, self._control.settle, self._checks.relaxing)
        self.current.prepare()
        return self.current

    def end(self) -> float:
        """Close the current one, which is at rest; the energy that it has taken, nondimensional."""
        assert self.current is not None
        name, time, asked = self._plans[len(self._done)]
        self._checks.rested(asked.until * self.current.taken)
        self._done.append({"name": name, "time": time, "rows": self.current.rows, "summary": self.current.summary})
        taken, self.current = self.current.taken, None
        return taken

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The columns of relax.csv."""
        parts = [(each["time"], each["rows"]) for each in self._done]
        if self.current is not None:
            parts.append((self._plans[len(self._done)][1], self.current.rows))
        rows = [[time, *row] for time, rows in parts for row in rows]
        table = np.array(rows).reshape(len(rows), len(COLUMNS) + 1)
        whole = ("step", "peaks")
        names = ("time", *COLUMNS)
        return {name: table[:, k].astype(int) if name in whole else table[:, k] for k, name in enumerate(names)}

    @property
    def summary(self) -> Mapping[str, object]:
        """What summary.json says: of the only one, or by the steps before which they are."""
        found = {each["name"]: each["summary"] for each in self._done}
        if self.current is not None:
            found[self._plans[len(self._done)][0]] = self.current.summary
        return dict(found.get(START, {})) if [name for name, _, _ in self._plans] == [START] else dict(found)

    def arrays(self) -> dict[str, DeviceArray]:
        """The device arrays that a checkpoint holds of them, by name."""
        return self.current.arrays() if self.current is not None else {}

    def pieces(self) -> dict[str, list[Piece]]:
        """Where they stand in those of all processes that share the bodies."""
        return self.current.pieces() if self.current is not None else {}

    def kept(self) -> RelaxationsFacts:
        """The numbers that a checkpoint holds of them."""
        return {"done": self._done, "current": self.current.kept() if self.current is not None else None}

    def restore(self, facts: RelaxationsFacts, step: int, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on with what `kept` gave, at a step; before the bodies' arrays are put back."""
        self._done = facts["done"]
        if facts["current"] is not None:
            self.start(step).restore(facts["current"], arrays)
