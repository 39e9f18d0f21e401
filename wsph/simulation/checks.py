"""Checks of a run between blocks of steps: states that are not finite, energy from nowhere, and findings.

A finding makes an answer worth less without ending the run. The energy of whatever holds a body's spurious modes (a column
of the ledger) is that of a stiffness which the material does not have. It is measured by the largest internal energy that
the body has had so far, what it stores and what it has dissipated: beyond 5 % it is warned of, and a finding. Near rest, and
where a body flies or turns almost undeformed, that is no measure: a twentieth of its largest energy stands in its place.
"""

# pyright: strict

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypedDict

import numpy as np

from wsph.constitutive.sampling import fault_of_law
from wsph.contact.watch import Watch
from wsph.doubts import doubt
from wsph.errors import Unstable
from wsph.plugins import integrators, registry
from wsph.simulation.composing.composition import BodyRun, integrators_of
from wsph.simulation.diagnostics import BodySums
from wsph.simulation.ledger import HELD, Account
from wsph.simulation.timeline import Timeline

ENERGY_WARNING, LOSS_WARNING, ENERGY_AFTER = 0.02, 0.10, 20
"""Parts of the largest energy seen beyond which created and lost energy are warned of; steps before the first look."""


_SWINGS = "energy swings and does not grow, as that of motions which few steps resolve: use a smaller run.cfl"


def warn(text: str) -> None:
    """Warn of something that a run has met."""
    doubt(text, stacklevel=5)


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
    bound = f", limit {limit:.3f}{_claim(run)}" if limit is not None else ""
    message = (
        f"found unstable at step {step}, t = {t:.6g} s (dt = {dt:.4g} s): {name}{place} of body {run.body.name!r}: {what};"
        f" Courant number {run.courant:.6g}{bound}"
    )
    return Unstable(message, step=step, time=t, dt=dt, field=name, particle=particle, position=position, limit=limit)


def _claim(run: BodyRun) -> str:
    """Whose word the limit of a body is, where it is not ours and steps are below it."""
    if run.limit is None or run.courant > run.limit or registry.is_ours("integrators", type(run.integrator)):
        return ""
    return " (the integrator's own claim, which may be wrong: wsph.testing.check_limit measures it)"


HELD_WARNING, HELD_FLOOR, HELD_MATTERS = 0.05, 0.05, 0.01
"""Part of the internal energy that is warned of and is a finding; part of the whole energy that is the least
measure, and of the largest internal energy that a finding has at least. Before a wave has crossed a body a front of few
cells can be all of its energy: that is no measure of it."""


@dataclass
class Held:
    """Of a body, nondimensional: the largest internal energy so far, and the largest energy, its own and that of the bodies
    that it steps together with, which may be about to strike it; the largest part of the internal energy that holds
    spurious modes, how much that was, at which step, and whether it was warned of."""

    internal: float = 0.0
    energy: float = 0.0
    worst: float = 0.0
    held: float = 0.0
    step: int = 0
    warned: bool = False

    def look(self, step: int, internal: float, energy: float, held: float) -> float:
        """The part at `step`. `held` is the energy that holds spurious modes."""
        self.internal = max(self.internal, internal)
        self.energy = max(self.energy, energy)
        measure = max(self.internal, HELD_FLOOR * self.energy)
        part = held / measure if measure > 0.0 else 0.0
        if part > self.worst:
            self.worst, self.held, self.step = part, held, step
        return part

    @property
    def found(self) -> bool:
        """Whether the worst is a finding: it was a part that counts, also beside all that the body had later."""
        return self.worst > HELD_WARNING and self.held > HELD_MATTERS * self.internal


@dataclass
class Findings:
    """The findings of a run, by its bodies."""

    bodies: Sequence[BodyRun]
    held: list[Held] = field(default_factory=list[Held])

    def __post_init__(self) -> None:
        self.held = self.held or [Held() for _ in self.bodies]
        self._crossings = [_crossing(run) for run in self.bodies]

    def look(self, step: int, time: float, sums: Sequence[BodySums], account: Account) -> None:
        """Look at a state, of `time` [s]; warn of a body that needs it, once."""
        internal = [each.strain + each.dissipated + lost for each, lost in zip(sums, account.lost, strict=True)]
        together: dict[int, float] = {}
        for run, each, own in zip(self.bodies, sums, internal, strict=True):
            stepped = id(run.integrator)
            together[stepped] = together.get(stepped, 0.0) + each.kinetic + own
        bodies = zip(self.bodies, self._crossings, self.held, internal, account.held, strict=True)
        for run, crossing, mine, own, held in bodies:
            if time < crossing:
                continue
            part = mine.look(step, own, together[id(run.integrator)], held)
            if part > HELD_WARNING and not mine.warned:
                mine.warned = True
                warnings.warn(_words(run, step, part), RuntimeWarning, stacklevel=5)

    @property
    def words(self) -> list[str]:
        """The findings so far, in words."""
        found = zip(self.bodies, self.held, strict=True)
        return [_words(run, mine.step, mine.worst) for run, mine in found if mine.found]

    def kept(self) -> list[list[float]]:
        """The numbers that a checkpoint holds of it."""
        return [[each.internal, each.energy, each.worst, each.held, each.step, each.warned] for each in self.held]

    def restore(self, kept: Sequence[Sequence[float]]) -> None:
        """Put back what `kept` gave."""
        self.held = [Held(a, b, c, d, int(step), bool(warned)) for a, b, c, d, step, warned in kept]


def _crossing(run: BodyRun) -> float:
    """The time that a wave takes to cross a body along its longest side [s]."""
    low, high = run.bounds
    return float((high - low).max()) / run.constitutive.wave_speed


def _words(run: BodyRun, step: int, part: float) -> str:
    return (
        f"step {step}: control of spurious modes (column {HELD} of history.csv) has {100 * part:.3g} % of the internal energy"
        f" of body {run.body.name!r}: it carries what the material should; use a finer spacing, or another run.formulation"
    )


class CheckFacts(TypedDict):
    """What a checkpoint holds of the checks: the largest energy seen, in hexadecimal, whether a growth and a swing were
    warned of, the numbers of the findings, what else was warned of, and what is watched."""

    largest: str
    warned: bool
    swung: bool
    findings: list[list[float]]
    said: list[str]
    watched: list[list[int]]


class Checks:
    """The finite check, the energy stop and their warnings."""

    def __init__(
        self,
        bodies: Sequence[BodyRun],
        timeline: Timeline,
        energy: float,
        touching: Mapping[frozenset[str], bool],
    ):
        """`energy`: the part of the largest energy seen that may be created before a run is stopped; `touching`: the pairs
        of bodies that contact keeps apart, and whether their surfaces do."""
        self._bodies, self._timeline, self._stop = bodies, timeline, energy
        self._largest, self._warned, self._swung = 0.0, False, False
        self.said: list[str] = []
        """What a run has warned of, beside its findings."""
        self.findings = Findings(bodies)
        self.watch = Watch(bodies, touching)  # pyright: ignore[reportArgumentType]

    def relaxing(self, sums: Sequence[BodySums], steps: int) -> None:
        """`finite`, and in one piece with others, of a state after `steps` of a relaxation."""
        try:
            self.finite(0, sums)
        except Unstable as error:
            told = str(error).replace(
                "found unstable at step 0, t = 0 s", f"relaxation: unstable after {steps} steps", 1
            )
            values = {name: value for name, value in vars(error).items() if name != "__notes__"}
            raise Unstable(told, **values) from None

    def finite(self, step: int, sums: Sequence[BodySums]) -> None:
        """Raise Unstable where a state is not finite, a particle is turned inside out, or the formulation finds a fault.
        Warn at the end of what makes the answer a wrong one."""
        for run, each in zip(self._bodies, sums, strict=True):
            if each.bad >= 0:
                raise self._bad(step, run, each.bad)
            if fault := run.system.fault():
                raise unstable(self._timeline, step, run, "displacement", fault)
            if step == self._timeline.last and (said := run.system.doubt()):
                warn(said)

    def _bad(self, step: int, run: BodyRun, number: int) -> Unstable:
        """The error that names a particle by its number in the whole body: whoever has it tells the others."""
        share, domain = run.system.share, run.system.domain
        here = share.low <= number < share.high
        owner = int(domain.joined(np.array([here])).argmax())

        def error() -> Unstable:
            place = min(number - share.first, share.held - 1)
            name, what = _broken(run, place)
            if name != "deformation" and (fault := _fault_of_law(run)):
                what = f"{what}, because of {fault}"
            return unstable(self._timeline, step, run, name, what, number, run.system.position[place])

        return domain.told(error, owner)

    def apart(self, step: int) -> None:
        """Warn of bodies that have run into each other; raise Unstable where contact was to keep them apart."""
        for met in self.watch.look(step, self._timeline.dt):
            one, other = self._bodies[met.one], self._bodies[met.other]
            place = ", ".join(f"{x:.4g}" for x in met.place)
            names = [self._bodies[k].body.name for k in sorted((met.one, met.other))]
            if met.named:
                what = (
                    f"it is inside of body {other.body.name!r}, which it has passed through or merged with, and contact pushes it"
                    ' the wrong way: use a smaller step or spacing, law = "surface", or a larger contact.stiffness'
                )
                raise unstable(self._timeline, step, one, "contact", what, met.particle, met.place)
            if step == 0:
                continue  # They overlap from the start, which has been said.
            warn(
                f"step {step}, t = {self._timeline.time(step):.4g} s: bodies {names[0]!r} and {names[1]!r} run into each other at"
                f" ({place}) m and pass through each other: nothing acts between them; write [[contact]] between = {json.dumps(names)}"
            )

    def rested(self, energy: float) -> None:
        """Count energies below that as none: what a body at rest has left, and its roundings."""
        self._largest = max(self._largest, energy)

    def energy(self, step: int, account: Account) -> Unstable | None:
        """The error that stops the run where more energy was created than it allows, or None. Warns earlier, and of a loss
        at the end."""
        if step <= ENERGY_AFTER:
            return None
        total, work = account.total, account.work
        self._largest = max(self._largest, abs(total), abs(work))
        created = (total - work) / self._largest if self._largest > 0.0 else 0.0
        swing = self._swing() / self._largest if created > ENERGY_WARNING else 0.0
        if created - swing > self._stop:
            what = f"energy was created: {100 * created:.3g} % of the largest seen, beyond stop.energy = {self._stop:g}"
            return unstable(self._timeline, step, self._bodies[0], "energy", what)
        if created - swing > ENERGY_WARNING and not self._warned:
            self._warned = True
            warn(f"step {step}: energy was created, {100 * created:.3g} % of the largest seen")
        elif created > self._stop and not self._swung:
            self._swung = True
            warn(f"step {step}: {_SWINGS}; now by {100 * created:.3g} % of the largest seen")
        if step == self._timeline.last and -created > LOSS_WARNING:
            keeps = all(integrators.keeps(run.integrator) for run in self._bodies)
            why = _SWINGS if keeps else "numerical dissipation"
            warn(f"energy was lost by the end, {-100 * created:.3g} % of the largest seen: {why}")
        return None

    def _swing(self) -> float:
        """Energy that the states hold above what the methods keep, nondimensional, where their steps are stable."""
        limited = [(run, run.limit * run.stability.leeway) for run in self._bodies if run.limit is not None]
        stable = [run for run, limit in limited if run.courant <= limit]
        return sum(integrators.oscillation(each) for each in integrators_of(stable))

    def kept(self) -> CheckFacts:
        """The numbers that a checkpoint holds of the checks."""
        return {
            "largest": self._largest.hex(),
            "warned": self._warned,
            "swung": self._swung,
            "findings": self.findings.kept(),
            "said": self.said,
            "watched": self.watch.kept(),
        }

    def restore(self, facts: CheckFacts) -> None:
        """Put back what `kept` gave."""
        self._largest = float.fromhex(facts["largest"])
        self._warned, self._swung = facts["warned"], facts["swung"]
        self.findings.restore(facts["findings"])
        self.watch.restore(facts["watched"])
        self.said[:] = facts["said"]


def _fault_of_law(run: BodyRun) -> str:
    return fault_of_law(run.constitutive.material, run.constitutive.who, stressed=True)


def _broken(run: BodyRun, particle: int) -> tuple[str, str]:
    """The fault of a particle's state: field and words."""
    state, whole = run.system.state, {name: run.system.state.read(name) for name in ("velocity", "stress")}
    # Points that carry the stress have numbers of their own.
    apart = len(whole["stress"]) != len(whole["velocity"])
    velocity, stress = whole["velocity"][particle], whole["stress"] if apart else whole["stress"][particle]
    finite = bool(np.isfinite(velocity).all() and np.isfinite(stress).all())
    if finite and "deformation" in state.widths:
        return "deformation", "has turned it inside out (J <= 0)"
    constitutive = run.constitutive
    unknown = bool(np.isnan(stress).any() and np.isfinite(velocity).all())
    if unknown and constitutive.laws.total is not None and constitutive.state.free:
        law = run.body.material.model
        return (
            "stress",
            f"{law} has no thickness without stress across a body in this state: use another material, or state",
        )
    return "velocity or stress", "is not finite" if not finite else "is too large to square"
