"""The setup of a one-set body: its particles, points, loads and coefficients, before it has right-hand sides."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from dataclasses import dataclass, replace

import numpy as np
import warp as wp

from wsph.backend.algebra import clear_kernel
from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.space import Array
from wsph.backend.state import Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.acting import ActingLoad
from wsph.boundary.loads.forces import LoadForces
from wsph.boundary.walls import Wall
from wsph.errors import Refused
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.setup import Setup
from wsph.geometry.gradients import MIX, NodalGradients, nodal_gradients
from wsph.parts.body_force import BodyForce
from wsph.parts.part import LOCKING, Host
from wsph.parts.residual import stabilisation
from wsph.parts.terms import Coefficients


def remembers(host: Host) -> bool:
    """Whether particles remember the motion that their gradients do not see: there is no reference to measure it from."""
    return not host.traits.reference and stabilisation(host) > 0.0


def is_stabilised(host: Host) -> bool:
    """Whether there is a stiffness against the misfit of a linear field to the displacements."""
    return host.traits.reference and stabilisation(host) > 0.0


@dataclass(frozen=True)
class Placement:
    """Where the particles of a body are, and the points that carry the stress: `position` (n, dim) [m], `volume` (n,) and
    `point_volume` (m,) nondimensional. `points`: these have places of their own. `gradients`: those of the cells around a
    particle, nondimensional, where pairs share cells that differ."""

    points: bool
    at_nodes: bool
    position: np.ndarray
    volume: np.ndarray
    point_volume: np.ndarray
    gradients: NodalGradients | None = None

    @classmethod
    def of(cls, host: Host) -> "Placement":
        """The places of a body's particles and points."""
        body, unit, points = host.geometry, host.scales.length**host.space.dim, not host.traits.pairwise
        position = body.nodes if host.at_nodes else body.cells
        volume = (body.node_volume if host.at_nodes else body.cell_volume) / unit
        if host.edges and body.irregular:
            # Volumes averaged over blocks want the gradients of whole cells.
            mix = 1.0 if host.locks or host.flows else MIX
            try:
                found = nodal_gradients(body.places(host.scales.length), host.lattice.corners, mix)
            except ValueError as error:
                raise Refused(f"body {host.name!r}: {error}") from error
            return cls(points, host.at_nodes, position, found.volume, found.volume, found)
        return cls(points, host.at_nodes, position, volume, body.cell_volume / unit if points else volume)

    @property
    def count(self) -> int:
        """Particles."""
        return len(self.position)


class Loads:
    """Loads on a body as forces on its particles, nondimensional: the sum of the prescribed ones, `vectors` (n,) vec, and of
    those that follow the state, `following` (n,) vec."""

    def __init__(self, setup: Setup, conditions: Conditions, placement: Placement, arrays: Arrays):
        space, scales, clock = setup.space, setup.scales, setup.clock
        # Ghosts ask every face for its load.
        everywhere = bool(conditions.loads) or setup.scene.run.correction == "paper"
        self.vectors: Array = wp.zeros(placement.count if everywhere else 1, dtype=space.vec, device=setup.device)
        arrays.take("imposed", self.vectors, kept=True)
        area = scales.length ** (space.dim - 1)
        self.forces = LoadForces(
            space, conditions.loads, self.vectors, placement.position, scales.stress * area, scales.time, setup.device
        )
        self._clock = clock
        self.acting: list[ActingLoad] = []
        for name, load, faces in conditions.acting:
            scaled = replace(faces, area=faces.area / area, vector=faces.vector / area)
            self.acting.append(load.attach(scaled, space, scales, clock, arrays.part(name)))
        self.following = arrays.zeros("following", placement.count if self.acting else 1, space.vec)

    @property
    def count(self) -> int:
        """How many particles carry prescribed ones."""
        return len(self.forces.loaded)

    def impose(self, clock: Clock, c: float | tuple[float, float]) -> None:
        """Set the prescribed loads of t + c dt (a launch, where they change in time)."""
        self.forces.impose(clock, c)
        for load in self.acting:
            load.impose(clock, c)

    def follow(self, state: State) -> None:
        """Find the forces of the loads that follow a state (launches, where there are any)."""
        if self.acting:
            self._clock.launch(clear_kernel(self.following.dtype), len(self.following), [], [self.following])
        for load in self.acting:
            load.act(state, self.following)


@dataclass(frozen=True)
class RateSetup:
    """The input of right-hand sides: the body's setup, its particles and points, its states and the forces on them."""

    setup: Setup
    host: Host
    placement: Placement
    layout: Layout
    conditions: Conditions
    loads: Loads
    force: BodyForce
    arrays: Arrays
    walls: tuple[Wall, ...] = ()

    @property
    def stabilisation(self) -> float:
        """Stiffness against the misfit of a linear field to the displacements, nondimensional."""
        return stabilisation(self.host) * self.host.youngs_modulus / self.host.scales.stress

    @property
    def density(self) -> float:
        """Nondimensional."""
        return self.host.constitutive.density

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed anywhere."""
        return self.conditions.moved

    def form(self, *, loaded: bool) -> Form:
        """The form of the body, which decides the source of its kernels."""
        host, total = self.host, self.host.constitutive.laws.total is not None
        parts = [part for part in host.parts.values() if part.acts]
        pairwise = host.traits.pairwise
        pair_terms = [term for part in parts if pairwise and (term := part.pair_term(host)) is not None]
        stress_terms = [term for part in parts if (term := part.stress_term(host)) is not None]
        rate_terms = [term for part in parts if not pairwise and (term := part.rate_term(host)) is not None]
        responses = [answer for part in parts if (answer := part.response(host)) is not None]
        if max(len(stress_terms), len(rate_terms), len(responses)) > 1 or len(pair_terms) > 3:
            raise Refused(
                f"body {host.name!r}: of its parts {', '.join(host.parts)} too many act at the same place: leave one out"
            )
        stabilised, flow = is_stabilised(host), host.constitutive.flow
        return Form(
            self.placement.points,
            total,
            stabilised,
            loaded,
            host.correction == "paper",
            host.smoothing,
            tuple(pair_terms),
            next(iter(stress_terms), None),
            next(iter(rate_terms), None),
            next(iter(responses), None),
            host.breaks,
            not host.traits.reference,
            bool(self.loads.acting),
            host.edges and not host.geometry.irregular,
            host.edges and not stress_terms and (host.locks or host.flows),
            host.geometry.irregular and (host.edges or host.corners),
            flow[0] if flow is not None and stabilised and not responses else -1,
            remembers(host),
            bool(self.walls),
        )

    def coefficients(self, form: Form) -> Coefficients:
        """The numbers that terms take, as kernels take them."""
        host, real = self.host, self.host.space.scalar
        numbers: Coefficients = coefficients_of(host.space, form)()
        # The paper's own c, not the one of the stress state: sqrt(E/rho).
        numbers.speed = real(np.sqrt(host.youngs_modulus / host.constitutive.material.density) / host.scales.velocity)
        numbers.h = real(host.smoothing_length / host.scales.length)
        flow = host.constitutive.flow
        given = {"yields": flow[1]} if flow is not None else {}
        given |= {name: value for part in host.parts.values() for name, value in part.coefficients(host).items()}
        for name in form.numbers:
            setattr(numbers, name, real(given[name]))
        return numbers

    def refuse_isolated(self, rank: np.ndarray) -> None:
        """Refuse particles whose neighbours, spanning `rank` (m,) directions, give no gradient."""
        host, isolated = self.host, np.flatnonzero(rank < self.host.space.dim)
        if len(isolated):
            raise Refused(
                f"{len(isolated)} particles of body {host.name!r}, the first at {self.placement.position[isolated[0]].tolist()} m, see"
                f" too few neighbours for a gradient: raise run.support (now {host.support:g} spacings)"
            )


def pair_warnings(made: RateSetup, blocks: bool) -> tuple[str, ...]:
    """What whoever runs a body of particles that are their own points should know of its pairs. `blocks`: its volumes are
    averaged over blocks."""
    host, conditions = made.host, made.conditions
    found: list[str] = []
    faces = bool(conditions.entries) or made.loads.count > 0 or bool(made.loads.acting)
    if host.traits.edges and faces and not host.edges and not host.breaks and host.correction != "paper":
        found.append(
            f"body {host.name!r}: with pairs of a kernel stress is 20 to 70 % off beside held and loaded faces, however fine the"
            " lattice. Pairs along the edges of the cells are exact there: leave out run.support, run.kernel, placement, and what"
            ' else asks for a kernel\'s pairs (pinball contact, cracks, damping of all pairs), or use "stress-points"'
        )
    if host.traits.pairs_follow and host.geometry.irregular:
        found.append(
            f"body {host.name!r}: with pairs of a kernel that follow the motion stress is 5 to 50 % off where a lattice is"
            ' jittered; leave out jitter, or use "total-lagrangian" or "stress-points"'
        )
    constrained = host.traits.edges or host.traits.pairs_follow
    return (*found, *(_locking_warnings(host) if constrained and not blocks else ()))


def _locking_warnings(host: Host) -> tuple[str, ...]:
    """The warning of a body whose particles each hold their volume, where that locks it; none where it does not."""
    if not host.locks:
        return ()
    return (
        f"body {host.name!r}: at a Poisson's ratio of {LOCKING:g} and above a constraint of the volume at every particle makes it"
        ' too stiff, by 7 to 41 % in bending; use "stress-points", or "total-lagrangian" with a total law and pairs along edges',
    )
