"""Forces and moments through planes of a body, by the forces between its particles.

Behind the plane the body's own forces cancel but for those that reach across it: their sum over the particles there, and
that of their moments about the point, is what the part in front does to the part behind. So it is in exact balance with the
loads, the reactions and the inertia of either part, whatever the form. A particle on the plane is behind it. The point stays
where it is in space, and the particles' arms are those of where they are now.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Protocol

import numpy as np
import warp as wp

from wsph.backend.domain import any_of
from wsph.backend.kernels import kernel
from wsph.backend.reduce import BLOCK
from wsph.backend.space import Space
from wsph.backend.state import Layout, State, fields_struct
from wsph.errors import Fault, SceneError
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.system import System
from wsph.output.fields import AXES
from wsph.reporting import Reported, Term

NEAR = 1e-6
"""Distance from a plane within which a particle is on it [spacings]."""


class Plane(Protocol):
    """A section, as its table in the scene says it."""

    @property
    def name(self) -> str: ...

    @property
    def point(self) -> tuple[float, ...]: ...

    @property
    def normal(self) -> tuple[float, ...]: ...


@cache
def _sum_kernel(space: Space, layout: Layout) -> wp.Kernel:
    dim, vec, Fields = space.dim, space.vec, fields_struct(space, layout)
    torques = (0, 1, 3)[dim - 1]

    @kernel(ranged=True)
    def section_forces(
        first: int,
        particle: wp.array(dtype=wp.int32),
        mass: wp.array(dtype=space.scalar),
        arm: wp.array(dtype=vec),
        fields: Fields,
        rate: Fields,
        starts: wp.array(dtype=wp.int32),
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        block = first + wp.tid()
        force = wp.vec3d()
        moment = wp.vec3d()
        for e in range(starts[block], starts[block + 1]):
            i = particle[e]
            f = wp.vec3d()
            r = wp.vec3d()
            for a in range(wp.static(dim)):
                f[a] = wp.float64(mass[e]) * wp.float64(rate.velocity[i][a])
                r[a] = wp.float64(arm[e][a]) + wp.float64(fields.displacement[i][a])
            force += f
            moment += wp.cross(r, f)
        for a in range(wp.static(dim)):
            sums_out[block, a] = force[a]
        for a in range(wp.static(torques)):
            sums_out[block, dim + a] = moment[a + 3 - torques]

    return section_forces


class SectionForces:
    """Force and moment of one section (`wsph.reporting.Reported`), of k particles behind its plane, nondimensional.

    _side      # (n,) int32, 1 of the particles in front
    _particle  # (k,) int32, those that this process owns
    _mass      # (k,) scalar
    _arm       # (k,) vec, from the point to where they are at the start
    _starts    # (blocks + 1,) int32, where those of each block of the body's particles begin
    _sums      # (blocks, dim and torques) float64
    """

    kind = "section"

    def __init__(self, plane: Plane, key: str, system: OneSetSystem):
        self.name, self._system = plane.name, system
        space, point = system.space, np.array(plane.point)
        normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
        height = (system.position - point) @ normal
        hidden, share, domain = height <= NEAR * system.spacing, system.share, system.domain
        if not all(sides := [any_of(domain, bool(each.any())) for each in (hidden, ~hidden)]):
            side = "behind" if not sides[0] else "in front of"
            text = f"the plane leaves no particle of body {system.name!r} {side} it"
            raise SceneError("scene", [Fault(0, f"{key}.point", text)])
        self._rate = system.temporary()
        arrays = system.arrays.part(f"section {self.name}")
        arrays.take("rate", self._rate.buffer)
        self._side = arrays.of("side", (height > NEAR * system.spacing).astype(np.int32), wp.int32)
        behind = share.own.start + np.flatnonzero(hidden[share.own])
        _, first = np.unique((behind + share.first) // BLOCK, return_index=True)
        self._starts = arrays.of("starts", np.append(first, len(behind)), wp.int32)
        self._particle = arrays.of("particle", behind, wp.int32)
        self._mass = arrays.of("mass", (system.density * system.volume)[behind], space.scalar)
        self._arm = arrays.of("arm", (system.position[behind] - point) / system.scales.length, space.vec)
        torques = ((), ("torque",), tuple(f"torque_{axis}" for axis in AXES))[space.dim - 1]
        names = (*(f"force_{axis}" for axis in AXES[: space.dim]), *torques)
        self._sums = arrays.zeros("sums", (len(first), len(names)), wp.float64)
        rows, width = self._sums.shape
        self.numbers: Mapping[str, Sequence[Term]] = {
            name: [Term(self._sums, k, rows, width)] for k, name in enumerate(names)
        }
        self.gather()

    def gather(self) -> None:
        """Find the forces in the state as it is (launches)."""
        system = self._system
        state: State = system.state
        system.rates.internal(state, self._side, self._rate)
        inputs = [self._particle, self._mass, self._arm, state.struct, self._rate.struct, self._starts]
        system.clock.launch(_sum_kernel(system.space, state.layout), len(self._sums), inputs, [self._sums])


def cut(system: System, planes: Sequence[tuple[int, Plane]]) -> tuple[Reported, ...]:
    """The sections of a body, by their numbers in the scene. Raises SceneError where they cannot be had."""
    for k, _ in planes:
        if not isinstance(system, OneSetSystem) or not system.traits.cuts:
            text = (
                f"the {system.formulation} form has no forces between particles that a plane could cut: use an integrator of one"
                " set, such as leapfrog, or a probe of the stress"
            )
            raise SceneError("scene", [Fault(0, f"sections.{k}", text)])
    return tuple(SectionForces(plane, f"sections.{k}", system) for k, plane in planes)  # pyright: ignore[reportArgumentType]
