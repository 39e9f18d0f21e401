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
from wsph.backend.clock import dt_of
from wsph.backend.kernels import kernel
from wsph.backend.space import Array, Space, Struct
from wsph.contact.meeting.candidates import Candidates, rows_of_pairs
from wsph.contact.meeting.forces import contact_force, open_contact
from wsph.contact.meeting.memory import Memory
from wsph.contact.meeting.structs import law_struct, memory_struct, reading, writing
from wsph.contact.surfaces.laws import Ground, Law, Near, Rigid, Rows
from wsph.contact.surfaces.surface import Surface
from wsph.contact.tools.gaps import shape_struct
from wsph.contact.tools.law import TANGENT, RigidTool
from wsph.contact.tools.moving import pose_struct
from wsph.contact.tools.touching import gaps_kernel, meeting_tool
from wsph.scene.touch.tools import Tool

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
def _meet_kernel(space: Space, kind: str, lagged: bool) -> wp.Kernel:
    """What two tools do to each other: one thread, point by point. `lagged` as with bodies."""
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
            if wp.static(lagged):
                met.speed = met.way / dt
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


class PairLaw(Law):
    """Two rigid tools that meet."""

    def __init__(self, one: RigidTool, other: RigidTool, table: Tool, ground: Ground):
        """`one` by its points, `other` by its shape; friction and damping are those of `table`."""
        self.name, self.one, self.other = f"{one.table.name}-{other.table.name}", one, other
        self._space, self._clock, self._arrays = ground.space, ground.clock, Arrays(ground.clock.device)
        self._once = ground.once
        places, radius = one.form.points
        length = ground.scales.length
        arms = np.linalg.norm(places, axis=1) + radius
        compliance = one.body.compliance(arms / length).sum()
        compliance += other.body.compliance(other.form.arm(places + one.form.middle) / length).sum()
        self._points = _points(table, places / length, radius / length, float(compliance), ground)
        self.memory = Memory(len(places), ground.space, ground.clock, self._arrays)
        everyone = np.arange(len(places))
        self._rows: Candidates = rows_of_pairs(everyone, everyone, ground.clock.device)

    @property
    def sides(self) -> tuple[Surface, ...]:
        """It acts on no surface."""
        return ()

    @property
    def rigid(self) -> tuple[Rigid, ...]:
        """Both tools."""
        return self.one.body, self.other.body

    def near(self) -> Near:
        """No vertices of surfaces."""
        return {}

    def bound(self, surface: Surface) -> tuple[float, float]:
        """Its stiffness follows from the time step."""
        return 0.0, 0.0

    def renew(self, surface: Surface, rows: Rows) -> None:
        """It acts on no surface."""

    def force(self, surface: Surface) -> np.ndarray:
        """It acts on no surface."""
        return np.zeros(self._space.dim)

    def gaps(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (k, dim) of the points of the first and their gaps at the second (k,), where both are, on the host."""
        space, device = self._space, self._clock.device
        pose, points = self.one.body.pose, self._points
        places = pose.place.numpy()[0] + points.place.numpy() @ pose.axes.numpy()[0].reshape(space.dim, -1).T
        x = wp.array(places, dtype=space.vec, device=device)
        gap = wp.zeros(len(places), dtype=space.scalar, device=device)
        normal = wp.zeros(len(places), dtype=space.vec, device=device)
        inputs = [0, self.other.shape.struct, self.other.body.pose, x]
        kernel = gaps_kernel(space, self.other.shape.kind)
        wp.launch(kernel, len(places), inputs=inputs, outputs=[gap, normal], device=device)
        return places, gap.numpy().astype(float) - float(points.radius)

    def act(self) -> None:
        """Add what they do to each other to the loads of both (a launch)."""
        one, other = self.one.body, self.other.body
        kernel = _meet_kernel(self._space, self.other.shape.kind, self._once)
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
        return self._arrays.kept


def _points(table: Tool, places: np.ndarray, radius: float, compliance: float, ground: Ground) -> Struct:
    space = ground.space
    real, made, law = space.scalar, points_struct(space)(), law_struct(space)()
    made.place = wp.array(places, dtype=space.vec, device=ground.clock.device)
    made.radius, made.compliance, made.damping = real(radius), real(compliance), real(table.damping)
    law.friction, law.tangent = real(table.friction), real(TANGENT)
    made.law = law
    return made
