"""The law of a rigid tool against a body: every vertex of the body's surface against the exact shape.

The stiffness of the penalty is K times that of half a cell of the body, eps = 2 K M/h, M = rho c^2, so that a wave meets the
tool as it meets the middle of a body twice as long. Elastic forces, friction and damping are those of two surfaces that meet
(`wsph.contact.meeting.forces`), with the ways and speeds against the tool's own points.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass, field

import numpy as np
import warp as wp
from numpy.typing import NDArray

from wsph.backend.arrays import Arrays
from wsph.backend.domain import Share
from wsph.backend.reduce import blocks
from wsph.backend.space import Array, Struct
from wsph.contact.meeting.candidates import Candidates, none, rows_of_pairs
from wsph.contact.meeting.forces import forgetting
from wsph.contact.meeting.meeting import vertex_areas
from wsph.contact.meeting.memory import Memory
from wsph.contact.meeting.structs import law_struct
from wsph.contact.meeting.touch import add_kernel
from wsph.contact.surfaces.laws import Ground, Law, Near, Places, Rigid, Rows
from wsph.contact.surfaces.surface import Surface
from wsph.contact.tools.forms import Form, Placed
from wsph.contact.tools.rigid import RigidBody
from wsph.contact.tools.touching import gaps_kernel, gather_kernel, react_kernel, touch_kernel
from wsph.scene.touch.tools import Tool

TANGENT = 0.7
"""Stiffness of stick in that of depth: about that of a half-space under a patch, 2 (1 - nu)/(2 - nu) with nu = .45
(Mindlin 1949)."""

SOFT = 0.5
"""Damping of the rate c is divided by 1 + SOFT c dt, so that it never needs a shorter step than none."""

STIFFER, STIFFEST, RUBBING = 4.0, 10.0, 0.5
"""Stiffness of a tool, in that of the material, over that of contacts in the same step, and the most: a ball of 20 cells in
its radius that a plane presses bears 6 % too little with 1, 2.5 % with 4. The most where there is friction: what slides on
a stiffer one hums, the more so the finer it is."""


@dataclass(frozen=True)
class RigidTool:
    """A tool of a scene: its `table`, its `form` [m], its `shape` on the device and its `body`, which moves it."""

    table: Tool
    form: Form
    shape: Placed
    body: RigidBody
    laws: "list[ToolLaw]" = field(default_factory=list["ToolLaw"])
    """Those of it against bodies."""


class ToolLaw(Law):
    """A tool against a surface of n vertices, nondimensional.

    _push  # on the vertices in the last evaluation, (n,) vec
    _sums  # force and torque of blocks of vertices on the tool, (blocks, 6) float64
    """

    def __init__(self, tool: RigidTool, side: Surface, ground: Ground):
        table, space, clock = tool.table, ground.space, ground.clock
        self.name, self.tool, self.side = f"{table.name}-{side.name}", tool, side
        self._ground = ground
        tool.laws.append(self)
        self._space, self._clock, self._automatic = space, clock, table.number is None
        self.soft, self.impedance = table.soft, 2.0 * table.damping * side.impedance
        self._law: Struct = law_struct(space)()
        self.stiffness = 0.0
        self._arrays = Arrays(self._clock.device)
        self.memory = Memory(side.n, space, self._clock, self._arrays, ground.domain)
        self._make()
        self._take(table.number or self._chosen(1.0))

    def _make(self) -> None:
        """What there is of every vertex."""
        side, space, ground = self.side, self._space, self._ground
        self._area = vertex_areas(side, space.dim)
        form, length = self.tool.form, ground.scales.length
        arm = form.arm(ground.origin + side.places() * length) / length
        # What presses on a ball does not turn it.
        self._compliance = self.tool.body.compliance(0.0 * arm if form.round and not self.tool.table.friction else arm)
        self._footprint = form.footprint(side.spacing * length) / length ** (space.dim - 1)
        self._push: Array = self._arrays.zeros("push", side.n, space.vec)
        self._sums: Array = self._arrays.zeros("sums", (blocks(side.n), 6), wp.float64)
        self._near, self._rows = np.zeros(0, np.int64), none(self._clock.device)
        self._told: Candidates = none(self._clock.device)

    def _chosen(self, stiffness: float) -> float:
        """Of contacts' stiffness in a step that of the tool: the least where that is the least."""
        if self.tool.table.friction > 0.0:
            return RUBBING
        lower = (2.0 * STIFFER - 1.0) * stiffness - (STIFFER - 1.0)
        return min(lower, STIFFER * stiffness, STIFFEST)

    def _take(self, factor: float) -> None:
        """Take a stiffness K."""
        side, table, real = self.side, self.tool.table, self._space.scalar
        self._factor, self.stiffness = factor, 2.0 * factor * side.modulus / side.spacing
        values = {
            "stiffness": self.stiffness,
            "impedance": self.impedance,
            "softening": SOFT * sum(self.per_mass(self.impedance)) if self.soft else 0.0,
            "friction": table.friction,
            "tangent": TANGENT,
            "relax": forgetting(table.memory, side.spacing, side.least_side, side.wave_speed),
        }
        for name, value in values.items():
            setattr(self._law, name, real(value))

    def per_mass(self, pressure: float) -> tuple[float, float]:
        """Bounds of what `pressure`s on the vertices' areas, per depth or per speed, add to the body and to a free tool, per
        mass. The tool feels those that it can touch at once: a plane has one normal, and of a closed surface at most half
        faces it."""
        part = 0.5 if self.tool.form.kind == "plane" else 1.0
        on_tool = min(part * float(self._area @ self._compliance), self._footprint * float(self._compliance.max()))
        return self.side.square(pressure * self._area), pressure * on_tool

    def bound(self, surface: Surface) -> tuple[float, float]:
        """Bounds of omega^2 and of the rate of damping that it adds to the body of a surface. Body and free tool move
        against each other: what the tool feels, of all bodies, counts as well."""
        if surface is not self.side:
            return 0.0, 0.0
        each = [law.per_mass(law.stiffness) for law in self.tool.laws]
        slowed = [law.per_mass(0.0 if law.soft else law.impedance) for law in self.tool.laws]
        own = self.tool.laws.index(self)
        square, drag = (found[own][0] + sum(of_tool for _, of_tool in found) for found in (each, slowed))
        return square, drag

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness K where the scene leaves it open; whether it does."""
        if self._automatic:
            self._take(self._chosen(stiffness))
        return self._automatic

    def gaps(self, places: np.ndarray) -> np.ndarray:
        """Gaps of `places` (k, dim) at the tool where it is, on the host (k,) (a launch)."""
        space, device = self._space, self._clock.device
        x = wp.array(places.astype(space.numpy), dtype=space.vec, device=device)
        gap = wp.zeros(len(places), dtype=space.scalar, device=device)
        normal = wp.zeros(len(places), dtype=space.vec, device=device)
        inputs = [0, self.tool.shape.struct, self.tool.body.pose, x]
        kernel = gaps_kernel(space, self.tool.shape.kind)
        wp.launch(kernel, len(places), inputs=inputs, outputs=[gap, normal], device=device)
        return gap.numpy().astype(float)

    @property
    def sides(self) -> tuple[Surface, ...]:
        """The surface that it acts on."""
        return (self.side,)

    @property
    def rigid(self) -> tuple[Rigid, ...]:
        """The tool."""
        return (self.tool.body,)

    def find(self, places: Places, skin: float) -> None:
        """Find the vertices that can reach the tool before either has gone half of the skin; the tool has been placed."""
        self._near = near = np.flatnonzero(self.gaps(places[self.side.name]) < skin)
        self.memory.deal(near)
        self.memory.release(near)
        self._push.zero_()
        dealt, device = self.memory.dealt, self._clock.device
        own = dealt.share.owns(near)
        rows, told = near[own], near[~own & self.side.here[near]]
        self._rows, self._told = rows_of_pairs(rows, rows, device), rows_of_pairs(told, told, device)
        # The tool feels all of them, in one order.
        dealt.ask(near)

    def near(self) -> Near:
        """The vertices that its kernels read or write, by the body's name."""
        return {self.side.name: (self._near, np.zeros(0, np.int64))}

    def renew(self, surface: Surface, rows: Rows) -> None:
        """The surface was remade: vertices that are still there go on, and what others had lost stays lost."""
        self.memory.renew(surface.n, rows)
        self._make()
        self._take(self._factor)

    def act(self) -> None:
        """Add the forces to those of the surface, and what acts back to the load of the tool (launches)."""
        tool, side, launch = self.tool, self.side, self._clock.launch
        kernel = touch_kernel(self._space, tool.shape.kind, self._ground.once)
        inputs = [self._law, tool.shape.struct, tool.body.pose, side.struct, self._rows.struct.which, self._clock.time]
        outputs = [self.memory.trial, self._push, side.force]
        if not len(self._near):
            return
        if self._rows.count:
            launch(kernel, self._rows.count, [*inputs, self.memory.kept], outputs)
        self.memory.dealt.tell(self._push, self.memory["gap"])
        if self._told.count:
            inputs = [self._told.struct.which, self._push]
            launch(add_kernel(self._space), self._told.count, inputs, [side.force])
        inputs = [self._push, side.struct, tool.body.pose, side.n]
        launch(react_kernel(self._space), self._sums.shape[0], inputs, [self._sums])
        launch(gather_kernel(), 6, [self._sums], [tool.body.load])

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (launches)."""
        self.memory.keep(self._rows)

    def surface_gaps(self, surface: Surface) -> NDArray[np.float64]:
        """Gaps of a surface's vertices at the end of the last step, NaN where there is nothing to meet, (n,)."""
        return self.memory.gaps(self._near) if surface is self.side else np.full(surface.n, np.nan)

    @property
    def stored(self) -> float:
        """Energy that it holds now, nondimensional."""
        return self.memory.stored

    @property
    def dissipated(self) -> float:
        """Energy that friction and damping have taken so far, nondimensional."""
        return self.memory.lost

    def force(self, surface: Surface) -> np.ndarray:
        """The sum of its forces on a surface in the last evaluation, nondimensional (dim,)."""
        total: np.ndarray = self._push.numpy().sum(0, dtype=np.float64)
        return total if surface is self.side else 0.0 * total

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        return self._arrays.kept

    def shares(self) -> dict[str, Share]:
        """The parts of these that this process has."""
        return self.memory.shares()
