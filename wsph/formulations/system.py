"""The base of all systems of a body: its particles, its states, its prescribed values."""

# pyright: strict
# pyright: reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wsph.backend.arrays import Arrays
from wsph.backend.clock import Clock
from wsph.backend.domain import Domain, Share
from wsph.backend.state import Derived, Layout, State
from wsph.boundary.loads.reactions import Terms, reaction
from wsph.boundary.values import BoundaryValues
from wsph.constitutive.constitutive import project_kernel
from wsph.formulations.setup import Setup
from wsph.geometry.lattice import Lattice, on_grid
from wsph.parts.body_force import BodyForce
from wsph.parts.body_force_work import ForceWork
from wsph.parts.part import Attached
from wsph.parts.terms import Response
from wsph.protocols import Entry
from wsph.ranks.kept import Piece
from wsph.ranks.slabs import Slab
from wsph.reporting import Reported
from wsph.sph.averages import Averages

HERE = 1e-6
"""Distance from a particle at which a point is that particle [cells]."""


class BodyWork(Protocol):
    """The external work on a body."""

    @property
    def total(self) -> float:
        """The work so far, nondimensional."""
        ...

    def start(self, state: State, clock: Clock) -> None:
        """Take what is there at the start of the run."""
        ...


@dataclass(frozen=True)
class Segmented:
    """Memory of a body that goes by the segments of `width` cells that its lines are cut into [bytes]: of each of cells,
    `chunk` and `cells`, and of nodes, `nodes`. Chunks share the memory of fields that take `fields` a cell; there is one
    more of them, and `spare` behind it. `inner`: what is spared for each cell with all of its neighbours, and for each node
    with all of its cells, where segments of these are no shorter than `shortest` in the mean."""

    width: int
    chunk: int
    cells: int
    nodes: int
    fields: int
    spare: int
    inner: int = 0
    shortest: float = 0.0

    def bytes(self, cells: float, inner: int, segments: tuple[int, int]) -> float:
        """That memory, of so many cells, of cells and nodes that are `inner`, and segments of cells and of nodes; where
        inner ones spare something segments are theirs."""
        if inner < self.shortest * sum(segments):
            inner, segments = 0, (0, 0)
        chunks = 1 + max(segments[0], -(-int(self.fields * cells) // max(self.chunk, 1)))
        shared = self.chunk * chunks + self.spare - self.inner * inner
        return shared + self.cells * segments[0] + self.nodes * segments[1]


@dataclass(frozen=True)
class Sight:
    """What a process works on of a body whose pairs follow the motion: the particles whose stress it finds, and all that it
    lets move; and memory of the pairs of the former, and of those of all [bytes]."""

    stressed: int
    moved: int
    listed: int
    every: int


class System:
    """A body as integrators see it; the systems of one and of two sets add their rates.

    `position` (n, dim) [m] of the particles that carry the state in the reference configuration, `spacing` [m], `volume`
    (n,) and `density` nondimensional, `state`, `boundary` and `work` (external work so far).
    """

    position: np.ndarray
    volume: np.ndarray
    share: Share
    """The part of the particles of the whole body that it has."""
    point_share: Share
    """The part of the points of the whole body that carry the stress."""
    state: State
    boundary: BoundaryValues
    work: BodyWork
    force: BodyForce
    force_work: ForceWork
    response: Response | None = None
    """The answer of a point in place of its law, or None."""
    allowed: State | None = None
    """The state whose stresses were brought back last, while none has been changed since."""
    evaluations = 0
    """Rates of velocities asked for so far."""
    breaks = False
    """Whether the body can break."""
    total = False
    """Whether its stress is that which the total law gives of the deformation; otherwise it is integrated from rates."""
    regular = 0.0
    """The share of its rows that follow from its lattice, and need no list of pairs."""
    listed = ""
    """What it has lists of pairs for, in words; empty where it needs none."""
    segmented: Segmented | None = None
    """Memory that goes by the segments of its lines, or None."""
    joined = False
    """Whether its particles are the corners of its cells."""
    attached: Mapping[str, Attached] = {}
    """The parts of the body on the device, by their keys."""
    warnings: tuple[str, ...] = ()
    """What whoever runs it should know of this form on this body."""
    sections: tuple[Reported, ...] = ()
    """Planes through the body whose forces people read off."""
    _counts: Mapping[str, int] = {}
    """Places of the fields of a state whose number of places is their own."""

    def __init__(self, setup: Setup):
        self.name, self.formulation, self.traits = setup.body.name, setup.formulation.name, setup.traits
        self.space, self.geometry, self.constitutive = setup.space, setup.geometry, setup.constitutive
        self.domain: Domain = setup.geometry.split.domain
        self.scales, self.clock, self.device = setup.scales, setup.clock, setup.device
        self.spacing, self.density = setup.geometry.spacing, setup.constitutive.density
        self.arrays, self._boundaries = Arrays(setup.device), setup.boundaries
        self.accepted: tuple[State, int] | None = None
        """The state that was last accepted, and how many launches of the step came before, of those that are listed."""
        self._made = 0

    def _closes(self, state: State) -> None:
        """Note that the step of `state` is closed now."""
        self.accepted = state, self.clock.listed

    @property
    def lattice(self) -> Lattice:
        """Its geometry, of a body that the lines of a grid cut."""
        return on_grid(self.geometry)

    def follow(self) -> bool:
        """Before a step: update pairs that follow the motion; returns whether the inputs of launches changed."""
        return False

    def begin(self) -> None:
        """Take the velocities at the start of the run, with which what is accelerated goes on."""
        self.boundary.motions.begin(self.state)

    def start_works(self) -> None:
        """Note the powers of the current state, as those at the start of the run."""
        self.work.start(self.state, self.clock)
        self.force_work.start(self.state, self.clock)

    def watch(self) -> None:
        """Until `watched` steps are listed, to find out what reactions have to take account of."""

    def watched(self) -> bool:
        """Have it taken account of; whether there is anything."""
        return False

    def close(self) -> None:
        """Close a step, after all that acts on the body: its works, with the velocities at the end (launches)."""
        raise NotImplementedError

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """Impose prescribed values on the state that the run continues from; stresses in the axes of each face."""
        self.impose(state, c)

    @property
    def point_volume(self) -> np.ndarray:
        """Volumes of the points that carry the stress, (m,), nondimensional: the particles, unless it has places of its
        own."""
        return self.volume

    def refresh(self, state: State) -> None:
        """Recompute the derived fields of a state, where it has any (launches)."""

    @property
    def reported(self) -> tuple[Reported, ...]:
        """What of the body people read numbers off."""
        does = {name: self.does(k) for k, name in self._boundaries.items()}
        held = (reaction(name, self.space.dim, parts, self.gather) for name, parts in does.items() if parts)
        return (*held, *self.sections)

    def does(self, boundary: int) -> list[Terms]:
        """What the boundary of a number does to the body; nothing where that cannot be told."""
        return []

    def gather(self) -> None:
        """Bring what boundaries do up to date, where steps do not (launches)."""

    @property
    def ledger(self) -> tuple[Entry, ...]:
        """Entries of the energy ledger beside the sums over the state, in the order in which they are added up."""
        force = (
            Entry("external_work", lambda: self.work.total),
            Entry("external_work", lambda: self.force_work.gravity),
            Entry("dissipated", lambda: self.force_work.damped),
        )
        return (*force, *(entry for part in self.attached.values() for entry in part.ledger))

    def fracture(self) -> dict[str, float]:
        """Figures of the fracture by name, energies nondimensional; empty where the body cannot break."""
        return {name: value for part in self.attached.values() for name, value in part.fracture().items()}

    @property
    def count(self) -> int:
        """Particles that carry the state."""
        return len(self.position)

    def _make(
        self, n: int, layout: Layout, points: int | None = None, derived: Derived | None = None, own: bool = False
    ) -> State:
        """A state of `n` places, zero but for the internals' initial values; a trial of steps leaves no trace in it, unless
        it is the body's `own`."""
        state = State(self.space, n, layout, self.device, points, derived, self._counts)
        self._initial_internals(state)

        def clear() -> None:
            state.buffer.zero_()
            self._initial_internals(state)

        self.arrays.take(f"state{self._made}", state.buffer, kept=True, reset=None if own else clear)
        self._made += 1
        return state

    def _initial_internals(self, state: State) -> None:
        if self.constitutive.internals:
            values = list(self.constitutive.internals.values())
            state.write("internals", np.tile(values, (state.counts["internals"], 1)))

    def pieces(self) -> dict[str, list[Piece]]:
        """Where its kept arrays stand in those of all processes that share the body, by their names."""
        raise NotImplementedError

    def placed(self) -> None:
        """Recompute whatever depends on where particles are, after a state has been put in from elsewhere."""

    def restored(self) -> None:
        """Recompute whatever depends on the kept arrays, after a checkpoint has put them back."""

    def impose(self, state: State, c: float | tuple[float, float]) -> None:
        """Set the prescribed values in a state at t + c dt; c = (0., 1.) means the mean of both ends of the step."""
        self.boundary.impose(state, self.clock, c)

    def project(self, state: State) -> None:
        """Bring the stresses of a state back to where the law allows them (a launch, where the law has a yield surface)."""
        laws = self.constitutive.laws
        if laws.project is not None:
            self.allowed = state
            kernel, rows = project_kernel(self.space, laws, state.layout), self._stressed(state)
            inputs = [self.constitutive.params]
            self.clock.launch(kernel, rows.stop - rows.start, inputs, [state.struct], rows.start)

    def _stressed(self, state: State) -> slice:
        """The points whose stress steps find."""
        return slice(0, state.counts["stress"])

    def _spans(self, state: State, span: tuple[int, int]) -> Iterable[tuple[int, int]]:
        """What steps change of the entries of a state from one up to another."""
        return (span,)

    @property
    def told(self) -> int:
        """Numbers that a process is told of a copy in a right-hand side."""
        return self.space.dim

    def sight(self, own: slice, right: slice) -> Sight | None:
        """What a process would work on that owns a range of the particles, and has the states of another right, of a body
        that is whole here; None where that is what it holds."""
        return None

    def holding(self, slab: Slab) -> Slab:
        """A slab of the body with all that a process would hold which has it."""
        return slab

    def bring(self) -> None:
        """Bring what other processes own up to date, of particles that steps leave behind."""

    def current_position(self) -> np.ndarray:
        """Where the particles are, (n, dim) [m]: the reference configuration where nothing follows their displacement."""
        if "displacement" not in self.state.layout:
            return self.position
        return self.position + self.filtered("displacement") * self.scales.length

    def fault(self) -> str:
        """The reason, with the way out, for which the state is one that the formulation cannot go on from; empty where it is
        none. Asked on the host, when energies are."""
        return ""

    def doubt(self) -> str:
        """What makes the state at the end of a run a wrong answer, in words with the way out; empty where nothing does."""
        return ""

    def filtered(self, name: str) -> np.ndarray:
        """A field as frames carry it, (n, width), nondimensional."""
        return self.state.read(name)

    def current_density(self) -> np.ndarray:
        """rho_0/J of every particle, (n,), nondimensional."""
        return self.density / self._volume_ratio(self.state.read)

    def _volume_ratio(self, read: Callable[[str], np.ndarray]) -> np.ndarray:
        """J of the particles, (n,), of the deformation and the thinning of free normals that `read` gives there."""
        F = np.eye(self.space.dim) + read("deformation").reshape(-1, self.space.dim, self.space.dim)
        ratio: np.ndarray = np.linalg.det(F)
        thinning = self.constitutive.laws.kept.thinning
        return ratio * np.exp(read("internals")[:, thinning]) if thinning >= 0 else ratio

    def at_particles(self, particles: np.ndarray, name: str) -> list[Averages]:
        """How frames read the components of a field at `particles` (m,): each with places and weights of its own."""
        return [Averages.themselves(particles)] * self.state.widths[name]

    def sample(self, points: np.ndarray, name: str) -> list[Averages]:
        """How to read the components of a field at `points` (m, dim) [m]: at a particle as frames do. Raises ValueError for
        a point with two values, on a crack."""
        grid, sources = self.geometry.comparable(points, self.position)
        near = [np.flatnonzero(np.linalg.norm(sources - point, axis=1) < HERE) for point in grid]
        if several := [k for k, there in enumerate(near) if len(there) > 1]:
            raise ValueError(f"{points[several[0]].tolist()} is on a crack, with a value on either side")
        on = np.array([k for k, there in enumerate(near) if len(there)], int)
        particles = np.array([near[k][0] for k in on], int)
        # What is a particle needs no neighbours.
        average = self._between(points, name) if len(on) < len(points) else Averages.themselves(particles)
        return [average.but(on, there) for there in self.at_particles(particles, name)]

    def _between(self, points: np.ndarray, name: str) -> Averages:
        """How to read a field at `points` (m, dim) [m] that are no particles."""
        raise NotImplementedError

    @property
    def pairs(self) -> int:
        """Directed pairs of its operators."""
        raise NotImplementedError

    @property
    def frequency(self) -> float:
        """The largest frequency of the small motions, nondimensional, where the formulation `measures`."""
        raise NotImplementedError

    @property
    def growth(self) -> float:
        """The largest growth rate of a small motion that does not oscillate, nondimensional, where the formulation
        `measures`."""
        raise NotImplementedError

    def forget_motions(self) -> None:
        """The next question finds the small motions about the current state."""

    @property
    def nbytes(self) -> int:
        """Device memory of the body [bytes]: all that is registered, the integrator's states too."""
        return self.arrays.nbytes

    @property
    def host_bytes(self) -> int:
        """Memory of the lattice and of all other arrays on the host [bytes], shared ones counted once."""
        owners: dict[int, int] = {}
        for holder in (self, self.geometry, self.geometry.faces):
            for array in (value for value in vars(holder).values() if isinstance(value, np.ndarray)):
                owner = array.base if isinstance(array.base, np.ndarray) else array
                owners[id(owner)] = owner.nbytes
        return sum(owners.values())
