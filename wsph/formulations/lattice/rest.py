"""The points of a body that are no boxes of its grid: a layer at a fitted surface, with rows of pairs of its own.

Their forces are those of `wsph.formulations.lagrangian`, by its kernels; nodes that see them take what they are pushed with
beside what the boxes hand to them.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import replace
from functools import cache
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.corners import corner_reference
from wsph.formulations.lagrangian.flow import flow_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.held_energy import held_energy_kernel
from wsph.formulations.lagrangian.strain import strain_kernel
from wsph.formulations.lattice.forces import push_kernel
from wsph.formulations.one_set_setup import RateSetup
from wsph.parts.fading import Fading
from wsph.parts.part import Neighbourhood, Parts
from wsph.parts.terms import Points, answers_struct, points_struct, with_share
from wsph.sph.pairs import Pairs
from wsph.sph.rows import rows_of


class _Kernels:
    """The kernels of a composition, as `wsph.formulations.lagrangian.rates.LagrangianKernels` has them."""

    def __init__(self, space: Space, laws: Laws, layout: Layout, form: Form):
        self.strain, self.push = strain_kernel(space, laws, layout, form), push_kernel(space, layout, form)
        if not form.total:
            self.flow = flow_kernel(space, laws, layout, form)
        if form.stabilised:
            self.held = held_energy_kernel(space, layout, True)


_kernels = cache(_Kernels)


class Rest:
    """Some `points` (k,) of a body; `strain`, `push` and `flow` are launches.

    pushed  # forces on the nodes, (n,) vec, and behind them those of the viscous stress
    """

    def __init__(self, made: RateSetup, points: np.ndarray, form: Form, stabilisation: float):
        host, arrays, form = made.host, made.arrays.part("rest"), replace(form, beside=True)
        self._space, self._clock, self._layout, self._which = host.space, made.setup.clock, made.layout, points
        self._law, self._density = host.constitutive.params, host.space.scalar(made.density)
        self._form, self._coefficients = form, made.coefficients(form)
        self.kernels = _kernels(host.space, host.constitutive.laws, made.layout, form)
        self._placement, self._domain = made.placement, made.domain
        self._volume = made.placement.point_volume[points]
        self._allocate(made, arrays, stabilisation)
        self._acting = self._points
        self._response: object = self._points

    def _allocate(self, made: RateSetup, arrays: Arrays, stabilisation: float) -> None:
        """The rows of the points and, one after the other, those of the nodes that see any."""
        space, real, host, m = self._space, self._space.scalar, made.host, len(self._volume)
        reference = corner_reference(host, self._clock.device, self._which)
        self._pairs, self._spread = reference.pairs, reference.spread
        self._weight = arrays.of("weight", reference.weight, real)
        self._rows = rows_of(space, self._pairs, self._weight)
        back, order = self._pairs.transposed()
        ends: np.ndarray = back.offsets.numpy()
        many = np.diff(ends)
        nodes = np.flatnonzero(many)
        self._nodes = arrays.of("nodes", nodes, wp.int32)
        offsets = wp.array(np.append(ends[nodes], ends[-1]), dtype=wp.int32, device=self._clock.device)
        self._back = Pairs(offsets, back.indices, len(nodes), m, back.reach)
        self._back_weight = arrays.of("back weight", reference.weight[order], real)
        self._back_rows = rows_of(space, self._back, self._back_weight)
        points: Points = points_struct(space)()
        points.node = arrays.of("node", reference.place, space.vec)
        points.centre = arrays.of("centre", reference.centre, space.vec)
        points.moment = arrays.of("moment", reference.moment, space.mat)
        points.volume = arrays.of("point volume", self._volume, real)
        points.share = arrays.of("share", self._volume / reference.spread, real)
        if reference.slope is not None:
            points.slope = arrays.of("slope", reference.slope, space.vec)
            points.back = arrays.of("back slope", reference.slope[order], space.vec)
        points.row = arrays.of("row", self._which, wp.int32)
        points.stabilisation = real(stabilisation)
        self._points, answers = points, answers_struct(space)()
        answers.mean = arrays.zeros("mean", m if self._form.stabilised else 1, space.vec)
        answers.corrected = arrays.zeros("corrected", m, space.mat)
        answers.extra = arrays.zeros("extra", m if self._form.damps else 1, space.mat)
        answers.gradient = arrays.zeros("gradient", m, space.mat)
        answers.nominal = arrays.zeros("nominal", 1, space.mat)
        self._answers = answers
        for name, pairs in (("pairs", self._pairs), ("back", self._back)):
            arrays.take(f"{name}.offsets", pairs.offsets)
            arrays.take(f"{name}.indices", pairs.indices)
        self.pushed: Array = arrays.zeros("pushed", (1 + self._form.damps) * made.placement.count, space.vec)

    def strain(self, state: State) -> None:
        """The answers of the points to a state, and its derived fields at them (launches)."""
        inputs = [self._law, self._coefficients, self._density, self._rows, self._points, state.struct]
        outputs = [self._response, state.struct, self._answers]
        self._clock.launch(self.kernels.strain, len(self._volume), inputs, outputs)

    def push(self, state: State) -> None:
        """The forces of the answers on the nodes (launches)."""
        inputs = [self._back_rows, self._acting, self._answers, self._nodes, state.struct]
        self._clock.launch(self.kernels.push, self._back.targets, inputs, [self.pushed])

    def flow(self, state: State, out: State, ahead: float) -> None:
        """The rates of the points' stress and internals (a launch)."""
        inputs = [self._clock.time, self._space.scalar(ahead), self._law, self._coefficients, self._rows, self._points]
        inputs += [self._answers.gradient, self._points.share, state.struct, state.struct]
        self._clock.launch(self.kernels.flow, len(self._volume), inputs, [out.struct])

    def held_energies(self, state: State) -> np.ndarray:
        """Energies of the residual, of a state that is up to date, of all points of the body, (m,) nondimensional, none of
        those that are not these (a launch and a copy)."""
        m, device = len(self._volume), self._clock.device
        energies: Array = wp.zeros(m, dtype=wp.float64, device=device)
        inputs = [0, self._rows, self._acting, self._answers, state.struct, 0]
        wp.launch(self.kernels.held, m, inputs=inputs, outputs=[energies], device=device)
        every = np.zeros(len(self._placement.point_volume))
        every[self._which] = energies.numpy()
        return every

    def fading(self, flow: tuple[int, float], state: State, arrays: Arrays, into: tuple[Array, Array]) -> Fading:
        """What the residual of the points has of its own on the device; `flow` and `into`, arrays of all points, as
        `wsph.parts.fading.Fading` has them."""
        seen = Neighbourhood(
            self._pairs,
            self._weight,
            self._points,
            self._answers.mean,
            self._answers.gradient,
            self._spread,
            self._volume,
            self._placement.position,
            Parts(self._domain, self._placement.point_share, self._placement.share),
            self._back,
            self._back_weight,
        )
        found = Fading(flow, self._space, seen, self._layout, state.struct, self._clock, arrays, into)
        self._acting = with_share(self._space, self._points, cast(Points, found.response).share, fades=True)
        self._response = found.response
        return found
