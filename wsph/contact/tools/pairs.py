"""Two rigid tools that meet, of which one at least is free.

Neither has a material whose stiffness the penalty could be. So it follows from the time step: the springs of all points have
omega dt = 2 C together, C = .25, which is stiff enough for a weight to sink in by some g dt^2. One of the two is met by
points, each the middle of a ball: a ball by its own, against any shape; a box by its corners, against a plane. Damping is a
part of the critical one of these springs.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cache
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock, dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space, Struct
from wsph.contact.meeting.candidates import Candidates, rows_of_pairs
from wsph.contact.meeting.forces import contact_force, open_contact
from wsph.contact.meeting.memory import Memory
from wsph.contact.meeting.structs import law_struct, memory_struct, reading, writing
from wsph.contact.tools.gaps import shape_struct
from wsph.contact.tools.law import TANGENT, RigidTool
from wsph.contact.tools.moving import pose_struct
from wsph.contact.tools.touching import meeting_tool

SHARE = 0.25
"""C: omega dt/2 of the springs between two rigid tools."""


@cache
def points_struct(space: Space) -> type:
    """Struct of the k points that a tool is met by, in its own frame, nondimensional.

    place       # (k,) vec
    radius      # of the ball about each
    compliance  # sum over all points of 1/M + r^2/I of both tools
    damping     # in critical ones
    law         # numbers of the contact; a stiffness of 1
    """
    annotations: dict[str, object] = dict.fromkeys(("radius", "compliance", "damping"), space.scalar)
    annotations |= {"place": wp.array(dtype=space.vec), "law": law_struct(space)}
    return cast(type, wp.struct(type("Points", (), {"__annotations__": annotations, "__module__": __name__})))


@cache
def _load(space: Space) -> wp.Function:
    """Warp function (load, pose, place, force, sign): adds a force at a place, and its torque, to what acts on a tool."""
    vec, dim, Pose = space.vec, space.dim, pose_struct(space)

    @wp.func
    def load(load: wp.array(dtype=wp.float64), pose: Pose, x: vec, force: vec, sign: wp.float64):
        arm = wp.vec3d()
        acts = wp.vec3d()
        for a in range(wp.static(dim)):
            arm[a] = wp.float64(x[a] - pose.place[0][a])
            acts[a] = sign * wp.float64(force[a])
        torque = wp.cross(arm, acts)
        for a in range(3):
            load[a] = load[a] + acts[a]
            load[3 + a] = load[3 + a] + torque[a]

    return load


@cache
def _meet_kernel(space: Space, kind: str) -> wp.Kernel:
    """What two tools do to each other: one thread, point by point."""
    real, vec = space.scalar, space.vec
    Points, Shape, Pose, Memory = points_struct(space), shape_struct(space), pose_struct(space), memory_struct(space)
    meet, load, Law = meeting_tool(space, kind), _load(space), law_struct(space)
    held, hold, contact, opened = reading(space), writing(space), contact_force(space), open_contact(space)

    @wp.func
    def law_of(points: Points, dt: real) -> Law:
        law = points.law
        zeta = points.damping / (real(1.0) + real(wp.static(2.0 * SHARE)) * points.damping)
        law.stiffness = real(wp.static(4.0 * SHARE * SHARE)) / (dt * dt * points.compliance)
        law.impedance = zeta * dt / real(SHARE) * law.stiffness
        return law

    @kernel()
    def touch(
        points: Points,
        own: Pose,
        shape: Shape,
        other: Pose,
        clock: wp.array(dtype=wp.float64),
        kept: Memory,
        trial_out: Memory,
        load_out: wp.array(dtype=wp.float64),
        answer_out: wp.array(dtype=wp.float64),
    ):
        dt = real(dt_of(clock))
        law = law_of(points, dt)
        for k in range(points.place.shape[0]):
            middle = own.place[0] + own.axes[0] * points.place[k]
            found = meet(shape, other, middle, vec(), vec())
            # Where they touch, and how that point of the first moves.
            x = middle - points.radius * found.normal
            against = meet(shape, own, x, vec(), vec())
            met = meet(shape, other, x, -against.way, -against.speed)
            met.normal = found.normal
            h = held(kept, k)
            gap = found.gap - points.radius
            if gap < real(0.0):
                h = contact(law, met, gap, real(1.0), dt, h)
                force = h.elastic + h.damper - law.tangent * law.stiffness * h.stick
                load(load_out, own, x, force, wp.float64(1.0))
                load(answer_out, other, x, force, wp.float64(-1.0))
            else:
                h = opened(met.way, dt, h)
            hold(trial_out, k, h)

    return touch


class PairLaw:
    """Two rigid tools that meet."""

    def __init__(self, one: RigidTool, other: RigidTool, table: RigidTool, space: Space, clock: Clock, length: float):
        """`one` by its points, `other` by its shape; friction and damping are those of `table`; `length` [m] is the unit."""
        self.name, self.one, self.other = f"{table.table.name}", one, other
        self._space, self._clock, self._arrays = space, clock, Arrays(clock.device)
        places, radius = one.form.points
        arms = np.linalg.norm(places, axis=1) + radius
        compliance = one.body.compliance(arms / length).sum()
        compliance += other.body.compliance(other.form.arm(places + one.form.middle) / length).sum()
        self._points = _points(table, places / length, radius / length, float(compliance), space, clock.device)
        self.memory = Memory(len(places), space, clock, self._arrays)
        everyone = np.arange(len(places))
        self._rows: Candidates = rows_of_pairs(everyone, everyone, clock.device)

    def act(self) -> None:
        """Add what they do to each other to the loads of both (a launch)."""
        one, other = self.one.body, self.other.body
        kernel = _meet_kernel(self._space, self.other.shape.kind)
        inputs = [self._points, one.pose, self.other.shape.struct, other.pose, self._clock.time, self.memory.kept]
        self._clock.launch(kernel, 1, inputs, [self.memory.trial, one.load, other.load])

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

    def kept(self) -> dict[str, Array]:
        """Device arrays that a run goes on from, by name."""
        name = f"tool.{self.one.table.name}-{self.other.table.name}"
        return {f"{name}.{key}": array for key, array in self._arrays.kept.items()}


def _points(
    table: RigidTool, places: np.ndarray, radius: float, compliance: float, space: Space, device: str
) -> Struct:
    real, made, law = space.scalar, points_struct(space)(), law_struct(space)()
    made.place = wp.array(places, dtype=space.vec, device=device)
    made.radius, made.compliance = real(radius), real(compliance)
    made.damping = real(table.table.damping)
    law.friction, law.tangent = real(table.table.friction), real(TANGENT)
    made.law = law
    return made
