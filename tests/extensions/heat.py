"""Heat that particles of a body conduct to each other, as a part of the body.

    rho c dT/dt = k div grad T,    no flux through faces and sides of cracks

in the reference configuration, from the pairs of the forces and their weights w = |W'|/r (Brookshaw 1985; Cleary & Monaghan
1999). With S_i = sum_j w_ij r_ij^2

    dT_i/dt = k/(rho c) sum_j g_ij (T_j - T_i),    g_ij = dim/V_i w_ij (V_i/S_i + V_j/S_j)

What j hands to i leaves j: the thermal energy sum rho V c T is kept to rounding. Along a bar it is of second order in the
spacing; in 2D and 3D faces that heat flows along make it of first. The eigenvalues of this sum lie between 0 and
-2 k/(rho c) max_i sum_j g_ij (Gershgorin), and an explicit step holds them while its dt times the largest is at most 2.

A temperature is a number of K: the units of a scene know none, and W/(m K) is written "W/m", J/(kg K) "J/kg". Nothing acts
back on the motion.
"""

from functools import cache
from typing import Annotated, ClassVar

import numpy as np
import warp as wp
from pydantic import field_validator

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.kernels import kernel
from wsph.backend.pair_loops import element
from wsph.backend.space import Space
from wsph.backend.state import Field, Layout, State, fields_struct
from wsph.errors import Refused
from wsph.expressions import compile_expression, constant_program
from wsph.parts.part import Attached, Host, Neighbourhood, Part
from wsph.parts.terms import points_struct
from wsph.protocols import Entry, Traits
from wsph.quantities import Unit, Value
from wsph.sph.rows import rows_of, rows_struct


class Heat(Part):
    """Conduction of heat: `conductivity` [W/(m K)], `specific_heat` [J/(kg K)], and the `initial` temperature [K], a number
    or an expression of x, y, z."""

    key: ClassVar[str] = "heat"
    offers: ClassVar[tuple[str, ...]] = ("temperature",)
    conductivity: Annotated[float, Unit("W/m", gt=0)]
    specific_heat: Annotated[float, Unit("J/kg", gt=0)]
    initial: Value = 0.0

    @field_validator("initial")
    @classmethod
    def _of_places(cls, value: float | str) -> float | str:
        if isinstance(value, str) and compile_expression(value).uses("t"):
            raise ValueError("an initial temperature does not depend on t")
        return value

    @classmethod
    def fits(cls, traits: Traits) -> bool:
        return traits.pairwise and traits.reference

    def refuse(self, host: Host) -> None:
        shortest, longest = host.lattice.edges
        if host.lattice.irregular or longest > 1.001 * shortest:
            # What a particle sees has to be the same in all directions.
            raise Refused(f"body {host.name!r}: heat needs a lattice of one spacing, without jitter and map")
        if host.correction == "paper":
            raise Refused(f'body {host.name!r}: ghosts have no temperature: heat needs run.correction = "symmetric"')

    def fields(self, host: Host) -> tuple[Field, ...]:
        return (Field("temperature", 1, bounded=True),)

    def attach(self, host: Host, seen: Neighbourhood, state: State, clock: Clock, arrays: Arrays) -> Attached | None:
        expression = (
            compile_expression(self.initial) if isinstance(self.initial, str) else constant_program(self.initial)
        )
        state.write("temperature", expression(seen.position)[:, None])
        density, scales = host.constitutive.material.density, host.scales
        diffusivity = self.conductivity / (density * self.specific_heat) * scales.time / scales.length**2
        return Conduction(diffusivity, self.specific_heat / scales.velocity**2, host, seen, state, clock)


@cache
def _conduct_kernel(space: Space, layout: Layout) -> wp.Kernel:
    real, Fields, Rows, Points = space.scalar, fields_struct(space, layout), rows_struct(space), points_struct(space)
    temperature = space.vector(1)
    at = element(wp.int32, real, temperature)

    @kernel(ranged=True, pairs=True)
    def conduct(first: int, factor: real, rows: Rows, points: Points, fields: Fields, rate_out: Fields):
        i = first + wp.tid()
        share = points.share[i]
        T = fields.temperature[i]
        flow = temperature()
        k = rows.offsets[i]
        end = rows.offsets[i + 1]
        while k < end:
            j = at(rows.indices, k)
            flow = flow + (at(rows.weight, k) * (share + at(points.share, j))) * (at(fields.temperature, j) - T)
            k += 1
        rate_out.temperature[i] = (factor / points.volume[i]) * flow

    return conduct


class Conduction(Attached):
    """The temperature of a body: its rate, the limit of its step, its energy on the ledger."""

    def __init__(
        self, diffusivity: float, specific_heat: float, host: Host, seen: Neighbourhood, state: State, clock: Clock
    ):
        """`diffusivity` k/(rho c) and `specific_heat` nondimensional."""
        self._space, self._points, self._state, self._clock = host.space, seen.points, state, clock
        self._factor = host.space.scalar(diffusivity * host.space.dim)
        self._rows = rows_of(host.space, seen.pairs, seen.weight)
        self._capacity = host.constitutive.density * seen.volume * specific_heat
        self.ledger = (Entry("thermal", lambda: self.energy),)
        share, weight = (array.numpy().astype(float) for array in (seen.points.share, seen.weight))
        i, j = seen.pairs.rows(), seen.pairs.indices.numpy()
        sums = np.bincount(i, weight * (share[i] + share[j]), state.n) / seen.volume
        self.limit = 1.0 / float(diffusivity * host.space.dim * sums.max())

    def rate(self, state: State, out: State) -> None:
        """dT/dt (a launch)."""
        kernel = _conduct_kernel(self._space, state.layout)
        inputs = [self._factor, self._rows, self._points, state.struct]
        self._clock.launch(kernel, state.n, inputs, [out.struct])

    @property
    def energy(self) -> float:
        """Thermal energy, nondimensional (a copy from the device)."""
        return float((self._capacity * self._state.read("temperature")[:, 0]).sum())
