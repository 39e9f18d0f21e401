"""Checks of a run between blocks of steps: states that are not finite, and energy from nowhere."""

# pyright: strict

import warnings
from collections.abc import Sequence
from typing import TypedDict

import numpy as np

from wsph.errors import Unstable
from wsph.simulation.composition import BodyRun
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.ledger import Account
from wsph.simulation.timeline import Timeline

ENERGY_WARNING, LOSS_WARNING, ENERGY_AFTER = 0.02, 0.10, 20
"""Parts of the largest energy seen beyond which created and lost energy are warned of; steps before the first look."""


def warn(text: str) -> None:
    """Warn of something that a run has met."""
    warnings.warn(text, RuntimeWarning, stacklevel=5)


def unstable(
    timeline: Timeline,
    step: int,
    run: BodyRun,
    name: str,
    what: str,
    particle: int = -1,
    position: Sequence[float] | np.ndarray = (),
) -> Unstable:
    """The error that names what was found, where and when, and the limit. `name` is a field, or what else is wrong."""
    t, dt, limit = timeline.time(step), timeline.dt, run.limit
    place = f" of particle {particle} at ({', '.join(f'{x:g}' for x in position)}) m" if particle >= 0 else ""
    bound = f", limit {limit:.3f}" if limit is not None else ""
    message = (
        f"found unstable at step {step}, t = {t:.6g} s (dt = {dt:.4g} s): {name}{place} of body {run.body.name!r}: {what};"
        f" Courant number {run.courant:.6g}{bound}"
    )
    return Unstable(message, step=step, time=t, dt=dt, field=name, particle=particle, position=position, limit=limit)


class CheckFacts(TypedDict):
    """What a checkpoint holds of the checks: the largest energy seen, in hexadecimal, and whether a growth was warned of."""

    largest: str
    warned: bool


class Checks:
    """The finite check, the energy stop and their warnings."""

    def __init__(self, bodies: Sequence[BodyRun], timeline: Timeline, energy: float):
        """`energy`: the part of the largest energy seen that may be created before a run is stopped."""
        self._bodies, self._timeline, self._stop = bodies, timeline, energy
        self._largest, self._warned = 0.0, False

    def finite(self, step: int, sums: Sequence[BodySums]) -> None:
        """Raise Unstable where a state is not finite, a particle is turned inside out, or the formulation finds a fault."""
        for run, each in zip(self._bodies, sums, strict=True):
            if each.bad >= 0:
                name, what = _broken(run, each.bad)
                raise unstable(self._timeline, step, run, name, what, each.bad, run.system.position[each.bad])
            if fault := run.system.fault():
                raise unstable(self._timeline, step, run, "displacement", fault)

    def energy(self, step: int, account: Account) -> Unstable | None:
        """The error that stops the run where more energy was created than it allows, or None. Warns earlier, and of a loss
        at the end."""
        if step <= ENERGY_AFTER:
            return None
        total, work = account.total, account.work
        self._largest = max(self._largest, abs(total), abs(work))
        created = (total - work) / self._largest if self._largest > 0.0 else 0.0
        if created > self._stop:
            what = f"energy was created: {100 * created:.3g} % of the largest seen, beyond stop.energy = {self._stop:g}"
            return unstable(self._timeline, step, self._bodies[0], "energy", what)
        if created > ENERGY_WARNING and not self._warned:
            self._warned = True
            warn(f"step {step}: energy was created, {100 * created:.3g} % of the largest seen")
        if step == self._timeline.last and -created > LOSS_WARNING:
            warn(f"energy was lost by the end, {-100 * created:.3g} % of the largest seen: numerical dissipation")
        return None

    def kept(self) -> CheckFacts:
        """The numbers that a checkpoint holds of the checks."""
        return {"largest": self._largest.hex(), "warned": self._warned}

    def restore(self, facts: CheckFacts) -> None:
        """Put back what `kept` gave."""
        self._largest, self._warned = float.fromhex(facts["largest"]), facts["warned"]


def _broken(run: BodyRun, particle: int) -> tuple[str, str]:
    """The fault of a particle's state: field and words."""
    state = run.system.state
    finite = all(np.isfinite(state.read(name)[particle]).all() for name in ("velocity", "stress"))
    if finite and "deformation" in state.widths:
        return "deformation", "has turned it inside out (J <= 0)"
    return "velocity or stress", "is not finite" if not finite else "is too large to square"
