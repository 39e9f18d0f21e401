"""The tools of a scene as one coupling: it places bodies' surfaces and tools, lets the laws act, and hands forces on."""

# pyright: strict

from collections.abc import Mapping, Sequence

import numpy as np

from wsph.backend.clock import Clock
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.contact.surfaces.surface import Surface
from wsph.contact.tools.law import RigidTool, ToolLaw
from wsph.contact.tools.pairs import PairLaw
from wsph.contact.tools.rigid import RigidBody
from wsph.errors import Refused
from wsph.protocols import Entry
from wsph.units import Scales

DEEP = 1e-3
"""Depth [spacings] at the start that is an overlap, and no rounding."""


class ToolCoupling:
    """Rigid tools against bodies and against each other."""

    def __init__(
        self,
        tools: Sequence[RigidTool],
        surfaces: Sequence[Surface],
        laws: Sequence[ToolLaw],
        pairs: Sequence[PairLaw],
        taking: Sequence[str],
    ):
        """`taking`: names of the bodies that step together with the tools."""
        self.tools, self.surfaces, self.laws, self.pairs = tuple(tools), tuple(surfaces), tuple(laws), tuple(pairs)
        self._taking = tuple(taking)
        entries = [entry for tool in self.tools for entry in tool.body.ledger]
        self.ledger: tuple[Entry, ...] = (
            Entry("contact_stored", lambda: self._stored),
            Entry("contact_dissipated", lambda: self._dissipated),
            Entry("contact_numerical", lambda: self._given - self._stored - self._dissipated),
            *entries,
        )

    @property
    def _stored(self) -> float:
        return sum(law.stored for law in (*self.laws, *self.pairs))

    @property
    def _dissipated(self) -> float:
        return sum(law.dissipated for law in (*self.laws, *self.pairs))

    @property
    def _given(self) -> float:
        """Work that bodies and tools have put into the contacts."""
        return sum(tool.body.given for tool in self.tools) - sum(surface.work for surface in self.surfaces)

    def bodies(self) -> tuple[str, ...]:
        """The bodies that it acts on."""
        return self._taking

    def members(self) -> Mapping[str, RigidBody]:
        """The tools, as systems that step beside the bodies."""
        return {tool.table.name: tool.body for tool in self.tools}

    def follow(self) -> bool:
        """Every vertex is held against the shape: there are no candidates to find."""
        return False

    def _evaluate(self, states: Mapping[str, State]) -> None:
        for surface in self.surfaces:
            surface.place(states[surface.name])
        for tool in self.tools:
            tool.body.place(states[tool.table.name])
        for law in (*self.laws, *self.pairs):
            law.act()

    def start(self, states: Mapping[str, State]) -> None:
        """Take what is there at the start of the run (launches)."""
        for surface in self.surfaces:
            surface.start(states[surface.name])
        self._evaluate(states)
        for tool in self.tools:
            tool.body.start(states[tool.table.name])

    def push(self, states: Mapping[str, State], rates: Mapping[str, State]) -> None:
        """Add the accelerations of the forces in a state to the rates (launches)."""
        self._evaluate(states)
        for surface in self.surfaces:
            surface.spread(rates[surface.name])
        for tool in self.tools:
            tool.body.spread(rates[tool.table.name])

    def close(self, states: Mapping[str, State], *, fresh: bool) -> None:
        """Close a step (launches): memory, works."""
        if not fresh:
            self._evaluate(states)
        for law in (*self.laws, *self.pairs):
            law.close()
        for surface in self.surfaces:
            surface.close(states[surface.name])
        for tool in self.tools:
            tool.body.close(states[tool.table.name])

    def bound(self, body: str) -> tuple[float, float]:
        """Bounds of what it adds to the square of a body's frequency and to the rate of its damping. Bodies and free tools
        move against each other: what a tool feels of all bodies adds to what each of them does."""
        square = drag = 0.0
        for tool in self.tools:
            mine = [law for law in self.laws if law.tool is tool]
            if not any(law.side.name == body for law in mine):
                continue
            for law in mine:
                own = law.side.name == body
                (of_body, of_tool), (slowed, tool_slowed) = law.square(), law.drag()
                square += of_tool + (of_body if own else 0.0)
                drag += tool_slowed + (slowed if own else 0.0)
        return square, drag

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness, in those of the materials, where the scene leaves it open; whether it does."""
        return any([law.stiffen(stiffness) for law in self.laws])

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        found: dict[str, Array] = {}
        for each in (*self.surfaces, *self.laws, *self.pairs, *(tool.body for tool in self.tools)):
            found |= each.kept()
        return found

    def restored(self) -> None:
        """Make what follows from the kept arrays."""
        for surface in self.surfaces:
            surface.restored()


def refuse_overlap(laws: Sequence[ToolLaw], origin: np.ndarray, scales: Scales, space: Space, clock: Clock) -> None:
    """Raise Refused for a tool that a body lies in, with the place and the depth."""
    for law in laws:
        gap, _ = law.gaps()
        deepest = int(gap.argmin())
        if gap[deepest] < -DEEP * law.side.spacing:
            place = origin + law.side.places()[deepest] * scales.length
            raise Refused(
                f"tool {law.tool.table.name!r}: body {law.side.name!r} lies in it from the start, at"
                f" ({', '.join(f'{x:.4g}' for x in place)}) m by {-gap[deepest] * scales.length:.4g} m: move one of them"
            )
