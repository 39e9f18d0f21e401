"""The law of a rigid tool against a body: every vertex of the body's surface against the exact shape.

The stiffness of the penalty is K times that of half a cell of the body, eps = 2 K M/h, M = rho c^2, so that a wave meets the
tool as it meets the middle of a body twice as long. Elastic forces, friction and damping are those of two surfaces that meet
(`wsph.contact.meeting.forces`), with the ways and speeds against the tool's own points.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.reduce import blocks
from wsph.backend.space import Array, Space, Struct
from wsph.contact.meeting.candidates import Candidates, rows_of_pairs
from wsph.contact.meeting.memory import Memory
from wsph.contact.meeting.structs import law_struct
from wsph.contact.surfaces.struct import SurfaceArrays
from wsph.contact.tools.forms import Form, Placed
from wsph.contact.tools.rigid import RigidBody
from wsph.contact.tools.touching import gaps_kernel, gather_kernel, react_kernel, touch_kernel
from wsph.scene.tools import Tool

TANGENT = 0.7
"""Stiffness of stick in that of depth: about that of a half-space under a patch, 2 (1 - nu)/(2 - nu) with nu = .45
(Mindlin 1949)."""

SOFT = 0.5
"""Damping of the rate c is divided by 1 + SOFT c dt, so that it never needs a shorter step than none."""

OPEN = 1.0
"""The stiffness, in those of the material, until the time step chooses one."""


class Touched(Protocol):
    """A surface as the law of tools sees it (`wsph.contact.surfaces.surface.Surface`)."""

    name: str
    n: int
    m: int
    spacing: float
    wave_speed: float
    modulus: float
    impedance: float
    struct: SurfaceArrays
    force: Array

    def square(self, stiffness: np.ndarray) -> float: ...


@dataclass(frozen=True)
class RigidTool:
    """A tool of a scene: its `table`, its `form` [m], its `shape` on the device and its `body`, which moves it."""

    table: Tool
    form: Form
    shape: Placed
    body: RigidBody


class ToolLaw:
    """A tool against a surface of n vertices, nondimensional.

    _push  # on the vertices in the last evaluation, (n,) vec
    _sums  # force and torque of blocks of vertices on the tool, (blocks, 6) float64
    """

    def __init__(self, tool: RigidTool, side: Touched, space: Space, clock: Clock, arm: np.ndarray):
        """`arm` (n,): how far from the centre of mass of a free tool a force of each vertex can act."""
        table = tool.table
        self.name, self.tool, self.side, self.sides = table.name, tool, side, (side,)
        self._space, self._clock, self._automatic = space, clock, table.number is None
        self._arrays = Arrays(clock.device)
        self._area = vertex_areas(side, space.dim)
        self._impedance = 2.0 * table.damping * side.impedance
        self._soft, self._compliance = table.soft, tool.body.compliance(arm)
        self.memory = Memory(side.n, space, clock, self._arrays)
        self._push: Array = self._arrays.zeros("push", side.n, space.vec)
        self._sums: Array = self._arrays.zeros("sums", (blocks(side.n), 6), wp.float64)
        everyone = np.arange(side.n)
        self._rows: Candidates = rows_of_pairs(everyone, everyone, clock.device)
        self._law: Struct = law_struct(space)()
        self._stiffness = 0.0
        self._take(table.number or OPEN)

    def _take(self, stiffness: float) -> None:
        """Take a stiffness K."""
        side, table, real = self.side, self.tool.table, self._space.scalar
        self._stiffness = 2.0 * stiffness * side.modulus / side.spacing
        values = {
            "stiffness": self._stiffness,
            "impedance": self._impedance,
            "softening": SOFT * sum(self.per_mass(self._impedance)) if self._soft else 0.0,
            "friction": table.friction,
            "tangent": TANGENT,
            "relax": side.wave_speed / (side.spacing * table.memory) if table.memory > 0.0 else 0.0,
        }
        for name, value in values.items():
            setattr(self._law, name, real(value))

    def per_mass(self, pressure: float) -> tuple[float, float]:
        """Bounds of what `pressure`s on the vertices' areas, per depth or per speed, add to the body and to a free tool, per
        mass. A plane has one normal: of a closed surface at most half faces it."""
        forces = pressure * self._area
        part = 0.5 if self.tool.form.kind == "plane" else 1.0
        return self.side.square(forces), part * float(forces @ self._compliance)

    def square(self) -> tuple[float, float]:
        """Bounds of omega^2 that it adds to the body and to a free tool."""
        return self.per_mass(self._stiffness)

    def drag(self) -> tuple[float, float]:
        """Bounds of the rate of damping that it adds to them; none where it gives way."""
        return (0.0, 0.0) if self._soft else self.per_mass(self._impedance)

    def stiffen(self, stiffness: float) -> bool:
        """Take a stiffness K where the scene leaves it open; whether it does."""
        if self._automatic:
            self._take(stiffness)
        return self._automatic

    def near(self) -> Mapping[str, tuple[np.ndarray, np.ndarray]]:
        """The vertices and the faces that its kernels read or write, by the body's name: all."""
        return {self.side.name: (np.arange(self.side.n), np.arange(self.side.m))}

    def gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Gaps (n,) and normals (n, dim) of the vertices where they are, on the host (a launch)."""
        gap = wp.zeros(self.side.n, dtype=self._space.scalar, device=self._clock.device)
        normal = wp.zeros(self.side.n, dtype=self._space.vec, device=self._clock.device)
        inputs = [self.tool.shape.struct, self.tool.body.pose, self.side.struct.x]
        kernel = gaps_kernel(self._space, self.tool.shape.kind)
        wp.launch(kernel, self.side.n, inputs=[0, *inputs], outputs=[gap, normal], device=self._clock.device)
        return gap.numpy().astype(float), normal.numpy().astype(float)

    def act(self) -> None:
        """Add the forces to those of the surface, and what acts back to the load of the tool (launches)."""
        tool, side, launch = self.tool, self.side, self._clock.launch
        kernel = touch_kernel(self._space, tool.shape.kind)
        inputs = [self._law, tool.shape.struct, tool.body.pose, side.struct, self._rows.struct.which, self._clock.time]
        outputs = [self.memory.trial, self._push, side.force]
        launch(kernel, self._rows.count, [*inputs, self.memory.kept], outputs)
        inputs = [self._push, side.struct, tool.body.pose, side.n]
        launch(react_kernel(self._space), self._sums.shape[0], inputs, [self._sums])
        launch(gather_kernel(), 6, [self._sums], [tool.body.load])

    def close(self) -> None:
        """Take the memory of the last evaluation as that of the step (launches)."""
        self.memory.keep(self._rows)

    @property
    def stored(self) -> float:
        """Energy that it holds now, nondimensional."""
        return self.memory.stored

    @property
    def dissipated(self) -> float:
        """Energy that friction and damping have taken so far, nondimensional."""
        return self.memory.lost

    def force(self, side: Touched) -> np.ndarray:
        """The sum of its forces on a surface in the last evaluation, nondimensional (dim,)."""
        total: np.ndarray = self._push.numpy().sum(0, dtype=np.float64)
        return total if side is self.side else 0.0 * total

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        return {f"tool.{self.name}-{self.side.name}.{name}": array for name, array in self._arrays.kept.items()}


def vertex_areas(side: Touched, dim: int) -> np.ndarray:
    """Every vertex's share of the faces around it, in the reference configuration, (n,)."""
    faces = side.struct.faces.numpy().reshape(side.m, dim)
    size = side.struct.size.numpy().astype(np.float64)
    return np.bincount(faces.ravel(), np.repeat(size / dim, dim), side.n)
