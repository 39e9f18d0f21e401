"""A scene made ready to run."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.domain import Domain
from wsph.backend.graph import Program
from wsph.backend.space import Space
from wsph.backend.state import State
from wsph.constitutive.constitutive import Constitutive
from wsph.contact.between import Coupling, Interaction
from wsph.errors import PluginError
from wsph.formulations.reading import Reading
from wsph.formulations.system import System
from wsph.formulations.updated.sharing.anew import Remade
from wsph.plugins import integrators
from wsph.plugins.blame import blame
from wsph.plugins.traits import longest_step
from wsph.protocols import Integrator
from wsph.reporting import Reported, Reporting
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.composing.joint import JointSystem
from wsph.simulation.diagnostics import Diagnostics
from wsph.simulation.probing.recorder import Recorder
from wsph.simulation.timeline import TimeStep
from wsph.stability.limit import StepLimit
from wsph.units import Scales

WATCHED = 4
"""Steps that are listed to see what goes into a step: methods of up to so many steps are seen through."""


@dataclass
class BodyRun:
    """One body of a composition."""

    body: Body
    constitutive: Constitutive
    system: System
    integrator: Integrator
    diagnostics: Diagnostics
    stability: StepLimit
    time_step: TimeStep
    reading: Reading
    work: int = 1
    """Right-hand sides a step."""

    @property
    def courant(self) -> float:
        """The Courant number of the steps to come: time step times wave speed over spacing."""
        return self.time_step.dt * self.constitutive.wave_speed / self.system.spacing

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """From where to where its particles reach at the start, (dim,) [m], those of all processes, which ask together."""
        position, domain = self.system.position, self.system.domain
        return domain.min(position.min(0)), domain.max(position.max(0))

    @property
    def limit(self) -> float | None:
        """The largest stable Courant number, None where the integrator declares none."""
        return self.stability.value

    @property
    def limit_reason(self) -> str:
        """Where the limit comes from."""
        return self.stability.reason

    @property
    def longest_steps(self) -> dict[str, float]:
        """The longest time steps that the material and the parts of the body can take [s], by their names; infinite where
        they name none."""
        parts = {key: part.limit * self.system.scales.time for key, part in self.system.attached.items()}
        return {self.body.material.model: longest_step(self.constitutive.material), **parts}


@dataclass(frozen=True)
class Step:
    """One step of a composition, as launches: bodies, what acts between them, the clock, and what records every step.
    `joint`: the bodies that step together."""

    bodies: Sequence[BodyRun]
    joint: JointSystem | None
    interactions: Sequence[Interaction]
    clock: Clock
    probes: Sequence[Recorder]

    def __call__(self) -> None:
        for interaction in self.interactions:
            interaction.begin()
        for integrator in integrators_of(self.bodies):
            integrator.step()
        for interaction in self.interactions:
            interaction.act()
        for run in self.bodies:
            run.system.close()
        if self.joint is not None:
            stepped = next(run.integrator for run in self.bodies if run.body.name in self.joint.names)
            self.joint.close(fresh=integrators.fresh(stepped))
        self.clock.advance()
        if self.probes:
            publish(self.bodies)
        for probe in self.probes:
            probe.record()

    @property
    def before(self) -> Callable[[], bool] | None:
        """A function that updates, on the host before a step, everything that follows the motion, and returns whether the
        inputs of launches changed; None where nothing follows it."""
        following: list[Callable[[], bool]] = [
            run.system.follow for run in self.bodies if run.system.traits.pairs_follow
        ]
        following += [interaction.follow for interaction in self.interactions if interaction.follows]
        following += [coupling.follow for coupling in (self.joint.couplings if self.joint is not None else ())]

        def follow() -> bool:
            changed = [each() for each in following]  # all of them, not the first that did
            return any(changed)

        return follow if following else None


@dataclass
class Composition:
    """A scene made ready to run: `bodies` in the scene's order, those that step together as one system (`joint`),
    `interactions` between them, one set of scales, one time step."""

    scene: Scene
    space: Space
    scales: Scales
    time_step: TimeStep
    bodies: list[BodyRun]
    joint: JointSystem | None
    interactions: tuple[Interaction, ...]
    probes: list[Recorder]
    program: Program
    integrator: str
    """Name and distribution of the integrator."""
    domain: Domain
    """The part of the scene that this process has."""
    pairs: int
    """Directed pairs of all operators, of all processes."""
    remade: dict[str, Remade] = field(default_factory=dict[str, Remade])
    """What bodies that processes share were made anew by, by their names."""
    said: list[str] = field(default_factory=list[str])
    """What was warned of while it was composed."""

    @property
    def between(self) -> tuple[Interaction | Coupling, ...]:
        """All that acts between bodies."""
        return (*self.interactions, *(self.joint.couplings if self.joint is not None else ()))

    @property
    def reported(self) -> tuple[Reported, ...]:
        """All that people read numbers off, in the order of their columns."""
        return reported(self.bodies, self.between)

    @property
    def shared_numbers(self) -> frozenset[str]:
        """The names of those of which every process has a part."""
        return shared_numbers(self.bodies)

    @property
    def clock(self) -> Clock:
        """The clock of all bodies, on the device."""
        return self.time_step.clock

    @property
    def device(self) -> str:
        """The Warp device that all runs on."""
        return self.clock.device

    @property
    def dt(self) -> float:
        """The first time step [s]."""
        return self.time_step.first

    @property
    def steps(self) -> int:
        """Steps to the end, with the present time step."""
        return self.time_step.timeline.last

    @property
    def particles(self) -> int:
        """Particles that carry the state, over all bodies and all processes."""
        return sum(b.system.share.whole for b in self.bodies)

    @property
    def evaluations(self) -> int:
        """Right-hand sides of a step, as the integrator says."""
        return integrators.evaluations(self.bodies[0].integrator)

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays of all bodies, in all processes."""
        return int(self.domain.sum(np.array(sum(b.system.nbytes for b in self.bodies))))

    def publish(self) -> None:
        """Bring every state that is read up to date (launches)."""
        publish(self.bodies)

    def launches(self) -> list[wp.Kernel]:
        """The kernels that a step launches, in order."""
        return [launch.kernel for launch in self.clock.launches(self.program.step)]

    def _watch(self) -> None:
        """Find out from a few steps whether the method hands on what was set in its stages."""
        for run in self.bodies:
            run.system.watch()
        for _ in range(WATCHED):
            self.launches()
        found = [run.system.watched() for run in self.bodies]
        if any(found):
            # What was set where they began is to be known too.
            for integrator in integrators_of(self.bodies):
                integrators.begin(integrator)

    def compile(self) -> None:
        """Compile what a run launches: the step and the diagnostics. Raises PluginError where a law does not compile."""
        with blame(self.integrator, integrators.SIGNATURE):
            for run in self.bodies:
                _check_step(run)
            self._watch()
            launched = self.launches()
            home = _package(type(self.bodies[0].integrator).__module__)
            self.program.compile([kernel for kernel in launched if _package(kernel.func.__module__) == home])
        measured = [run.diagnostics.kernel(run.system.state) for run in self.bodies]
        with blame(" and ".join(dict.fromkeys(run.constitutive.who for run in self.bodies))):
            self.program.compile([*launched, *measured])


def _check_step(run: BodyRun) -> None:
    """Refuse a step that leaves the body's state as it is. Raises PluginError."""
    system, integrator = run.system, run.integrator
    integrators.fresh(integrator)
    run.time_step.clock.launches(lambda: integrators.publish(integrator))
    before_it = system.evaluations
    launches = run.time_step.clock.launches(integrator.step)
    run.work = max(system.evaluations - before_it, 1)
    if system.accepted is None:
        raise PluginError("step() never calls accept(state), which closes a step: the state would stay what it is")
    state, before = system.accepted
    if state is not system.state and not integrators.publishes(integrator):
        raise PluginError(
            "step() accepts a scratch state: the run goes on from `system.state`; accept that, or make it in publish()"
        )
    outputs = [output for launch in launches[:before] for output in launch.outputs]
    # On one set rates write derived fields beside a state; what advances it writes to its buffer.
    if not any(_writes(output, state, fields=not system.traits.one_set) for output in outputs):
        raise PluginError("step() changes nothing of the state that it accepts: its steps do not go on in time")


def _writes(output: object, state: State, fields: bool) -> bool:
    """Whether an output of a launch is a part of a state's buffer, or with `fields` the struct of its fields."""
    if not isinstance(output, wp.array):
        return fields and output is state.struct
    first, here = int(state.buffer.ptr or 0), int(output.ptr or 0)
    return first <= here < first + int(state.buffer.capacity)


def _package(module: str) -> str:
    return module.partition(".")[0]


def publish(bodies: Sequence[BodyRun]) -> None:
    """Make the states from the variables of integrators that keep their own, and recompute the derived fields, unless the
    last evaluation of the step found those of the state at its end."""
    for integrator in integrators_of(bodies):
        integrators.publish(integrator)
    for run in bodies:
        derived = run.system.state.derived
        if not integrators.fresh(run.integrator) or (derived is not None and derived.tell is not None):
            run.system.refresh(run.system.state)


def reported(bodies: Sequence[BodyRun], between: Sequence[object]) -> tuple[Reported, ...]:
    """What of bodies, and of what acts `between` them, people read numbers off."""
    holders = (*(run.system for run in bodies), *between)
    return tuple(each for holder in holders if isinstance(holder, Reporting) for each in holder.reported)


def shared_numbers(bodies: Sequence[BodyRun]) -> frozenset[str]:
    """The names of what people read numbers off that processes have to put together: that of bodies that they share."""
    return frozenset(each.name for run in bodies if run.system.domain.size > 1 for each in run.system.reported)


def integrators_of(bodies: Sequence[BodyRun]) -> list[Integrator]:
    """The integrators of bodies, in their order: bodies that step together share one."""
    found = {id(run.integrator): run.integrator for run in bodies}
    return list(found.values())
