"""The setup of a one-set body: its particles, points, loads and coefficients, before it has right-hand sides."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import warp as wp

from wsph.backend.algebra import clear_kernel
from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import Domain, Share, any_of
from wsph.backend.space import Array
from wsph.backend.state import Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.acting import ActingLoad
from wsph.boundary.loads.forces import LoadForces
from wsph.boundary.loads.regions import times_volume, volume_loads
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.periodic import Seam, refuse_parted, seam_between, seams_of
from wsph.boundary.walls import Wall
from wsph.constitutive.initial import initial_field
from wsph.errors import Fault, Refused, SceneError
from wsph.formulations.lagrangian.form import Form, coefficients_of
from wsph.formulations.layout import (
    deformation_field,
    deviation_field,
    displacement_field,
    drag_field,
    matter_fields,
    velocity_field,
)
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


def layout_of(host: Host, conditions: Conditions) -> Layout:
    """The fields of a one-set state."""
    laws, reference = host.constitutive.laws, host.traits.reference
    extra = [field for part in host.parts.values() if part.acts for field in part.fields(host)]
    if conditions.resisted and not any(field.name == "drag" for field in extra):
        extra.append(drag_field(host.space))
    return Layout.of(
        (
            velocity_field(host.space),
            *(field for field in extra if field.leads),
            *matter_fields(host.constitutive, at_points=True, derived=laws.total is not None),
            initial_field(host.constitutive, host.stressed),
            deformation_field(host.space, at_points=True, derived=reference),
            displacement_field(host.space),
            deviation_field(host.space, remembers(host)),
            *(field for field in extra if not field.leads),
        )
    )


@dataclass(frozen=True)
class Placement:
    """Where the particles of a body are, and the points that carry the stress: `position` (n, dim) [m], `volume` (n,) and
    `point_volume` (m,) nondimensional. `points`: these have places of their own. `share` and `point_share`: the part of
    those of the whole body that they are. `gradients`: those of the cells around a particle, nondimensional, where pairs
    share cells that differ."""

    points: bool
    at_nodes: bool
    position: np.ndarray
    volume: np.ndarray
    point_volume: np.ndarray
    share: Share
    point_share: Share
    gradients: NodalGradients | None = None

    @classmethod
    def of(cls, host: Host) -> "Placement":
        """The places of a body's particles and points."""
        body, unit, points = host.geometry, host.scales.length**host.space.dim, not host.traits.pairwise
        position = body.nodes if host.at_nodes else body.cells
        volume, split = (body.node_volume if host.at_nodes else body.cell_volume) / unit, body.split
        if host.edges and body.irregular:
            # Volumes averaged over blocks want the gradients of whole cells.
            mix = 1.0 if host.locks or host.flows else MIX
            try:
                places, before = body.places(host.scales.length), split.points.first
                found = nodal_gradients(places, host.lattice.corners, mix, before)
            except ValueError as error:
                raise Refused(f"body {host.name!r}: {error}") from error
            return cls(points, host.at_nodes, position, found.volume, found.volume, split.nodes, split.nodes, found)
        share = split.particles(at_nodes=host.at_nodes)
        own = (_over(body.cell_volume, unit), share, split.points) if points else (volume, share, share)
        return cls(points, host.at_nodes, position, volume, *own)

    @property
    def count(self) -> int:
        """Particles."""
        return len(self.position)


def _over(volume: np.ndarray, unit: float) -> np.ndarray:
    """Volumes of points (k,) over a unit; where they are one number for all, so are these."""
    return np.broadcast_to(volume[0] / unit, len(volume)) if volume.strides == (0,) else volume / unit


class Loads:
    """Loads on a body as forces on its particles, nondimensional: the sum of the prescribed ones, `vectors` (n,) vec, and of
    those that follow the state, `following` (n,) vec; those that depend on velocities stand behind them, (2 n,)."""

    def __init__(self, setup: Setup, conditions: Conditions, placement: Placement, arrays: Arrays):
        space, scales, clock = setup.space, setup.scales, setup.clock
        # Ghosts ask every face for its load.
        prescribed = [*conditions.loads, *conditions.inside]
        self._domain = setup.geometry.split.domain
        everywhere = any_of(self._domain, bool(prescribed)) or setup.scene.run.correction == "paper"
        self.vectors: Array = wp.zeros(placement.count if everywhere else 1, dtype=space.vec, device=setup.device)
        arrays.take("imposed", self.vectors, kept=True)
        area = scales.length ** (space.dim - 1)
        self.forces = LoadForces(
            space, prescribed, self.vectors, placement.position, scales.stress * area, scales.time, setup.device
        )
        self._clock = clock
        self.some = any_of(self._domain, self.count > 0)
        """Whether any particle of the whole body carries prescribed ones."""
        self.acting: list[ActingLoad] = []
        self.owners = [int(name.partition(".")[0]) for name, _, _ in conditions.acting]
        """The numbers of the boundaries that the acting ones are of."""
        material, (_, shear) = setup.constitutive.material, setup.constitutive.material.moduli()
        impedance = material.density * setup.constitutive.wave_speed, float(np.sqrt(shear * material.density))
        for name, load, faces in conditions.acting:
            scaled = replace(faces, area=faces.area / area, vector=faces.vector / area, impedance=impedance)
            self.acting.append(load.attach(scaled, space, scales, clock, arrays.part(name)))
        self.resisted = conditions.resisted
        """Whether some depend on velocities."""
        n = placement.count if self.acting else 1
        self.following: Array = arrays.zeros("following", (1 + self.resisted) * n, space.vec)
        self._rows = [cast(Array, self.following[row * n : (row + 1) * n]) for row in range(1 + self.resisted)]

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
        """Find the forces of the loads that follow a state (launches, where there are any). In a relaxation nothing resists:
        what creeps would look like what rests."""
        if self.acting:
            self._clock.launch(clear_kernel(self.following.dtype), len(self.following), [], [self.following])
        for load in self.acting:
            load.act(state, self._rows[0])
            if self.resisted and not self._clock.still:
                load.resist(state, self._rows[1])


def inside_loads(setup: Setup, placement: Placement) -> list[FaceLoad]:
    """Forces on the particles of regions, and of gravity that changes."""
    number, body, density = setup.scene.bodies.index(setup.body), setup.body, setup.constitutive.material.density
    spacing, unit = setup.geometry.spacing, setup.scales.length**setup.space.dim
    domain = setup.geometry.split.domain
    loads = volume_loads(setup.scene, number, body.body_force, placement.position, spacing, density, domain)
    if loads and setup.host.correction == "paper":
        text = 'run.correction = "paper" takes gravity that is a number alone, and no body_force: use the symmetric correction'
        raise Refused(f"body {body.name!r}: {text}")
    return list(times_volume(loads, placement.volume * unit))


def seam_of(setup: Setup, host: Host, conditions: Conditions, placement: Placement, arrays: Arrays) -> Seam:
    """The particles that are one where faces are periodic. Raises SceneError where the body, or what is prescribed beside
    them, cannot have them."""
    seams = seams_of([pairs for _, pairs in conditions.periodic])
    if seams:
        key = conditions.periodic[0][0]
        scene = setup.scene
        contact = [each for each in scene.contact if host.name in each.names]
        contact += [each for each in scene.tools if host.name in each.against]
        text = ""
        if host.breaks:
            text = "can break, and its cracks would end at the face: leave one of both out"
        elif not (host.corners or host.edges):
            text = (
                'has pairs of a kernel, which see nothing of the other face: use "stress-points" or "total-lagrangian", without'
                " run.support, run.kernel and parts that need a kernel's pairs"
            )
        elif contact:
            text = "is in contact, which does not reach through the face: leave one of both out"
        if text:
            raise SceneError("scene", [Fault(0, key, f"body {host.name!r} {text}")])
        of = conditions.entries, conditions.slides, placement.position
        refuse_parted(seams, *of, placement.share, host.geometry.split.domain, key)
    return seam_between(seams, placement.volume, placement.share, host.geometry.split.domain, host.space, arrays)


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
    def domain(self) -> Domain:
        """The part of the scene that this process has."""
        return self.setup.geometry.split.domain

    @property
    def moved(self) -> bool:
        """Whether a velocity other than zero is prescribed anywhere."""
        return any_of(self.domain, self.conditions.moved)

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
            self.loads.resisted,
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
        """Refuse particles whose neighbours, spanning `rank` (m,) directions, give no gradient. Of those that a process does
        not own it is to be enough; all that share the body look together."""
        host, isolated = self.host, np.flatnonzero(rank < self.host.space.dim)
        if count := int(self.domain.sum(np.array([len(isolated)]))[0]):
            first = self.domain.joined(self.placement.position[isolated[:1]])[0].tolist()
            raise Refused(
                f"{count} particles of body {host.name!r}, the first at {first} m, see"
                f" too few neighbours for a gradient: raise run.support (now {host.support:g} spacings)"
            )


def pair_warnings(made: RateSetup, blocks: bool) -> tuple[str, ...]:
    """What whoever runs a body of particles that are their own points should know of its pairs. `blocks`: its volumes are
    averaged over blocks."""
    host, conditions = made.host, made.conditions
    found: list[str] = []
    faces = bool(conditions.entries) or bool(conditions.loads) or bool(made.loads.acting)
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
