"""A body as one-set integrators see it: `rate`, `combine`, `drift`, `impose`, `constrain`, `accept` over one flat state.

The right-hand sides are those of a form (`wsph.formulations.lagrangian`, `wsph.formulations.updated`). Time steps are
limited by the body's small motions (`wsph.stability.small_motions`).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable
from functools import cached_property, partial
from typing import cast

import numpy as np

from wsph.backend.algebra import combine
from wsph.backend.arrays import host as on_host
from wsph.backend.domain import any_of
from wsph.backend.space import Array
from wsph.backend.state import Derived, Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.reactions import Terms
from wsph.boundary.loads.regions import gravity_of
from wsph.boundary.natural import layer_conditions, node_conditions
from wsph.boundary.walls import Wall
from wsph.formulations.one_set_rates import Rates
from wsph.formulations.one_set_setup import (
    Loads,
    Placement,
    RateSetup,
    inside_loads,
    layout_of,
    pair_warnings,
    seam_of,
)
from wsph.formulations.one_set_works import Prescribed, pieces_of
from wsph.formulations.setup import Setup
from wsph.formulations.system import System
from wsph.parts.body_force import BodyForce
from wsph.parts.body_force_work import WayWork
from wsph.parts.part import Attached, Host
from wsph.protocols import Entry
from wsph.ranks.blocks import own_sum
from wsph.ranks.kept import Piece
from wsph.sph.around import Around
from wsph.sph.averages import OUTWARDS, Averages, average, bounded_average, outward_weights
from wsph.sph.pairs import Pairs
from wsph.sph.second_order import between
from wsph.sph.weights import Weights
from wsph.stability.krylov import Moving
from wsph.stability.small_motions import SmallMotions


def _buffers(terms: list[tuple[float, State]]) -> list[tuple[float, Array]]:
    return [(c, state.buffer) for c, state in terms]


class OneSetSystem(System):
    """A body as one-set integrators see it."""

    moved: bool
    held: bool
    """Whether a velocity is prescribed anywhere, zero included; `moved`: other than zero."""
    _around: Around | None = None
    walls: tuple[Wall, ...] = ()
    """Faces behind which its particles have images."""

    def __init__(self, setup: Setup, rates: Callable[[RateSetup, State], Rates], shared: int = 0):
        """`shared`: numbers that its rates keep in the buffer of the derived fields."""
        super().__init__(setup)
        host, space = setup.host, setup.space
        for part in host.parts.values():
            part.refuse(host)
        self.placement = Placement.of(host)
        self.share, self.point_share = self.placement.share, self.placement.point_share
        self.points, self.position, self.volume = self.placement.points, self.placement.position, self.placement.volume
        self.conditions = self._find_conditions(setup)
        self.conditions.inside = inside_loads(setup, self.placement)
        self.layout = self._find_layout(host)
        self._derived: Derived | None = None
        self._accepted: State | None = None
        self._new: list[State] = []
        if any(field.derived for field in self.layout.fields):
            self._derived = Derived(space, self.layout, len(self.point_volume), self.device, shared)
            self.arrays.take("derived", self._derived.buffer)
        self.state = self._make(self.count, self.layout, len(self.point_volume), self._derived, own=True)
        self.loads = Loads(setup, self.conditions, self.placement, self.arrays.part("loads"))
        self.force = BodyForce(gravity_of(setup.scene)[0], setup.body.damping, space, setup.scales, self.density)
        self.force_work = WayWork(self.force, self.volume, self.state, self.device, self.share, self.domain)
        made = RateSetup(
            setup, host, self.placement, self.layout, self.conditions, self.loads, self.force, self.arrays, self.walls
        )
        self.moved, self.held = made.moved, any_of(self.domain, bool(self.conditions.entries or self.conditions.slides))
        self._halo, self.rates = self.domain.halo(self.share), rates(made, self.state)
        self.form, self.stabilisation, self._host = self.rates.form, made.stabilisation, host
        self.response, self.breaks, self.total = self.form.response, self.form.breaks, self.form.total
        self.attached = self._attach(host)
        self.warnings = pair_warnings(made, self.form.blocks)
        self.work = self._prescribed = Prescribed(
            self.conditions,
            self.loads,
            space,
            setup.scales,
            self.state,
            self.position,
            self.density * self.volume,
            self.rates.holding if self.form.holds else None,
            self.arrays,
            self.share,
            self.domain,
        )
        self.boundary = self._prescribed.values
        self._seam = seam_of(setup, host, self.conditions, self.placement, self.arrays.part("seam"))
        self.motions = SmallMotions(cast(Moving, self))
        self.arrays.part("force").adopt(self.force_work, self.force_work.kept())

    def _find_conditions(self, setup: Setup) -> Conditions:
        """What is prescribed to its particles."""
        if self.placement.at_nodes:
            return node_conditions(setup.scene, self.name, self.geometry)
        return layer_conditions(setup.scene, self.name, self.geometry)

    def _find_layout(self, host: Host) -> Layout:
        """The fields of its states."""
        return layout_of(host, self.conditions)

    def _attach(self, host: Host) -> dict[str, Attached]:
        """The parts of the body on the device."""
        seen = self.rates.seen
        found: dict[str, Attached] = {}
        if seen is not None:
            for key, part in host.parts.items():
                made = part.attach(host, seen, self.state, self.clock, self.arrays.part(key)) if part.acts else None
                if made is not None:
                    found[key] = made
        found |= self.rates.own_parts(self.state, self.arrays)
        self.rates.attach(list(found.values()))
        return found

    def new(self) -> State:
        """A state, zero but for the internals' initial values."""
        self._new.append(self._make(self.count, self.layout, len(self.point_volume), self._derived))
        return self._new[-1]

    def spares(self, count: int) -> list[State]:
        """So many states to compute with for a moment: those of `new` that nothing has been put into yet, which have to be
        zero again after it, then temporary ones."""
        unused = [state for state in self._new if not on_host(state.buffer).any()]
        return [*unused[:count], *(self.temporary() for _ in range(count - len(unused)))]

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
        if part != "rest":
            self.evaluations += 1
            if self.domain.size > 1:
                self.clock.host(partial(self._halo.update, out.struct.velocity))
            self._seam.join(out, self.clock)
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
        if part != "velocity":
            self.allowed = None
        if part != "rest":
            self._prescribed.combined(out, plain, self.clock)
        for each in self._spans(out, span):
            combine(self.space, self.clock, _buffers(plain), _buffers(timed), _buffers(squared), each, out.buffer)

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
        self._set(state, c, counted=False)

    def constrain(self, state: State, c: float | tuple[float, float]) -> None:
        """`impose` on the state that the run continues from, in the middle of a step; its work is counted too. What a
        displacement or an acceleration prescribes at c = 0.5 leads over all of the step: the mean velocity in it."""
        self._set(state, c, counted=True)

    def _set(self, state: State, c: float | tuple[float, float], *, counted: bool) -> None:
        """Set what is prescribed; `counted`: with its work."""
        self._prescribed.impose(state, self.clock, self.clock.part(c), counted=counted)

    def accept(self, state: State) -> None:
        """Close the step: the stresses that the law allows, the prescribed values at t + dt."""
        self._closes(state)
        if self.allowed is not state:
            self.project(state)
        self.constrain(state, 1.0)
        self.boundary.motions.lead(state, self.clock)
        self._accepted = state
        for part in self.attached.values():
            part.advance()

    def begin(self) -> None:
        self._seam.join(self.state, self.clock)
        super().begin()

    def watch(self) -> None:
        self._prescribed.watch()

    def watched(self) -> bool:
        return self._prescribed.watched()

    def kinetic(self, state: State) -> float:
        """sum m |v|^2/2 over the free components of a state's velocity, nondimensional (a copy)."""
        v = state.read("velocity") * self.free_components.reshape(-1, self.space.dim)
        return 0.5 * self.density * own_sum(self.volume * (v**2).sum(1), self.share, self.domain)

    def close(self) -> None:
        state = self._accepted or self.state
        self._prescribed.close(state, self.clock)
        self.force_work.add(state, self.clock)

    def follow(self) -> bool:
        return self.rates.follow()

    def pieces(self) -> dict[str, list[Piece]]:
        return pieces_of(self.arrays.kept, self.state, self._prescribed, self.placement, self.domain, self.attached)

    def placed(self) -> None:
        self.rates.placed()
        self.refresh(self.state)
        for part in self.attached.values():
            part.advance()

    def restored(self) -> None:
        self.rates.restored()
        for part in self.attached.values():
            part.restored()
        self.refresh(self.state)

    def does(self, boundary: int) -> list[Terms]:
        return self._prescribed.numbers(boundary)

    @property
    def ledger(self) -> tuple[Entry, ...]:
        drag = Entry("dissipated", lambda: self._prescribed.drag.dragged)
        own = super().ledger
        external, rest = own[:3], own[3:]
        loads = (entry for load in self.loads.acting for entry in load.ledger)
        return (*external, drag, *rest, Entry("hourglass", self.held_energy), *loads)

    def held_energy(self) -> float:
        """Work done against forces that hold spurious modes so far, and energy of the stabilisation, nondimensional."""
        return self._prescribed.drag.held + self.rates.held_energy(self.state)

    @property
    def joined(self) -> bool:
        """Whether its particles are the corners of its cells: with points of their own, and with pairs along the edges."""
        return self.placement.at_nodes and (self.points or self._host.edges)

    @property
    def neighbours(self) -> Pairs:
        """Pairs of each particle with those that it is joined to."""
        return self.rates.neighbours

    @property
    def breakable_weights(self) -> Array | None:
        """Weights of the `neighbours`, zero where a pair has broken; None where none can."""
        return next((part.weight for part in self.attached.values() if part.weight is not None), None)

    @property
    def pairs(self) -> int:
        """Directed pairs of the right-hand sides."""
        return self.rates.pairs

    @property
    def point_volume(self) -> np.ndarray:
        return self.placement.point_volume

    @cached_property
    def free_components(self) -> np.ndarray:
        """Whether a component of the velocity is free in some step of the run, or prescribed, (n dim,) bool."""
        return self.conditions.free(self.count, self.space.dim)

    def project_free(self, velocity: np.ndarray, time: float | None = None) -> np.ndarray:
        """Velocities (n dim,), times the roots of masses, without what is prescribed of them, in the whole run or at a
        `time` [s], by components and along faces' own normals, and without what parts particles that are one. They may be
        overwritten."""
        velocity *= self.free_components if time is None else self.conditions.free(self.count, self.space.dim, time)
        return self._seam.project(self._prescribed.slides.project(velocity))

    @property
    def symmetric(self) -> bool:
        """Whether its stiffness is that of an energy: of no load that follows, no pairs that do, and no force between
        particles that takes the gradients of both."""
        form = self.form
        moved = form.moving or form.followed or form.paper
        return form.total and not (moved or form.holds or form.stress_term is not None)

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
    def resisted(self) -> bool:
        """Whether there are loads that depend on velocities, whatever the motion is."""
        return self.form.resisted

    @property
    def damping_rate(self) -> float:
        """Rate of the damping in proportion to mass, nondimensional."""
        return self.force.rate

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
    def irregular(self) -> bool:
        """Whether its cells differ."""
        return self.geometry.irregular

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
        if not self._apart(name):
            return values
        averaged = bounded_average if self.state.bounded(name) else average
        if self.domain.size > 1:
            self._around = self._around or Around(self.geometry, OUTWARDS)
        return averaged(self._outwards, values) if self._around is None else self._around.averaged(values, averaged)

    @cached_property
    def _outwards(self) -> Weights:
        return outward_weights(self.geometry, OUTWARDS)

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional, J as frames have the deformation."""
        return self.density / self._volume_ratio(self.filtered)

    def _apart(self, name: str) -> bool:
        """Whether a field stands at points that are no particles."""
        return self.points and self.state.counts[name] != self.count

    def at_particles(self, particles: np.ndarray, name: str) -> list[Averages]:
        if not self._apart(name):
            return super().at_particles(particles, name)
        return [Averages.of(self._outwards).only(particles)] * self.state.widths[name]

    def _between(self, points: np.ndarray, name: str) -> Averages:
        return between(self.geometry, points, self.placement.at_nodes and not self._apart(name))
