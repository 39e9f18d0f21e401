"""A body as one-set integrators see it: `rate`, `combine`, `drift`, `impose`, `constrain`, `accept` over one flat state.

The right-hand sides are those of a form (`wsph.formulations.lagrangian`, `wsph.formulations.updated`). Time steps are
limited by the body's small motions (`wsph.stability.small_motions`).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import Protocol, cast

import numpy as np

from wsph.backend.algebra import combine
from wsph.backend.clock import Clock
from wsph.backend.space import Array
from wsph.backend.state import Derived, Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.natural import layer_conditions, node_conditions
from wsph.boundary.values import BoundaryValues
from wsph.boundary.walls import Wall
from wsph.boundary.work import ConstraintWork, LoadWork
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.layout import (
    deformation_field,
    deviation_field,
    displacement_field,
    matter_fields,
    velocity_field,
)
from wsph.formulations.one_set_setup import Loads, Placement, RateSetup, pair_warnings, remembers
from wsph.formulations.setup import Setup
from wsph.formulations.system import System
from wsph.parts.body_force import BodyForce
from wsph.parts.fading import Fading
from wsph.parts.part import Attached, Host, Neighbourhood
from wsph.protocols import Entry
from wsph.sph.averages import average, outward_weights, spanning_weights
from wsph.sph.pairs import Pairs
from wsph.sph.weights import Weights
from wsph.stability.krylov import Moving
from wsph.stability.small_motions import SmallMotions


class Rates(Protocol):
    """The right-hand sides of a body, and its pairs."""

    form: Form
    holding: Array
    """Forces per mass that hold spurious modes, of the last evaluation, (n,) vec, where there are any."""

    @property
    def pairs(self) -> int: ...

    @property
    def neighbours(self) -> Pairs: ...

    @property
    def seen(self) -> Neighbourhood | None: ...

    def attach(self, parts: list[Attached]) -> None: ...

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None: ...

    def refresh(self, state: State) -> None: ...

    def held_energy(self, state: State) -> float: ...

    def follow(self) -> bool: ...

    def restored(self) -> None: ...


def layout_of(host: Host) -> Layout:
    """The fields of a one-set state."""
    laws, reference = host.constitutive.laws, host.traits.reference
    extra = [field for part in host.parts.values() if part.acts for field in part.fields(host)]
    return Layout.of(
        (
            velocity_field(host.space),
            *(field for field in extra if field.leads),
            *matter_fields(host.constitutive, at_points=True, derived=laws.total is not None),
            deformation_field(host.space, at_points=True, derived=reference),
            displacement_field(host.space),
            deviation_field(host.space, remembers(host)),
            *(field for field in extra if not field.leads),
        )
    )


def _buffers(terms: list[tuple[float, State]]) -> list[tuple[float, Array]]:
    return [(c, state.buffer) for c, state in terms]


class OneSetSystem(System):
    """A body as one-set integrators see it."""

    walls: tuple[Wall, ...] = ()
    """Faces behind which its particles have images."""

    def __init__(self, setup: Setup, rates: Callable[[RateSetup, State], Rates]):
        super().__init__(setup)
        host, space = setup.host, setup.space
        for part in host.parts.values():
            part.refuse(host)
        self.placement = Placement.of(host)
        self.points, self.position, self.volume = self.placement.points, self.placement.position, self.placement.volume
        self.conditions = self._find_conditions(setup)
        self.layout = self._find_layout(host)
        self._derived: Derived | None = None
        if any(field.derived for field in self.layout.fields):
            self._derived = Derived(space, self.layout, len(self.point_volume), self.device)
            self.arrays.take("derived", self._derived.buffer)
        self.state = self._make(self.count, self.layout, len(self.point_volume), self._derived, own=True)
        units = {"velocity": setup.scales.velocity}
        self.boundary = BoundaryValues(
            space, self.conditions, self.state, self.position, units, setup.scales.time, self.device
        )
        self.loads = Loads(setup, self.conditions, self.placement, self.arrays.part("loads"))
        self.force = BodyForce(
            setup.scene.gravity, setup.body.damping, space, setup.scales, self.density, self.volume, self.device
        )
        made = RateSetup(
            setup, host, self.placement, self.layout, self.conditions, self.loads, self.force, self.arrays, self.walls
        )
        self.rates = rates(made, self.state)
        self.form, self.stabilisation, self._host = self.rates.form, made.stabilisation, host
        self.response, self.breaks, self.total = self.form.response, self.form.breaks, self.form.total
        self.attached = self._attach(host)
        self.warnings = pair_warnings(made, self.form.blocks)
        self.work = self._works = _Works(self, self.rates.holding if self.form.holds else None)
        self.motions = SmallMotions(cast(Moving, self))
        for name, holder in (("boundary", self.boundary), ("loads", self.loads.values)):
            self.arrays.part(name).adopt(holder)
        for name, works in (
            ("work", self._works.constraints),
            ("loads.work", self._works.loads),
            ("force", self.force),
        ):
            self.arrays.part(name).adopt(works, works.kept())

    def _find_conditions(self, setup: Setup) -> Conditions:
        """What is prescribed to its particles."""
        conditions = node_conditions if self.placement.at_nodes else layer_conditions
        return conditions(setup.scene, self.name, self.lattice)

    def _find_layout(self, host: Host) -> Layout:
        """The fields of its states."""
        return layout_of(host)

    def _attach(self, host: Host) -> dict[str, Attached]:
        """The parts of the body on the device."""
        seen = self.rates.seen
        found: dict[str, Attached] = {}
        if seen is not None:
            for key, part in host.parts.items():
                made = part.attach(host, seen, self.state, self.clock, self.arrays.part(key)) if part.acts else None
                if made is not None:
                    found[key] = made
            flow = host.constitutive.flow
            if flow is not None and self.form.fades >= 0:
                fading = Fading(*flow, self.space, seen, self.state, self.clock, self.arrays.part("fading"))
                found["fading"] = fading
        self.rates.attach(list(found.values()))
        return found

    def new(self) -> State:
        """A state, zero but for the internals' initial values."""
        return self._make(self.count, self.layout, len(self.point_volume), self._derived)

    def temporary(self) -> State:
        """A state that the caller owns: it is freed with the caller, not with the body."""
        points = len(self.point_volume)
        state = State(self.space, self.count, self.layout, self.device, points, self._derived, self._counts)
        self._initial_internals(state)
        return state

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`out` = the time derivative of `state`: of its velocity, of the rest, or of all.

        The rate of the "rest" takes the derived fields from the last rate of the velocity, which has to be of the same
        `state`. `ahead` = 0.5 evaluates a
        law that depends on stress half a step further (by its own rate), for methods that take the rest's rate at the
        middle of the step once. Raises RuntimeError where the derived fields are of another state.
        """
        self.rates.rate(state, out, part, ahead)
        if part != "velocity":
            for attached in self.attached.values():
                attached.rate(state, out)

    def refresh(self, state: State) -> None:
        """Recompute the derived fields of a state (launches)."""
        self.rates.refresh(state)

    def combine(
        self,
        out: State,
        plain: list[tuple[float, State]],
        timed: list[tuple[float, State]] | None = None,
        squared: list[tuple[float, State]] | None = None,
        part: str = "all",
    ) -> None:
        """`out` = sum of c x over `plain` + dt times the sum of c k over `timed` + dt^2 c k of `squared`.

        Up to three states and rates, with one `squared` up to two rates; `out` may be one of them. `part` leaves the
        velocity ("rest") or all but it ("velocity") of `out` as it is.
        """
        timed, squared = timed or [], squared or []
        if not 1 <= len(plain) <= 3 or len(timed) + len(squared) > 3 or len(squared) > 1:
            counts = f"not {len(plain)}, {len(timed)} and {len(squared)}"
            raise ValueError(f"combine takes one to three states and up to three rates, one of them squared, {counts}")
        span = {"all": (0, len(out.buffer)), "velocity": (0, out.split), "rest": (out.split, len(out.buffer))}[part]
        terms = _buffers(plain), _buffers(timed), _buffers(squared)
        combine(self.space, self.clock, *terms, span, out.buffer)

    def drift(self, state: State, k: State, c: float, ahead: float = 0.0) -> None:
        """All of `state` but its velocity goes on by c dt: `rate` and `combine`, `ahead` as there, in one launch where only
        displacements do. What `k` holds of the rest after it is undefined."""
        rest = [field.name for field in state.layout.fields if not (field.leads or field.name not in state.start)]
        if rest != ["displacement"]:
            self.rate(state, k, "rest", ahead)
            self.combine(state, plain=[(1.0, state)], timed=[(c, k)], part="rest")
            return
        u, v = state.flat("displacement"), state.flat("velocity")
        combine(self.space, self.clock, [(1.0, u)], [(c, v)], [], (0, len(u)), u)

    def impose(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed velocities of a state, and the loads for the rates to come, at t + c dt."""
        self.boundary.impose(state, self.clock, c)
        self.loads.impose(self.clock, c)

    def constrain(self, state: State, c: float | tuple[float, float]) -> None:
        """`impose` on the state that the run continues from, in the middle of a step; its work is counted too."""
        self._works.constraints.before(state, self.clock)
        self.impose(state, c)
        self._works.constraints.after(state, self.clock)

    def accept(self, state: State) -> None:
        """Close the step: the stresses that the law allows, the prescribed values at t + dt, the work of the constraints,
        loads, body forces and viscosity."""
        self._closes(state)
        self.project(state)
        self.constrain(state, 1.0)
        self._works.loads.add(state, self.clock)
        self.force.add(state, self.clock)
        for load in self.loads.acting:
            load.advance(state)
        for part in self.attached.values():
            part.advance()

    def follow(self) -> bool:
        return self.rates.follow()

    def restored(self) -> None:
        self.rates.restored()
        for part in self.attached.values():
            part.restored()
        self.refresh(self.state)

    @property
    def ledger(self) -> tuple[Entry, ...]:
        drag = Entry("dissipated", lambda: self._works.loads.dragged)
        own = super().ledger
        external, rest = own[:3], own[3:]
        loads = (entry for load in self.loads.acting for entry in load.ledger)
        return (*external, drag, *rest, Entry("hourglass", self.held_energy), *loads)

    def held_energy(self) -> float:
        """Work done against forces that hold spurious modes so far, and energy of the stabilisation, nondimensional."""
        return self._works.loads.held + self.rates.held_energy(self.state)

    @property
    def neighbours(self) -> Pairs:
        """Pairs of each particle with those that it is joined to."""
        return self.rates.neighbours

    @property
    def breakable_weights(self) -> Array | None:
        """Weights of the `neighbours`, zero where a pair has broken; None where none can."""
        return next((part.weight for part in self.attached.values() if part.weight is not None), None)

    @property
    def started_from(self) -> Array:
        """Velocities that the work of drag in a step is measured from, (n,) vec, where there is drag.
        Whoever changes velocities between steps sets them too."""
        return self._works.loads.before

    @property
    def pairs(self) -> int:
        """Directed pairs of the right-hand sides."""
        return self.rates.pairs

    @property
    def point_volume(self) -> np.ndarray:
        return self.placement.point_volume

    @property
    def free_components(self) -> np.ndarray:
        """1 where a component of the velocity is free, 0 where it is prescribed, (n dim,)."""
        free = np.ones(self.count * self.space.dim)
        for (_, component), values in self.conditions.entries.items():
            free[[self.state.index("velocity", particle, component) for particle in values]] = 0.0
        return free

    @property
    def drags(self) -> bool:
        """Whether there are forces that depend on velocities, beside damping in proportion to mass."""
        return self.form.drags

    @property
    def viscous(self) -> bool:
        """The same, by the name that integrators know."""
        return self.form.drags

    @property
    def one_sided(self) -> bool:
        """Whether drag acts on approach alone."""
        return self.form.one_sided

    @property
    def damping_rate(self) -> float:
        """Rate of the damping in proportion to mass, nondimensional."""
        return float(self.force.struct.damping)

    @property
    def damped(self) -> bool:
        """Whether small motions are damped: by viscosity, or in proportion to mass."""
        return self.form.drags or self.force.parts.damped

    @property
    def evolves(self) -> bool:
        """Whether stress or deformation is integrated, and does not follow from the displacements."""
        return not self.form.total or self.form.moving

    @property
    def projects(self) -> bool:
        """Whether its law has a yield surface, so that `project` changes a state."""
        return self.constitutive.laws.project is not None

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed anywhere."""
        return self.conditions.moved

    @property
    def irregular(self) -> bool:
        """Whether its cells differ in size: by jitter or a map."""
        return self.lattice.irregular

    @property
    def bar_time(self) -> float:
        """The spacing over sqrt(E/rho), nondimensional: the time of the paper's Courant number."""
        speed = np.sqrt(self._host.youngs_modulus / self.constitutive.material.density) / self.scales.velocity
        return self.spacing / self.scales.length / float(self.space.scalar(speed))

    @property
    def frequency(self) -> float:
        """The largest frequency of the small motions, nondimensional."""
        return self.motions.frequency

    @property
    def growth(self) -> float:
        """The largest growth rate of a small motion that does not oscillate, nondimensional."""
        return self.motions.growth

    @property
    def modes(self) -> np.ndarray:
        """lambda of the small motions exp(lambda t), (k,) complex, nondimensional."""
        return self.motions.modes

    def largest(self, dt: float, factor: float) -> float:
        """The largest eigenvalue of dt^2 K + factor dt D of the small motions, an upper estimate; `dt` nondimensional."""
        return self.motions.largest(dt, factor)

    def forget_motions(self) -> None:
        """Forget the small motions: they are next found about the current state."""
        self.motions.forget()

    def courant(self, product: float) -> float:
        """The Courant number at which omega dt = `product` for the fastest mode."""
        if self.frequency == 0.0:
            return np.inf
        dt = product / self.frequency
        return dt * self.scales.time * self.constitutive.wave_speed / self.spacing

    def spectral_radius(self) -> float:
        """Largest frequency times the spacing over the wave speed: a Courant number C is omega dt = C times this."""
        return self.frequency * self.spacing / (self.constitutive.wave_speed * self.scales.time)

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, at the particles, (n, width), nondimensional."""
        values = self.state.read(name)
        return average(self._outwards, values) if self.points and self.state.counts[name] != self.count else values

    @cached_property
    def _outwards(self) -> Weights:
        return outward_weights(self.lattice, 1.2)

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional, J as frames have the deformation."""
        return self.density / self._volume_ratio(self.filtered)

    def sample(self, points: np.ndarray, name: str = "velocity") -> list[tuple[np.ndarray, np.ndarray]]:
        """Places and weights that a field is read with at each of `points` (m, dim) [m], linear-exact."""
        at_nodes = self.placement.at_nodes and self.state.counts.get(name, self.count) == self.count
        lattice = self.lattice
        grid, sources = lattice.comparable(points, lattice.nodes if at_nodes else lattice.cells)
        weights = spanning_weights(self.lattice, 1.6, (grid, sources), (grid, sources), np.ones(len(sources)))
        offsets, indices, values = (a.numpy() for a in (weights.pairs.offsets, weights.pairs.indices, weights.values))
        rows: list[tuple[np.ndarray, np.ndarray]] = [(indices[a:b], values[a:b]) for a, b in pairwise(offsets)]
        # A point that is a particle reads that particle.
        for n, (there, _) in enumerate(rows):
            on = there[np.linalg.norm(sources[there] - grid[n], axis=1) < 1e-6]
            if len(on):
                rows[n] = (on[:1], np.ones(1))
        return rows


class _Works:
    """External work of a one-set body: constraints and loads."""

    def __init__(self, system: OneSetSystem, holding: Array | None):
        space, mass, device = system.space, system.density * system.volume, system.device
        self.constraints = ConstraintWork(space, system.boundary, mass, device)
        self.loads = LoadWork(space, system.loads.values, system.state, system.loads.state, holding, mass, device)

    def start(self, state: State, clock: Clock) -> None:
        """Take the powers and impulses at the start of the run."""
        self.constraints.start(state, clock)
        self.loads.start(state, clock)

    @property
    def total(self) -> float:
        """Work of constraints and loads so far, nondimensional."""
        return self.constraints.total + self.loads.total
