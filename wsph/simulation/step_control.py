"""Watching a run's stability: the time step that follows the deformation, limits that fall, particles that clump.

A body's limit is measured anew where it has deformed (`BodyRun.follow`). With `run.cfl` the time step shrinks with it, by
whole parts of an octave at steps that depend on the deformation alone, so that bits do not depend on the cadence of records
or on resumption; with `run.dt` a run whose limit falls below its step is stopped, or warned of, by name.
"""

import warnings
from typing import Any

import numpy as np

from wsph.errors import Unstable
from wsph.simulation.composition import BodyRun, Composition
from wsph.simulation.diagnostics import Ledger
from wsph.simulation.timeline import Timeline
from wsph.stability.limit import SLACK

MOST_APART, CHANGE = 256, 0.01
"""The time step is looked at as often as the deformation changes by CHANGE, at least once in so many steps."""

CLUMPED = float(np.log(100.0))
"""e-folds of a growing mode after which a run says so."""

OCTAVE = 16
"""The time step shrinks in parts of an octave."""

LEAST_STEP = 1e-3
"""A time step that has shrunk below this part of the first is the end of a run."""


def warn(text: str) -> None:
    """Warn of something that a run has met."""
    warnings.warn(text, RuntimeWarning, stacklevel=5)


class Watch:
    """What is known of the stability of one run. `look` is the step at which its time step is looked at next."""

    def __init__(self, composition: Composition, timeline: Timeline):
        self.c, self._time = composition, timeline
        run = composition.scene.run
        self._guard = run.guard
        self.adapts = run.cfl is not None and run.guard != "off" and any(body.adapts for body in composition.bodies)
        self.look = 1
        self._pace, self._seen = 1, 0.0
        self._folds, self._since = [0.0] * len(composition.bodies), 0
        self._warned = False

    def kept(self) -> dict[str, Any]:
        """What a checkpoint holds of it."""
        return {
            "clumps": [self._folds, self._since],
            "pace": [self._pace, self.look, self._seen],
            "limits": [[run.limit, run.distortion] for run in self.c.bodies],
        }

    def restore(self, facts: dict[str, Any]) -> None:
        """Put back what `kept` gave, on a timeline that stands where it stood."""
        self._folds, self._since = facts["clumps"]
        self._pace, self.look, self._seen = facts["pace"]
        for run, (limit, distortion) in zip(self.c.bodies, facts["limits"], strict=True):
            run.courant *= self._time.dt / self.c.dt
            run.limit, run.distortion = limit, distortion

    def check_limits(self, step: int, ledgers: list[Ledger]) -> None:
        """Where operators follow the deformation, so does the Courant number; where the stiffness does, so does its limit.
        Raises Unstable where a step that does not follow is beyond it."""
        if self._guard == "off" or self.adapts:
            return
        for run, ledger in zip(self.c.bodies, ledgers, strict=True):
            if run.limit:
                self._check_limit(step, run, ledger)

    def _check_limit(self, step: int, run: BodyRun, ledger: Ledger) -> None:
        run.follow(ledger.distortion)
        local, moves = _local(run, ledger), run.system.traits.courant_follows
        limit = run.limit if run.limit is not None else np.inf  # zero where nothing is stable any more
        if local <= limit * (1.0 + SLACK) or not (moves or run.distortion != 1.0):
            return
        if moves:
            what = f"a particle's own Courant number has become {local:.6g} by deformation"
        else:
            what = "its stability limit has fallen below its Courant number by deformation"
        what += "; use a smaller run.dt, or run.cfl, with which it follows"
        if self._guard == "refuse":
            raise self.unstable(step, run, "time step", what)
        if not self._warned:
            self._warned = True
            warn(f"step {step}: {what}, limit {run.limit:.3f}")

    def follow(self, step: int, ledgers: list[Ledger]) -> bool:
        """Shorten the time step where deformation has brought a body's Courant number half of the way to its limit: to the
        share of the limit that it began with. Whether it did; raises Unstable where no step would be left."""
        if not self.adapts or step != self.look:
            return False
        seen = max(float(np.log(max(ledger.stretch, ledger.distortion))) for ledger in ledgers)
        change, self._seen = abs(seen - self._seen), seen
        paces = self._pace * CHANGE / change if change > 0.0 else np.inf
        self._pace = int(np.clip(min(paces, 2.0 * self._pace), 1, MOST_APART))
        self.look = step + self._pace
        factor = 1.0
        for run, ledger in zip(self.c.bodies, ledgers, strict=True):
            if run.adapts:
                run.follow(ledger.distortion)
                share = _local(run, ledger) / run.limit if run.limit else np.inf
                if share > 0.5 * (1.0 + run.share) * (1.0 + SLACK):
                    factor = min(factor, run.share / share)
        if factor == 1.0 or step >= self._time.last:
            return False
        # By whole parts of an octave: what rounding changes of the deformation changes no step.
        factor = 2.0 ** (np.floor(OCTAVE * np.log2(max(factor, 0.1 * LEAST_STEP))) / OCTAVE)
        dt = self._time.dt * factor
        if dt < LEAST_STEP * self.c.dt:
            what = f"deformation asks for steps of {dt:.3g} s, below a thousandth of the first"
            raise self.unstable(step, self.c.bodies[0], "time step", what)
        self.c.shorten(factor)
        self._time.shorten(step, dt)
        return True

    def clump(self, step: int) -> None:
        """Warn of bodies whose particles have begun to clump together: the tensile instability of pairs that follow the
        motion (Swegle et al. 1995). Energy is kept in it, so that nothing else tells."""
        passed = (self._time.time(step) - self._time.time(self._since)) / self.c.scales.time
        self._since = step
        if self._guard == "off":
            return
        for k, run in enumerate(self.c.bodies):
            if not run.system.traits.clumps or self._folds[k] > CLUMPED:
                continue
            self._folds[k] += run.system.growth * passed
            if self._folds[k] > CLUMPED:
                pace = run.system.growth * self._time.dt / self.c.scales.time
                warn(
                    f"step {step}: particles of body {run.body.name!r} clump together: a mode grows by {pace:.2g} a step about its"
                    " deformed state, by more than 100 so far, which no energy tells (tensile instability of pairs that follow the"
                    ' motion); use formulation = "total-lagrangian" or "stress-points", whose pairs do not'
                )

    def unstable(
        self, step: int, run: BodyRun, name: str, what: str, particle: int = -1, position: Any = ()
    ) -> Unstable:
        """The error that names what was found, where and when, and the limit. `name` is a field, or what else is wrong."""
        t, dt, limit = self._time.time(step), self._time.dt, run.limit
        place = f" of particle {particle} at ({', '.join(f'{x:g}' for x in position)}) m" if particle >= 0 else ""
        bound = f", limit {limit:.3f}" if limit is not None else ""
        message = (
            f"found unstable at step {step}, t = {t:.6g} s (dt = {dt:.4g} s): {name}{place} of body {run.body.name!r}: {what};"
            f" Courant number {run.courant:.6g}{bound}"
        )
        return Unstable(
            message, step=step, time=t, dt=dt, field=name, particle=particle, position=position, limit=limit
        )


def _local(run: BodyRun, ledger: Ledger) -> float:
    """The largest Courant number of a particle."""
    return run.courant * (ledger.stretch if run.system.traits.courant_follows else 1.0)
