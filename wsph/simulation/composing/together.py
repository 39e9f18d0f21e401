"""Bodies that forces act between: one integrator for all of them, a limit for each, and a stiffness that the step leaves."""

# pyright: strict

from collections.abc import Sequence
from functools import partial

import numpy as np

from wsph.constitutive.sampling import law_named
from wsph.contact.between import Coupling
from wsph.doubts import doubt
from wsph.errors import Refused
from wsph.plugins import integrators
from wsph.plugins.blame import blame
from wsph.simulation.composing.bodies import Standing
from wsph.simulation.composing.composition import BodyRun
from wsph.simulation.composing.joint import JointSystem, share_of
from wsph.simulation.composing.setting import Setting
from wsph.simulation.step_control import keeping_energy
from wsph.simulation.timeline import TimeStep

LEAPFROG = 2.0
"""omega dt up to which leapfrog holds a wave."""

WHOLE = 1.0 - 1e-6
"""A step that is longer than it may be by rounding alone is none."""

LEAST, MOST = 0.5, 10.0
"""Stiffness of what acts between bodies, in those of the materials: below the least bodies sink into each other by more than
a cell would give way, and beyond the most nothing is gained."""


def joined_bodies(
    setting: Setting, made: Sequence[Standing], couplings: Sequence[Coupling], time_step: TimeStep
) -> tuple[JointSystem | None, dict[str, BodyRun]]:
    """The bodies that couplings act on as one system, and each of them in a run; None and nothing where there are none."""
    names = {name for coupling in couplings for name in coupling.bodies()}
    taking = [each for each in made if each.body.name in names]
    if not taking:
        return None, {}
    _refuse(setting, taking)
    joint = JointSystem({each.body.name: each.system for each in taking}, couplings, time_step.clock)  # pyright: ignore[reportArgumentType]
    first, method = taking[0].bare, setting.method
    with law_named(first.material, first.who), blame(method.who, integrators.SIGNATURE):
        integrator = method.on(joint)
        integrators.begin(integrator)

        def ask() -> tuple[float | None, str]:
            with blame(method.who, integrators.SIGNATURE):
                value, reason = integrators.limit(integrator)
            return value, f"{reason}, and what acts between bodies" if joint.pushed else reason

        runs = {
            each.body.name: each.by(integrator, share_of(ask, setting.scales.time / each.crossing), time_step)
            for each in taking
        }
    for each in taking:
        name, run = each.body.name, runs[each.body.name]
        if joint.pushed:
            run.stability.swing = partial(_swing, joint, setting.scales.time / each.crossing)
        run.reading.on_surface = {key: read for coupling in couplings for key, read in coupling.fields(name).items()}
    return joint, runs


def _swing(joint: JointSystem, unit: float) -> float:
    """The Courant number of a body, `unit` in a time step of 1, up to which leapfrog holds the fastest wave of all."""
    return joint.courant(LEAPFROG) * unit


def _refuse(setting: Setting, taking: Sequence[Standing]) -> None:
    """Refuse what cannot step together with others."""
    method = setting.method
    for each in taking:
        if not each.system.traits.one_set:
            raise Refused(
                f"body {each.body.name!r}: forces between bodies act on particles that carry the whole motion: use an"
                f" integrator of one set, such as leapfrog, not the two sets of {method.name}"
            )
    if integrators.publishes(method.plugin):
        raise Refused(
            f"body {taking[0].body.name!r}: {method.name} keeps variables of its own between steps, which forces between"
            " bodies, that open and close, cannot be told: use leapfrog"
        )


def stiffen(setting: Setting, joint: JointSystem, runs: Sequence[BodyRun]) -> None:
    """Give what acts between bodies, where a scene leaves its stiffness open, the largest up to MOST whose step keeps
    energy. Raises Refused where the step leaves less than LEAST."""
    takes = [coupling.stiffen(1.0) for coupling in joint.couplings]  # all of them, not the first that does
    if not any(takes):
        _warn(runs)
        return

    def room(stiffness: float) -> float:
        for coupling in joint.couplings:
            coupling.stiffen(stiffness)
        for run in runs:
            run.stability.measure()
        return min(keeping_energy(run) / run.courant for run in runs)

    if room(MOST) >= WHOLE:
        return
    left = room(LEAST)
    if left < WHOLE:
        # Where no step at all is short enough, as of methods that amplify every undamped wave, the guard says so.
        if setting.scene.run.guard != "refuse" or left <= 0.0:
            room(1.0)
            return
        cfl = setting.scene.run.cfl
        key, now = ("run.cfl", cfl) if isinstance(cfl, float) else ("run.dt", runs[0].time_step.dt)
        raise Refused(
            f"{key} = {now:.6g}: what acts between bodies would have less than {LEAST:g} of the stiffness of a cell in a step"
            f" as long as this: use {key} <= {0.999 * left * now:.4g}, or give stiffness a number"
        )
    low, high = LEAST, MOST
    while high - low > 1e-3 * low:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if room(middle) >= WHOLE else (low, middle)
    room(low)


def _warn(runs: Sequence[BodyRun]) -> None:
    """Warn of steps that are stable, and too long to keep energy where contacts open and close inside of them."""
    for run in runs:
        if run.stability.swing is not None and run.limit and keeping_energy(run) < run.courant <= run.limit:
            doubt(
                f"body {run.body.name!r}: Courant number {run.courant:.6g} is below its limit {run.limit:.3f}, but contacts that"
                f" open and close inside of steps beyond {keeping_energy(run):.4g} make energy: use run.cfl <= that, or a"
                " smaller stiffness",
                stacklevel=5,
            )
            return
