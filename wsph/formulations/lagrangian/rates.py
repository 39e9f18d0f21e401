"""Right-hand sides of a body whose pairs are those of the reference configuration: one displacement field, its gradient at
the points where the stress lives, forces that are its transpose.

Nodes carry velocity and displacement, points carry the stress. A point p sees nodes j with scalar weights w_pj, which hold
no volumes, and with r_j = X_j - Xbar_p, y_j = u_j - ubar_p about the weighted means:

    M_p = (sum w r (x) r)^-1,   H_p = (sum w y (x) r) M_p,   F = I + H,   P = J stress F^-T
    f_j = -sum_p w_pj [V_p P_p M_p r + kappa_p (y_j - H_p r)]

The force is minus the gradient of the energy sum V_p psi(F_p) + sum kappa_p/2 w |y - H r|^2: momentum is kept to rounding,
and angular momentum and energy to the integrator. The second term, the stabilisation, is a stiffness against the
misfit of a linear field to y: it holds the modes that a gradient alone does not see.

Two forms of it:
- `stress-points`: nodes on the lattice and on the faces, points at the cell centres, the two sets of Taylor-SPH. By far the
  most accurate: a cantilever of twelve rows vibrates within 0.1 % where pairs of a kernel are 3-5 % slow.
- `total-lagrangian`: one set, every particle is its own point (Xbar_p = X_p), the form of total-Lagrangian SPH with each
  side's own correction (sigma_i L_i^-1 + sigma_j L_j^-1). Particles stand on the faces and pairs are the edges of the cells
  (`wsph.formulations.lagrangian.edges`), whose gradients and stresses are averaged once more; or pairs are those of a
  kernel, w = |W'|/r, whose stress beside a face is off however fine the lattice. `run.correction = "paper"` puts L_i on
  both (He & Seaid 2016, eq 13 with eq 3) and surrounds a bar with ghosts (`wsph.formulations.lagrangian.ghosts`), as the
  paper does; it is there to compare with.

H follows from the displacements in every evaluation: nothing drifts, and single precision keeps the digits of small strains.
Forces between pairs beside the stress are terms of a body's parts (`wsph.parts.terms`).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Iterable
from functools import cache, cached_property, partial

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array, Space, Struct
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.errors import Refused
from wsph.formulations.lagrangian.averaging import gradient_kernel, spread_kernel
from wsph.formulations.lagrangian.blocks import block_strain_kernel, block_stress_kernel, blocks_of, dilation_kernel
from wsph.formulations.lagrangian.corners import corner_reference
from wsph.formulations.lagrangian.edges import edge_reference
from wsph.formulations.lagrangian.flow import drift_kernel, flow_kernel
from wsph.formulations.lagrangian.forces import force_between_kernel, force_from_points_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.ghosts import GhostLayer, Ghosts, ghosts
from wsph.formulations.lagrangian.held_energy import held_energy_kernel, summed_up
from wsph.formulations.lagrangian.set_up import Reference, find_reference
from wsph.formulations.lagrangian.strain import strain_kernel
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_rates import ReferenceRates, refuse_other
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Setup
from wsph.parts.body_force import BodyForceKinds
from wsph.parts.fading import Fading
from wsph.parts.part import Attached, Neighbourhood, Parts
from wsph.parts.table import PARTS
from wsph.parts.terms import Points, answers_struct, points_struct, with_share
from wsph.plugins.blame import blame
from wsph.ranks.blocks import own_sum
from wsph.sph.pairs import Pairs
from wsph.sph.rows import rows_of


class LagrangianKernels:
    """The kernels of a composition: one instance per (space, laws, which fields there are, form).

    `strain` finds what forces take of every point, `force` the accelerations, `drift` and `flow` the rates of the rest,
    `held` the energy of the stabilisation; `gradient` and `spread` stand before and behind `strain` where the form averages;
    those that the form has.
    """

    def __init__(self, space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form):
        if form.blocks:
            self.strain = (block_strain_kernel if form.total else block_stress_kernel)(space, laws, layout, form)
            self.dilation = dilation_kernel(space, layout, form)
        else:
            self.strain = strain_kernel(space, laws, layout, form)
        make = force_from_points_kernel if form.points else force_between_kernel
        self.force = make(space, layout, parts, form)
        self.drift = drift_kernel(space, layout)
        if form.staged:
            self.gradient, self.spread = gradient_kernel(space, layout, form), spread_kernel(space, form)
        if form.stabilised:
            self.held = held_energy_kernel(space, layout, form.points)
        if not form.total:
            self.flow = flow_kernel(space, laws, layout, form)


@cache
def _kernels(space: Space, laws: Laws, layout: Layout, parts: BodyForceKinds, form: Form) -> LagrangianKernels:
    return LagrangianKernels(space, laws, layout, parts, form)


class LagrangianRates(ReferenceRates):
    """The right-hand sides of one body in the reference configuration, and its pairs; `rate` and `refresh` are launches."""

    def __init__(self, made: RateSetup, state: State):
        host, placement = made.host, made.placement
        self._space, self._clock, self._density = host.space, made.setup.clock, host.space.scalar(made.density)
        self._placement, self._constitutive, self._loads = placement, host.constitutive, made.loads
        self._force, self._arrays, self._domain = made.force, made.arrays.part("rates"), made.domain
        nodes, cells = host.geometry.centred
        particles = nodes if placement.at_nodes else cells
        points = cells if placement.points else particles
        self._ghosts: GhostLayer | None = None
        if host.correction == "paper":
            found = _ghosts(made)
            if found is not None:
                step = host.geometry.spacing / host.scales.length
                arrays = self._arrays.part("ghosts")
                self._ghosts = GhostLayer(found, host.space, made.layout, placement.count, step, self._clock, arrays)
                particles = np.concatenate([particles, found.place])
        if host.corners:
            reference = corner_reference(host, self._clock.device)
        elif host.edges:
            reference = edge_reference(host, placement.gradients, self._clock.device)
        else:
            quantum = "f64" if host.geometry.irregular else host.space.precision
            reference = find_reference(host, particles, points, quantum, self._clock.device, placement.position)
        if not any(part.frees for part in host.parts.values()):
            # Copies may have others around them, which are not here.
            own = placement.point_share.owns(np.arange(len(reference.rank)))
            made.refuse_isolated(np.where(own, reference.rank, host.space.dim))
        # Ghosts, where there are any, pass loads on to the particles.
        self.form = made.form(loaded=made.loads.some and self._ghosts is None)
        self._coefficients = made.coefficients(self.form)
        with blame(host.constitutive.who):
            self.kernels = _kernels(host.space, host.constitutive.laws, made.layout, made.force.parts, self.form)
        self._allocate(reference, made.stabilisation, state)
        self._acting, self._response = self._points, self._points
        self._blocks = blocks_of(host.lattice, host.space, self._arrays) if self.form.blocks else (0, None)

    def _allocate(self, reference: Reference, stabilisation: float, state: State) -> None:
        """The arrays of the reference configuration and those that evaluations write, nondimensional: m points, n particles.

        _weight   # w_pj from points to particles, (pairs,) scalar; `_back_weight` the same by particle
        _points   # `wsph.parts.terms.points_struct`; moments M_p, shares V_p over the spread
        _volume   # of the particles, (n,) scalar
        _spread   # sum w r^2, on the host, (m,)
        _answers  # `wsph.parts.terms.answers_struct`; `corrected` is V_p P_p M_p less the stabilisation's part
        holding   # forces per mass that hold spurious modes, (n,) vec, or one entry where there are none
        """
        space, arrays, placement, real = self._space, self._arrays, self._placement, self._space.scalar
        m, separate = len(placement.point_volume), placement.points
        joined = self._ghosts.joined if self._ghosts is not None else np.asarray
        self._pairs, self._spread = reference.pairs, reference.spread
        self._weight = arrays.of("weight", reference.weight, real)
        self._rows = rows_of(space, reference.pairs, self._weight)
        points: Points = points_struct(space)()
        points.node = arrays.of("node", reference.place, space.vec)
        points.centre = arrays.of("centre", reference.centre, space.vec) if separate else points.node
        points.moment = arrays.of("moment", joined(reference.moment), space.mat)
        points.volume = arrays.of("point volume", joined(placement.point_volume), real)
        # Volume over the spread of the neighbours: the scale of pair forces and of the stabilisation.
        points.share = arrays.of("share", joined(placement.point_volume / reference.spread), real)
        if reference.gradients is not None:
            points.slope = arrays.of("slope", reference.gradients.slope, space.vec)
            points.back = arrays.of("back", reference.gradients.back, space.vec)
        if reference.slope is not None:
            points.slope = arrays.of("slope", reference.slope, space.vec)
        points.stabilisation = real(stabilisation)
        self._points = points
        self._volume = arrays.of("volume", placement.volume, real) if separate else points.volume
        answers = answers_struct(space)()
        averaged = separate and (self.form.stabilised or self.form.breaks)
        extra = self.form.stress_term is not None or self.form.rate_term is not None
        answers.mean = arrays.zeros("mean", m if averaged else 1, space.vec)
        answers.corrected = arrays.zeros("corrected", len(points.moment), space.mat)
        answers.extra = arrays.zeros("extra", m if extra else 1, space.mat)
        answers.gradient = arrays.zeros("gradient", m, space.mat) if self.form.staged else state.struct.deformation
        answers.nominal = arrays.zeros("nominal", m if self.form.staged else 1, space.mat)
        self._answers = answers
        flows = self.form.staged and not self.form.total
        self._rate_gradient = arrays.zeros("rate gradient", m, space.mat) if flows else answers.gradient
        self._dilation = arrays.zeros("dilation", m if flows and self.form.blocks else 1, real)
        self.holding = arrays.zeros("holding", placement.count if self.form.holds else 1, space.vec)
        for name in ("offsets", "indices", "reach"):
            arrays.take(f"pairs.{name}", getattr(self._pairs, name))
        self._back, self._back_weight, self._back_rows = None, None, None
        if separate:
            self._back, order = self._pairs.transposed()
            self._back_weight = arrays.of("back weight", reference.weight[order], real)
            self._back_rows = rows_of(space, self._back, self._back_weight)
            if reference.slope is not None:
                points.back = arrays.of("back slope", reference.slope[order], space.vec)
            for name in ("offsets", "indices", "reach"):
                arrays.take(f"back.{name}", getattr(self._back, name))

    @property
    def seen(self) -> Neighbourhood:
        """The points and their neighbours, for parts of the body."""
        placement = self._placement
        return Neighbourhood(
            self._pairs,
            self._weight,
            self._points,
            self._answers.mean,
            self._answers.gradient,
            self._spread,
            placement.point_volume,
            placement.position,
            Parts(self._domain, placement.point_share, placement.share),
            self._back,
            self._back_weight,
        )

    def attach(self, parts: Iterable[Attached]) -> None:
        """Use the shares and weights that parts of the body change."""
        for part in parts:
            if part.response is not None:
                self._response = part.response
            if part.share is not None:
                self._acting = with_share(self._space, self._points, part.share, fades=self.form.fades >= 0)

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """What the stabilisation has of its own on the device."""
        flow = self._constitutive.flow
        if flow is None or self.form.fades < 0:
            return {}
        fields = state.layout, state.struct
        whole = partial(own_sum, share=self._placement.point_share, domain=self._domain)
        return {"fading": Fading(flow, self._space, self.seen, *fields, self._clock, arrays.part("fading"), whole)}

    @property
    def pairs(self) -> int:
        """Directed pairs of its own, from points to particles and, where these are not the same, back."""
        if self._placement.share.complete:
            return self._pairs.count * (1 if self._back is None else 2)
        back = self._back.within(self._placement.share.own) if self._back is not None else 0
        return self._pairs.within(self._placement.point_share.own) + back

    @property
    def neighbours(self) -> Pairs:
        """The particles that each is joined to: by its pairs, or by a point that sees both."""
        return self._joined

    @cached_property
    def _joined(self) -> Pairs:
        return self._pairs if self._back is None else joined(self._pairs, self._back)

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes the deformation."""
        if part != "rest":
            self._find_forces(state, out)
        if part != "velocity":
            n, m = self._placement.count, len(self._placement.point_volume)
            self._clock.launch(self.kernels.drift, n, [state.struct], [out.struct])
            if not self.form.total:
                refuse_other(state)
                others = self._others(state)
                if self.form.staged:
                    self._find_gradient(others, "velocity", self._rate_gradient)
                time = [self._clock.time, self._space.scalar(ahead)]
                if self.form.blocks:
                    count, blocks = self._blocks
                    inputs = [*time, self._rows, self._points, blocks, self._rate_gradient, state.struct]
                    self._clock.launch(self.kernels.dilation, count, inputs, [self._dilation])
                inputs = [*time, self._constitutive.params, self._coefficients, self._rows, self._points]
                inputs += [self._rate_gradient, self._dilation, state.struct, others]
                self._clock.launch(self.kernels.flow, m, inputs, [out.struct])

    def refresh(self, state: State) -> None:
        """Deformation and, of a total law, stress of a state from its displacement (launches)."""
        if state.derived is not None:
            state.derived.of = state
        others = self._others(state)
        if self.form.staged:
            self._find_gradient(others, "displacement", self._answers.gradient)
        m, law = len(self._placement.point_volume), self._constitutive.params
        if self.form.blocks:
            count, blocks = self._blocks
            inputs, outputs = [self._rows, self._points, blocks], [state.struct, self._answers]
            if self.form.total:
                self._clock.launch(self.kernels.strain, count, [law, *inputs], outputs)
            else:
                self._clock.launch(
                    self.kernels.strain, count, [self._coefficients, *inputs], [self._response, *outputs]
                )
        else:
            inputs = [law, self._coefficients, self._density, self._rows, self._points, others]
            self._clock.launch(self.kernels.strain, m, inputs, [self._response, state.struct, self._answers])
        if self.form.staged:
            inputs = [self._rows, self._acting, _field(others, "displacement")]
            self._clock.launch(self.kernels.spread, m, inputs, [self._answers])
        if self._ghosts is not None:
            self._ghosts.answer(self._loads.vectors, self._answers.corrected)

    def _find_gradient(self, others: Struct, name: str, out: Array) -> None:
        """Gradients of a field of the particles as pairs see them (a launch)."""
        inputs = [self._coefficients, self._rows, self._points, others, _field(others, name)]
        self._clock.launch(self.kernels.gradient, len(out), inputs, [out])

    def _others(self, state: State) -> Struct:
        """The fields that particles see: those of the state, or of particles and ghosts (a launch)."""
        return state.struct if self._ghosts is None else self._ghosts.follow(state)

    def _find_forces(self, state: State, out: State) -> None:
        self.refresh(state)
        self._loads.follow(state)
        self._sum_forces(self._force.struct, [self._loads.vectors, self._loads.following], state, out)

    def internal(self, state: State, side: Array, out: State) -> None:
        """The accelerations of `out` by the body's own forces in a state, without loads, gravity and damping (launches);
        whatever the `side` of a plane that particles are on: on each the forces within cancel."""
        if self._ghosts is not None:
            raise Refused(
                'run.correction = "paper" keeps no momentum at a boundary: there are no forces of the body alone'
            )
        self.refresh(state)
        body, none = self._alone(self._force.struct, self._arrays, self._placement.count, self._space)
        self._sum_forces(body, [none, none], state, out)

    def _sum_forces(self, body: Struct, loads: list[Array], state: State, out: State) -> None:
        """Accelerations from what points answer, under loads (a launch)."""
        n = self._placement.count
        if self._back_rows is not None:
            inputs = [body, self._back_rows, self._acting, self._answers, *loads, self._volume]
            self._clock.launch(self.kernels.force, n, [*inputs, state.struct], [out.struct])
            return
        others = state.struct if self._ghosts is None else self._ghosts.state.struct
        inputs = [body, self._coefficients, self._rows, self._acting, self._answers, *loads]
        self._clock.launch(self.kernels.force, n, [*inputs, state.struct, others], [self.holding, out.struct])

    def held_energy(self, state: State) -> float:
        """Energy of the stabilisation, of a state that is up to date, nondimensional (a launch and a copy)."""
        if not self.form.stabilised:
            return 0.0
        inputs = [self._rows, self._acting, self._answers, state.struct]
        share, device = self._placement.point_share, self._clock.device
        return summed_up(self.kernels.held, inputs, share, self._domain, device)


def _field(fields: Struct, name: str) -> Array:
    """A field of a state by its name."""
    return getattr(fields, name)


def joined(pairs: Pairs, back: Pairs) -> Pairs:
    """The particles that a point sees together; `pairs` from points to particles, `back` from these to points."""
    there: np.ndarray = pairs.offsets.numpy()
    particles: np.ndarray = pairs.indices.numpy()
    seeing: np.ndarray = back.indices.numpy()
    n, many = back.targets, np.diff(there)[seeing]
    first = np.repeat(back.rows(), many)
    within = np.arange(len(first)) - np.repeat(np.cumsum(many) - many, many)
    second = particles[np.repeat(there[seeing], many) + within]
    keys = np.unique(first.astype(np.int64)[first != second] * n + second[first != second])
    offsets = np.concatenate([[0], np.cumsum(np.bincount(keys // n, minlength=n))])
    ends, others = (wp.array(a, dtype=wp.int32, device=pairs.offsets.device) for a in (offsets, keys % n))
    return Pairs(ends, others, n, n, back.reach)


def _ghosts(made: RateSetup) -> Ghosts | None:
    """The ghosts of a bar in the paper's form. Raises Refused for what that is not made for."""
    host, name = made.host, made.host.name
    holding = [key for key, part in PARTS.items() if part.holds_modes]
    acting = any(part.acts and part.holds_modes for part in host.parts.values())
    if made.placement.at_nodes or made.stabilisation > 0.0 or acting:
        text = 'run.correction = "paper" is of the total-lagrangian form with particles in the cells, without'
        raise Refused(f"body {name!r}: {text} {', '.join(holding[:-1])} and {holding[-1]}")
    if host.space.dim > 1 and made.loads.count:
        raise Refused(
            f'body {name!r}: with run.correction = "paper" a face feels half of its load, because L_i on both sides keeps no'
            " momentum at a boundary, and only bars have ghosts that hand it on; use the symmetric correction"
        )
    if made.moved and host.space.dim == 1:
        raise Refused(
            f'body {name!r}: run.correction = "paper" takes ends that are loaded or held: the work of ghosts beyond an end'
            " that is moved is on no ledger; use the symmetric correction"
        )
    if host.geometry.mapped:
        raise Refused(f'body {name!r}: run.correction = "paper" needs a regular lattice, without `map`')
    if host.geometry.cracks and host.space.dim == 1:
        raise Refused(f'body {name!r}: run.correction = "paper" surrounds a bar with ghosts; it cannot be cracked')
    return ghosts(host.lattice, made.conditions, host.support) if host.space.dim == 1 else None


def build(setup: Setup) -> OneSetSystem:
    """A body in the reference configuration."""
    return OneSetSystem(setup, LagrangianRates)
