"""A scene made ready to run."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from wsph.backend.clock import Clock
from wsph.backend.graph import Program
from wsph.backend.space import Space
from wsph.constitutive.constitutive import Constitutive
from wsph.contact.contacts import Contacts
from wsph.plugins.blame import blame
from wsph.scene.scene import Scene
from wsph.scene.tables import Body
from wsph.simulation.diagnostics import Diagnostics
from wsph.simulation.probes import Recorder
from wsph.units import Scales

ANEW = 0.05
"""Logarithm of the distortion after which the limit of a one-set body is found anew."""

INTEGRATOR_SIGNATURE = "a class with sets (1 or 2), formulations, order, __init__(self, system, **options), step(self), limit(self) -> (Courant number, reason) and state"


@dataclass
class BodyRun:
    """One body of a composition."""

    body: Body
    constitutive: Constitutive
    system: Any
    integrator: Any
    diagnostics: Diagnostics
    courant: float
    limit: float | None
    limit_reason: str
    distortion: float = 1.0
    """Of the state whose limit this is."""
    pushed: float = 0.0
    """A bound of the frequency that contacts add, nondimensional."""
    share: float = 1.0
    """Of its limit, the Courant number that the run began with."""

    def measure(self) -> None:
        """Find the limit of the state as it is. Where contacts push, squares of frequencies add."""
        self.limit, self.limit_reason = self.integrator.limit()
        if self.limit is not None and self.pushed > 0.0 and self.system.frequency > 0.0:
            self.limit /= float(np.sqrt(1.0 + (self.pushed / self.system.frequency) ** 2))
            self.limit_reason += ", and its contacts"

    @property
    def adapts(self) -> bool:
        """Whether deformation can bring its Courant number beyond its limit."""
        return bool(self.limit) and (self.system.traits.courant_follows or self.system.traits.measures)

    def follow(self, distortion: float) -> None:
        """Find the limit anew where a body has deformed by ANEW since, nearer to the limit by less: its stiffness has
        changed, or its pairs."""
        since = ANEW * float(np.clip(5.0 * (1.0 - self.share), 0.1, 1.0))
        if self.limit is not None and self.system.traits.measures and abs(np.log(distortion / self.distortion)) > since:
            self.distortion = distortion
            self.system.measure_anew()
            self.measure()

    @property
    def longest_step(self) -> float:
        """The longest time step that the material can take [s], infinite where it names none."""
        material = self.constitutive.material
        return float(material.time_step()) if hasattr(material, "time_step") else np.inf


@dataclass
class Composition:
    """A scene made ready to run. `dt` [s], `steps`, `scales`; `bodies` in the scene's order; one clock."""

    scene: Scene
    space: Space
    device: str
    scales: Scales
    clock: Clock
    dt: float
    steps: int
    bodies: list[BodyRun]
    probes: list[Recorder]
    program: Program
    integrator: str
    """Name and distribution of the integrator."""
    contacts: Contacts | None = None

    @property
    def particles(self) -> int:
        """Particles that carry the state, over all bodies."""
        return sum(b.system.count for b in self.bodies)

    @property
    def pairs(self) -> int:
        """Directed pairs of all operators."""
        return sum(b.system.pairs for b in self.bodies)

    def publish(self) -> None:
        """Have the states that are read made up to date (launches)."""
        publish(self.bodies)

    def shorten(self, factor: float) -> None:
        """Take steps shorter by a factor from now on. Integrators that keep variables of their own make them anew."""
        self.clock.shorten(factor)
        for run in self.bodies:
            run.courant *= factor
            if hasattr(run.integrator, "begin"):
                run.integrator.begin()

    def launches(self) -> list[wp.Kernel]:
        """The kernels that a step launches, in order."""
        return [launch.kernel for launch in self.clock.launches(self.program.step)]

    def compile(self) -> None:
        """Compile what a run launches: the step and the diagnostics. Raises PluginError where a law does not compile."""
        with blame(self.integrator, INTEGRATOR_SIGNATURE):
            launched = self.launches()
            home = _package(type(self.bodies[0].integrator).__module__)
            self.program.compile([kernel for kernel in launched if _package(kernel.func.__module__) == home])
        measured = [run.diagnostics.kernel(run.system.state) for run in self.bodies]
        with blame(" and ".join(dict.fromkeys(run.constitutive.who for run in self.bodies))):
            self.program.compile([*launched, *measured])


def _package(module: str) -> str:
    return module.partition(".")[0]


def publish(bodies: list[BodyRun]) -> None:
    """Integrators that keep variables of their own make the state; what a system derives from it follows, unless the last
    evaluation of the step was of the state at its end (`fresh`)."""
    for run in bodies:
        if hasattr(run.integrator, "publish"):
            run.integrator.publish()
        if not getattr(run.integrator, "fresh", False):
            run.system.refresh(run.system.state)
