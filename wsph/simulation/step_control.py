"""Control of a run's time step: the first one, how it follows the deformation, limits that fall, particles that clump.

A body's limit is recomputed where it has deformed (`wsph.stability.limit`). With `run.cfl` the time step shrinks with it, by
whole parts of an octave at steps that depend on the deformation alone, so that bits do not depend on the cadence of records
or on resumption; with `run.dt` a run whose limit falls below its step is stopped, or warned of, by name.
"""

# pyright: strict

from collections.abc import Sequence
from typing import TypedDict, cast

import numpy as np

from wsph.backend.clock import Clock
from wsph.errors import Refused
from wsph.plugins import integrators, registry
from wsph.scene.tables import Run
from wsph.simulation.checks import unstable, warn
from wsph.simulation.composing.composition import BodyRun, Composition, integrators_of
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.timeline import Timeline, TimeStep, UnsetClock
from wsph.stability.limit import SLACK, Known

AUTO = "auto"
"""The value of `run.cfl` by which the limits of the bodies choose the time step."""

SAFE, WITH_CONTACT = 0.95, 0.7
"""The Courant number of `cfl = "auto"`, as a part of the limit. A penalty's step as a part of its bound: contacts open and
close inside of steps, and beyond this part of it they make energy."""

MOST_APART, CHANGE = 64, 0.02
"""The most steps between two looks at the time step, and the change of the logarithm of a share of a limit that no look is
made for."""

BEYOND = 1.05
"""A step that began beyond the limit is shortened where its share of it has grown by this."""

SLOPE = 1.0
"""Logarithm of a share of a limit per logarithm of distortion that looks are paced by, at least."""

CLUMPED = float(np.log(100.0))
"""e-folds of a growing mode after which a run says so."""

OCTAVE = 16
"""The time step shrinks in parts of an octave."""

LEAST_STEP = 1e-3
"""A time step that has shrunk below this part of the first is the end of a run."""


def given_step(run: Run, end: float, shortest: float, device: str, integrator: str) -> TimeStep:
    """The time step that a scene gives, or with `cfl = "auto"` one still to be settled. `shortest` [s] is the smallest
    spacing over wave speed of its bodies, the run's unit of time."""
    if run.cfl == AUTO:
        left = integrators.automatic(registry.load("integrators", run.integrator.name), run.integrator.options())
        because = f"for its {left[0]}, " if left else ""
        refusal = (
            f'run.cfl = "auto": {integrator} asks for the time step, {because}before its limit is known:'
            f" give {', '.join([*left, 'run.cfl'])} or run.dt a number"
        )
        return TimeStep(UnsetClock(device, refusal), Timeline(end, shortest))
    if run.dt is not None:
        return TimeStep(Clock(run.dt / shortest, device), Timeline(end, run.dt))
    courant = float(run.cfl or 0.0)
    return TimeStep(Clock(courant, device), Timeline(end, courant * shortest))


def settle(time_step: TimeStep, bodies: Sequence[BodyRun], shortest: float, integrator: str) -> None:
    """Choose a time step that the scene leaves open, by the limits of its bodies. Raises Refused where they say none."""
    clock = time_step.clock
    if isinstance(clock, UnsetClock):
        courant = min(_suiting(run, shortest, integrator) for run in bodies)
        clock.choose(courant)
        time_step.timeline = Timeline(time_step.timeline.end, courant * shortest)
        for each in integrators_of(bodies):
            integrators.begin(each)


def _suiting(run: BodyRun, shortest: float, integrator: str) -> float:
    """The largest Courant number, of a body whose spacing over wave speed is `shortest`, that suits this one: SAFE of its
    limit, what keeps energy where others push the body, or where its integrator is exact."""
    limit, crossing = run.limit, run.system.spacing / run.constitutive.wave_speed
    if limit is None or not np.isfinite(limit):
        raise Refused(
            f'run.cfl = "auto": body {run.body.name!r} has no limit to go by ({run.limit_reason}): give run.cfl or run.dt a number'
        )
    if limit <= 0.0:
        raise Refused(
            f'run.cfl = "auto": body {run.body.name!r} has no stable time step with {integrator} ({run.limit_reason}): use another'
            " integrator, or give run.cfl or run.dt a number"
        )
    exact = integrators.exact(run.integrator)
    courant = exact if exact is not None else keeping_energy(run) if run.stability.pushed else SAFE * limit
    return min(courant * (crossing / shortest), SAFE * min(run.longest_steps.values()) / shortest)


def keeping_energy(run: BodyRun) -> float:
    """The largest Courant number of a body that others push with which contacts that open and close inside of steps make no
    energy: WITH_CONTACT of its limit, and of leapfrog's, as methods that hold longer waves damp what contact swings by."""
    swing = run.stability.swing
    limits = (run.limit, None if swing is None else swing())
    return WITH_CONTACT * min((limit for limit in limits if limit is not None), default=np.inf)


class Watch(TypedDict):
    """How far the watch over deformation has come: growth in e-folds and the step that it is up to, steps between looks, the
    next look and the shares of limits seen, in logarithms, and what is known of the limit of every body."""

    clumps: tuple[list[float], int]
    pace: tuple[int, int, list[tuple[float, float]]]
    limits: list[Known]


class StepFacts(TypedDict):
    """What a checkpoint holds of the time step: the pieces of the timeline, and the watch."""

    timeline: list[tuple[int, float, float]]
    watch: Watch


class StepControl:
    """Control of the time step of one run. `look` is the step at which it is looked at next."""

    def __init__(self, composition: Composition):
        run = composition.scene.run
        self._bodies, self._step, self._unit = composition.bodies, composition.time_step, composition.scales.time
        self._guard = run.guard
        self.adapts = run.cfl is not None and run.guard != "off" and any(body.stability.adapts for body in self._bodies)
        self.look = 1
        self._pace, self._seen = 1, [(0.0, 0.0)] * len(self._bodies)
        self._folds, self._since = [0.0] * len(self._bodies), 0
        self._warned = False

    def kept(self) -> StepFacts:
        """The numbers that a checkpoint holds of it."""
        return {
            "timeline": self._step.timeline.pieces,
            "watch": {
                "clumps": (self._folds, self._since),
                "pace": (self._pace, self.look, self._seen),
                "limits": [run.stability.kept() for run in self._bodies],
            },
        }

    def restore(self, facts: StepFacts) -> None:
        """Put back what `kept` gave."""
        self._step.restore(facts["timeline"])
        watch = facts["watch"]
        self._folds, self._since = watch["clumps"]
        self._pace, self.look, self._seen = watch["pace"]
        for run, limit in zip(self._bodies, watch["limits"], strict=True):
            run.stability.restore(cast(Known, tuple(limit)))

    def check_limits(self, step: int, sums: Sequence[BodySums]) -> None:
        """Follow the deformation: the Courant number does where operators follow it, its limit where the stiffness does.
        Raises Unstable where a fixed step is beyond the limit."""
        if self._guard == "off" or self.adapts:
            return
        for run, each in zip(self._bodies, sums, strict=True):
            if run.limit:
                self._check_limit(step, run, each)

    def _check_limit(self, step: int, run: BodyRun, sums: BodySums) -> None:
        local, moves = _local(run, sums), run.system.traits.courant_follows
        run.stability.follow(sums.distortion, local, step, run.work, fixed=True)
        limit = run.limit if run.limit is not None else np.inf  # zero where nothing is stable any more
        within = local <= limit * (1.0 + SLACK) or not run.stability.sure
        if within or not (moves or run.stability.distortion != 1.0):
            return
        if moves:
            what = f"a particle's own Courant number has become {local:.6g} by deformation"
        else:
            what = "its stability limit has fallen below its Courant number by deformation"
        what += "; use a smaller run.dt, or run.cfl, with which it follows"
        if self._guard == "refuse":
            raise unstable(self._step.timeline, step, run, "time step", what)
        if not self._warned:
            self._warned = True
            warn(f"step {step}: {what}, limit {run.limit:.3f}")

    def follow(self, step: int, sums: Sequence[BodySums]) -> bool:
        """Shorten the time step where deformation has brought a body's Courant number half of the way to its limit: to the
        share of the limit that it began with. Whether it did; raises Unstable where no step would be left."""
        if not self.adapts or step != self.look:
            return False
        shortened = self._shorten(step, sums)
        self._pace = self._pace_on(sums)
        self.look = step + self._pace
        return shortened

    def settle(self, step: int, sums: Sequence[BodySums]) -> None:
        """Follow the deformation in a relaxation before a step. Raises Unstable as in the steps of a run."""
        self.check_limits(step, sums)
        if self.adapts:
            self._shorten(step, sums)

    def _shorten(self, step: int, sums: Sequence[BodySums]) -> bool:
        """Shorten the time step where it is half of the way to a limit; whether it was."""
        factor = 1.0
        for run, each in zip(self._bodies, sums, strict=True):
            if run.stability.adapts:
                local, most = _local(run, each), _most(run)
                run.stability.follow(each.distortion, local / most, step, run.work, fixed=False)
                share = local / run.limit if run.limit else np.inf
                if share > most * run.stability.leeway:
                    # To what it began with; where the limit is an estimate, no further than it has to.
                    factor = min(factor, (run.stability.share if run.stability.measured else most) / share)
        if factor == 1.0 or step >= self._step.timeline.last:
            return False
        # By whole parts of an octave: a rounding of the deformation changes no step.
        factor = 2.0 ** (np.floor(OCTAVE * np.log2(max(factor, 0.1 * LEAST_STEP))) / OCTAVE)
        dt = self._step.dt * factor
        if dt < LEAST_STEP * self._step.first:
            what = f"deformation asks for steps of {dt:.3g} s, below a thousandth of the first"
            raise unstable(self._step.timeline, step, self._bodies[0], "time step", what)
        self._step.shorten(step, factor)
        for each in integrators_of(self._bodies):
            integrators.begin(each)
        return True

    def _pace_on(self, sums: Sequence[BodySums]) -> int:
        """Steps to the next look, by how fast shares of limits and, where an estimate of those is older, distortions change:
        no share is to come half of the way to where the step is shortened, or CHANGE, before."""
        pace, seen = float(MOST_APART), list[tuple[float, float]]()
        for run, each, (before, distortion) in zip(self._bodies, sums, self._seen, strict=True):
            share = (
                _local(run, each) / run.limit if run.limit else 0.0
            )  # without a limit, or with none that is finite: zero
            now = float(np.log(share)) if share > 0.0 else 0.0, float(np.log(each.distortion))
            change = max(abs(now[0] - before), SLOPE * abs(now[1] - distortion))
            if run.stability.adapts and change > 0.0:
                room = max(0.5 * (float(np.log(_most(run))) - now[0]), CHANGE)
                pace = min(pace, self._pace * room / change)
            seen.append(now)
        self._seen = seen
        return int(np.clip(min(pace, 2.0 * self._pace), 1, MOST_APART))

    def clump(self, step: int) -> None:
        """Warn of bodies whose particles have begun to clump together: the tensile instability of pairs that follow the
        motion (Swegle et al. 1995). Energy is kept in it, so that nothing else tells."""
        time = self._step.timeline.time
        passed = (time(step) - time(self._since)) / self._unit
        self._since = step
        if self._guard == "off":
            return
        for k, run in enumerate(self._bodies):
            if not run.system.traits.clumps or self._folds[k] > CLUMPED:
                continue
            self._folds[k] += run.stability.growth * passed
            if self._folds[k] > CLUMPED:
                pace = run.stability.growth * self._step.dt / self._unit
                warn(
                    f"step {step}: particles of body {run.body.name!r} clump together: a mode grows by {pace:.2g} a step about its"
                    " deformed state, by more than 100 so far, which no energy tells (tensile instability of pairs that follow the"
                    ' motion); use formulation = "total-lagrangian" or "stress-points", whose pairs do not'
                )


def _most(run: BodyRun) -> float:
    """The share of its limit beyond which the time step is shortened: half of the way from what it began with. A run that
    began beyond the limit has been told so."""
    began = run.stability.share
    return (0.5 * (1.0 + began) if began <= 1.0 + SLACK else BEYOND * began) * (1.0 + SLACK)


def _local(run: BodyRun, sums: BodySums) -> float:
    """The largest Courant number of a particle."""
    return run.courant * (sums.stretch if run.system.traits.courant_follows else 1.0)
