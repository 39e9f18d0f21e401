"""Bodies that forces act between, as one system: integrators call it as they call a body.

An integrator never looks into a state. So the states of several bodies are one state, every call goes to all of them in
turn, and where it asks for the rates of the velocities those of the forces between them are added, with all bodies in the
same stage: what is right for one body under a method is right for several that push each other.
"""

# pyright: strict

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from wsph.contact.between import Coupling
from wsph.protocols import AnyState, Dimensioned, LawForm, OneSet, Stepped, Terms, Timed


class Member(OneSet, Protocol):
    """A body of a joint system, as one-set integrators see it by itself."""


class JointState:
    """The states of several bodies, by their names."""

    def __init__(self, parts: Mapping[str, AnyState]):
        self.parts = dict(parts)


@dataclass(frozen=True)
class JointForm:
    """How the forces of all bodies are found. `total`: whether every law gives the stress of a deformation."""

    total: bool


class JointSystem:
    """Bodies that step together, and what acts between them. `Member`s by their names; couplings may bring members of their
    own, such as rigid bodies.

    Times are those of the run, nondimensional: the Courant number of a joint system is that of the body that a wave crosses
    a spacing of in the shortest time, which is its time step.
    """

    def __init__(self, bodies: Mapping[str, Member], couplings: Sequence[Coupling], clock: Timed):
        self._bodies, self.couplings, self._clock = dict(bodies), tuple(couplings), clock
        own = [coupling.members() for coupling in self.couplings]
        self._members: dict[str, Stepped] = dict(bodies)
        for members in own:
            self._members |= members
        self.state = JointState({name: member.state for name, member in self._members.items()})
        self._accepted = self.state

    @property
    def names(self) -> tuple[str, ...]:
        """Of the bodies."""
        return tuple(self._bodies)

    def new(self) -> JointState:
        return JointState({name: member.new() for name, member in self._members.items()})

    def rate(self, state: JointState, out: JointState, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivatives; those of the velocities with what acts between the bodies."""
        for name, member in self._members.items():
            member.rate(state.parts[name], out.parts[name], part, ahead)
        if part != "rest":
            for coupling in self.couplings:
                coupling.push(state.parts, out.parts)

    def combine(
        self,
        out: JointState,
        plain: Terms,
        timed: Terms | None = None,
        squared: Terms | None = None,
        part: str = "all",
    ) -> None:
        for name, member in self._members.items():
            terms = (_of(name, plain), _of(name, timed or []), _of(name, squared or []))
            member.combine(out.parts[name], *terms, part=part)

    def drift(self, state: JointState, k: JointState, c: float, ahead: float = 0.0) -> None:
        for name, member in self._members.items():
            member.drift(state.parts[name], k.parts[name], c, ahead)

    def impose(self, state: JointState, c: float | tuple[float, float]) -> None:
        for name, member in self._members.items():
            member.impose(state.parts[name], c)

    def constrain(self, state: JointState, c: float | tuple[float, float]) -> None:
        for name, member in self._members.items():
            member.constrain(state.parts[name], c)

    def project(self, state: JointState) -> None:
        for name, member in self._members.items():
            member.project(state.parts[name])

    def kinetic(self, state: JointState) -> float:
        return sum(member.kinetic(state.parts[name]) for name, member in self._members.items())

    def accept(self, state: JointState) -> None:
        self._accepted = state
        for name, member in self._members.items():
            member.accept(state.parts[name])

    def start(self) -> None:
        """Take what is there at the start of a run (launches)."""
        for coupling in self.couplings:
            coupling.start(self.state.parts)

    def close(self, *, fresh: bool) -> None:
        """Close a step, after all bodies have (launches). `fresh`: its last evaluation was of the accepted state."""
        for coupling in self.couplings:
            coupling.close(self._accepted.parts, fresh=fresh)

    @property
    def clock(self) -> Timed:
        return self._clock

    @property
    def space(self) -> Dimensioned:
        return self._first.space

    @property
    def form(self) -> LawForm:
        return JointForm(all(member.form.total for member in self._bodies.values()))

    @property
    def bar_time(self) -> float:
        return min(member.bar_time for member in self._bodies.values())

    @property
    def damped(self) -> bool:
        return any(member.damped for member in self._bodies.values())

    @property
    def viscous(self) -> bool:
        return any(member.viscous for member in self._bodies.values())

    @property
    def moved(self) -> bool:
        return any(member.moved for member in self._bodies.values())

    @property
    def projects(self) -> bool:
        return any(member.projects for member in self._bodies.values())

    @property
    def irregular(self) -> bool:
        return any(member.irregular for member in self._bodies.values())

    @property
    def stabilisation(self) -> float:
        return max(member.stabilisation for member in self._bodies.values())

    @property
    def pushed(self) -> bool:
        """Whether anything acts between the bodies that has a stiffness."""
        return any(self._added(name) != (0.0, 0.0) for name in self._bodies)

    @property
    def frequency(self) -> float:
        """The largest frequency of a body, with what acts on it: squares add. Damping that lags half a step, c, takes of the
        step what c/2 + sqrt(c^2/4 + omega^2) in place of omega does."""
        return max(self._with(name, member.frequency) for name, member in self._bodies.items())

    def _with(self, name: str, frequency: float) -> float:
        square, drag = self._added(name)
        return 0.5 * drag + float(np.sqrt(0.25 * drag**2 + frequency**2 + square))

    def _added(self, name: str) -> tuple[float, float]:
        added = [coupling.bound(name) for coupling in self.couplings]
        return sum(square for square, _ in added), sum(drag for _, drag in added)

    @property
    def modes(self) -> NDArray[np.complex128]:
        # A body that is held everywhere has no motions.
        found = [member.modes for member in self._bodies.values() if member.frequency > 0.0]
        if self.pushed:
            found.append(self.frequency * np.array([1j, -1j], np.complex128))
        return np.concatenate(found)

    def largest(self, dt: float, factor: float) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D of a body, with what acts on it, an upper estimate."""
        found: list[float] = []
        for name, member in self._bodies.items():
            square, drag = self._added(name)
            own = member.largest(dt, factor) if member.frequency > 0.0 else 0.0
            found.append(own + dt**2 * square + 2.0 * dt * drag)
        return max(found)

    def courant(self, product: float) -> float:
        """The time step at which omega dt = `product` for its fastest wave."""
        return product / self.frequency if self.frequency > 0.0 else np.inf

    @property
    def _first(self) -> Member:
        return next(iter(self._bodies.values()))


def _of(name: str, terms: Terms) -> Terms:
    return [(c, state.parts[name]) for c, state in terms]


def share_of(limit: Callable[[], tuple[float | None, str]], unit: float) -> Callable[[], tuple[float | None, str]]:
    """The limit of one body of a joint system from that of the whole: `unit` is the body's Courant number in a step of 1."""

    def ask() -> tuple[float | None, str]:
        value, reason = limit()
        return (None if value is None else value * unit), reason

    return ask
