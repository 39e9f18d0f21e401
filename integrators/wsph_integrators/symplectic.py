"""Methods that keep energy: leapfrog, its processed fourth-order form, and a fourth-order splitting, on one set."""

# pyright: strict

import math

import numpy as np

from wsph.protocols import AnyState, OneSet
from wsph.stability.regions import Limit, alternating_limit, splitting_limit, undamped_limit


class Leapfrog:
    """Kick, drift, kick (velocity Verlet; Verlet 1967), second order, one evaluation a step, omega dt <= 2: the default.

    Nothing explicit holds waves longer per evaluation. Laws that depend on stress are taken at the middle of the step
    (without it Perzyna is first order and Jaumann 1.86), viscosity at the predicted velocity v + dt/2 a. Plastic flow of
    one direction keeps the order; where it turns, the return to the yield surface is of first order. With `lagged`
    viscosity is taken at the middle of the step instead: first order, but it holds almost twice the step where viscosity
    sets the limit, as in shocks.
    """

    formulations = ("stress-points", "total-lagrangian", "updated-lagrangian")
    order = 2
    evaluations = 1
    fresh = True
    symplectic = True

    def __init__(self, system: OneSet, lagged: object = False):
        if not isinstance(lagged, bool):
            raise ValueError(f"lagged = {lagged!r}: true or false")
        self.system, self.state, self.lagged = system, system.state, lagged
        # Where neither forces nor the work of moved particles ask for a velocity there is nothing to predict, and one
        # acceleration is enough.
        self.predicts = not lagged and (system.damped or system.moved)
        self.k = system.new()
        self.old = system.new() if self.predicts else self.k

    def begin(self) -> None:
        """The forces at the start."""
        self.system.rate(self.state, self.old, "velocity")

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        s = self.system
        if not s.damped or not 0.0 < s.frequency < np.inf:
            return undamped_limit(s, 2.0)
        return alternating_limit(s, 2.0 if self.lagged else 4.0)

    def oscillation(self) -> float:
        """dt^2/8 sum m |a|^2 of the state at the end of a step: what the sum of kinetic and potential energy there is above
        the energy that the method keeps, for small motions to the last digit."""
        return 0.25 * self.system.clock.dt**2 * self.system.kinetic(self.k if not self.predicts else self.old)

    def step(self) -> None:
        """One step, by launches alone."""
        s, y, k, old = self.system, self.state, self.k, self.old
        s.combine(y, plain=[(1.0, y)], timed=[(0.5, old)], part="velocity")
        s.constrain(y, 0.5)
        s.drift(y, k, 1.0, ahead=0.5)
        s.project(y)
        if self.predicts:
            # The velocity at the end, predicted with the old acceleration, for what depends on it; then with the mean of
            # both.
            s.combine(y, plain=[(1.0, y)], timed=[(0.5, old)], part="velocity")
        if not self.lagged:
            s.constrain(y, 1.0)
        s.rate(y, k, "velocity")
        change = [(0.5, k), (-0.5, old)] if self.predicts else [(0.5, k)]
        s.combine(y, plain=[(1.0, y)], timed=change, part="velocity")
        if self.predicts:
            s.combine(old, plain=[(1.0, k)], part="velocity")
        s.accept(y)


class BlanesMoan4:
    """The six-stage splitting of fourth order SRKN 6b (Blanes & Moan 2002): energy studies of smooth, undamped bodies.

    omega dt <= 3.163, 0.53 per evaluation: from there to 3.168 a wave grows, by up to 0.24 % a step, and a body of many
    waves has one there; beyond, up to 5.03, waves are held again. Forces must follow from the displacements alone: of a
    law of rates a drift knows no exact step, and a drift back in time would undo what flowed. Driven particles move by
    Gauss' two points a drift, which keeps the order.
    """

    formulations = ("stress-points", "total-lagrangian")
    order = 4
    evaluations = 6
    fresh = True
    symplectic = True
    kicks = (0.0829844064174052, 0.396309801498368, -0.0390563049223486)
    drifts = (0.245298957184271, 0.604872665711080)

    def __init__(self, system: OneSet):
        self.system, self.state = system, system.state
        self.k = system.new()
        b, a = self.kicks, self.drifts
        self._kicks = (*b, 1.0 - 2.0 * sum(b), *reversed(b))
        third = 0.5 - sum(a)
        self._drifts = (*a, third, third, *reversed(a))
        if system.damped:
            raise ValueError("a splitting of force and motion takes no damping and no viscosity: use leapfrog")
        if not system.form.total:
            raise ValueError(
                "a splitting of force and motion takes total laws, whose stress follows from the deformation, alone: with a"
                " law of rates it is of first or second order, at six evaluations: use leapfrog"
            )

    def begin(self) -> None:
        """The forces at the start."""
        self.system.rate(self.state, self.k, "velocity")

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        return undamped_limit(self.system, splitting_limit(self._kicks, self._drifts))

    def step(self) -> None:
        """One step, by launches alone."""
        s, y, k, time = self.system, self.state, self.k, 0.0
        for kick, drift in zip(self._kicks, self._drifts, strict=False):
            s.combine(y, plain=[(1.0, y)], timed=[(kick, k)], part="velocity")
            middle, gauss = time + 0.5 * drift, drift / math.sqrt(12.0)
            s.constrain(y, (middle - gauss, middle + gauss))
            s.drift(y, k, drift)
            time += drift
            s.constrain(y, time)
            s.rate(y, k, "velocity")
        s.combine(y, plain=[(1.0, y)], timed=[(self._kicks[-1], k)], part="velocity")
        s.accept(y)


REACH = 3.464
"""omega dt up to which leapfrog with the modified force holds a wave: sqrt(12)."""


class ProcessedLeapfrog:
    """Leapfrog with the modified force a(u + dt^2/12 a(u)) between a start and an output transformation (lf4; Rowlands
    1991): fourth order in the processed variables, two evaluations, omega dt <= 3.46, 1.73 per evaluation. Loads may depend
    on time: a is that of the instant, and the transformations take its change with the load's.

    For smooth, undamped, long runs of total laws; at finite amplitude use at most 0.6 of the limit. `state` is made from the
    inner variables when it is to be read, by `publish`: feeding it back would make the energy drift.
    """

    formulations = ("stress-points", "total-lagrangian")
    order = 4
    evaluations = 2
    symplectic = True

    def __init__(self, system: OneSet):
        self.system, self.state = system, system.state
        if system.damped or not system.form.total or system.moved:
            raise ValueError("lf4 takes total laws, velocities held at zero, no damping and no viscosity: use leapfrog")
        self.inner, self.moved = system.new(), system.new()
        self.k, self.first = system.new(), system.new()

    def begin(self) -> None:
        """The processed variables of the start: u - dt^2/12 a, v + dt^2/12 a'(u) v."""
        self._process(self.state, self.inner, -1.0)
        self._modified(0.0)

    def limit(self) -> Limit:
        """Largest stable Courant number and where it comes from."""
        return undamped_limit(self.system, REACH)

    def _process(self, source: AnyState, out: AnyState, sign: float) -> None:
        """out = u + sign dt^2/12 a(u, t), v - sign dt^2/12 da/dt along u' = v and the loads, by a difference over dt/4
        towards the steps that there are: forwards where a run begins, backwards where it is read."""
        s, part = self.system, 1.0 / 8.0
        s.combine(out, plain=[(1.0, source)])
        self._accelerations(source, 0.0)
        s.combine(out, plain=[(1.0, source)], squared=[(sign / 12.0, self.first)], part="rest")
        s.combine(out, plain=[(1.0, out)], timed=[(-1.5 / (12.0 * part), self.k)], part="velocity")
        s.rate(source, self.first, "rest")
        for steps, weight in ((1.0, 2.0), (2.0, -0.5)):
            away = -sign * steps * part
            s.combine(self.moved, plain=[(1.0, source)], timed=[(away, self.first)], part="rest")
            s.impose(self.moved, away)
            s.rate(self.moved, self.k, "velocity")
            s.combine(out, plain=[(1.0, out)], timed=[(weight / (12.0 * part), self.k)], part="velocity")
        s.impose(out, 0.0)

    def _accelerations(self, source: AnyState, c: float) -> None:
        """first = how the rest changes where the accelerations of `source` at t + c dt are velocities; held particles have
        none."""
        s = self.system
        s.impose(source, c)
        s.rate(source, self.k, "velocity")
        s.combine(self.moved, plain=[(1.0, self.k)], part="velocity")
        s.impose(self.moved, c)
        s.rate(self.moved, self.first, "rest")

    def _modified(self, c: float) -> None:
        """k = a(u + dt^2/12 a(u)) of the inner variables under the loads of t + c dt."""
        s, inner = self.system, self.inner
        self._accelerations(inner, c)
        s.combine(self.moved, plain=[(1.0, inner)], squared=[(1.0 / 12.0, self.first)], part="rest")
        s.rate(self.moved, self.k, "velocity")

    def step(self) -> None:
        """One step, by launches alone."""
        s, inner = self.system, self.inner
        s.combine(inner, plain=[(1.0, inner)], timed=[(0.5, self.k)], part="velocity")
        s.constrain(inner, 0.5)
        s.drift(inner, self.first, 1.0)
        self._modified(1.0)
        s.combine(inner, plain=[(1.0, inner)], timed=[(0.5, self.k)], part="velocity")
        s.accept(inner)

    def publish(self) -> None:
        """Make `state` from the inner variables (launches)."""
        self._process(self.inner, self.state, 1.0)
        self._modified(0.0)
