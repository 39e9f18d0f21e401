"""The two-set system of Taylor-SPH: real particles at the nodes of a lattice, virtual ones at its cell centres.

Small strain: both sets stay where they are, operators are computed once. A rate at a target is gathered from the other
set: the velocity gradient and the stress divergence through the corrected gradient, the source (the law's rate at L = 0)
evaluated at the sources and interpolated, as Herreros & Mabssout 2011, eqs 38 and 40, have it; the gradient takes the
difference f_J - f_I (their eqs 38 and 40 drop f_I, which is 33 % wrong at a boundary).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from collections.abc import Callable

import numpy as np
import warp as wp

from wsph.backend.domain import Share
from wsph.backend.space import Array
from wsph.backend.state import Layout, State
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.forces import LoadForces
from wsph.boundary.loads.regions import gravity_of, volume_loads
from wsph.boundary.programs.prescribed import varies
from wsph.boundary.values import BoundaryValues
from wsph.boundary.work import ExternalWork
from wsph.constitutive.constitutive import project_faces_kernel
from wsph.formulations.lattice.block_rates import width_of
from wsph.formulations.lattice.runs import HEAD
from wsph.formulations.layout import displacement_field, matter_fields, velocity_field
from wsph.formulations.setup import Setup
from wsph.formulations.system import Segmented
from wsph.formulations.taylor.carried import CarriedCells
from wsph.formulations.taylor.faces import faces_struct
from wsph.formulations.taylor.kernels import TaylorKernels, drift_kernel, kernels
from wsph.formulations.taylor.operators import SHORTEST, Operator, lattice_rows, smallest_moment
from wsph.formulations.taylor.part import Part
from wsph.formulations.taylor.reading import TwoSetReading
from wsph.formulations.taylor.set_up import held_components, layers_read, weighed
from wsph.geometry.cracks import parted
from wsph.geometry.lattice import Lattice
from wsph.parts.body_force import BodyForce
from wsph.parts.body_force_work import MiddleWork
from wsph.plugins.blame import blame
from wsph.ranks.kept import Piece, Rows
from wsph.ranks.slabs import Slab
from wsph.scene.geometries import support_of
from wsph.sph.weights import Weights


class TwoSetSystem(TwoSetReading):
    """A body as Taylor-SPH sees it: `position`, `volume` and `state` are those of the n real particles.

    _virtual, _real  # operators from the other set: `wsph.formulations.taylor.operators`
    _axes            # axes of the shape and its faces, in rows, mat
    _framed          # its own particles on faces, (f,) int32
    _faces           # what is prescribed at the real particles: `wsph.formulations.taylor.faces`
    """

    by_rows = True
    """Whether rows that follow from its lattice have kernels without lists."""
    along = 2
    """Layers beyond its own that a process holds whatever it sees: a load on a face works on those beside it too."""

    def __init__(self, setup: Setup):
        self._support = support_of(setup.scene, setup.body, setup.formulation)
        found = weighed(setup, self._support, self.along, self._spanning)
        setup, self.conditions = found.setup, found.conditions
        super().__init__(setup)
        scene, body, lattice = setup.scene, setup.body, setup.lattice
        space, constitutive, scales, device = setup.space, setup.constitutive, setup.scales, setup.device
        self.position, self._part = lattice.nodes, Part(lattice.split)
        self.share = self.point_share = self._part.real
        self.volume = lattice.node_volume / scales.length**space.dim
        self._displacement = setup.displacement or self.traits.courant_follows or bool(lattice.cracks)
        self._parted = parted(lattice.index, lattice.faces) if lattice.cracks else None
        self._states: dict[str, tuple[State, Share]] = {}
        self._stepped: dict[int, slice] = {}
        self._sources: dict[int, State] = {}
        """The law's rates at L = 0 at the particles of each state, where the law has any."""
        self._virtual = self._operator("virtual", found.to_virtual)
        self._moment = smallest_moment(self._virtual, lattice, self._part.virtual, self.domain)
        self._real = self._operator("real", found.to_real)
        self._part.reach(self._virtual, self._real)
        rows = self._virtual.regular + self._real.regular
        self.regular = rows / (self._part.virtual.whole + self._part.real.whole)
        self.listed = self._listed_for()
        if rows:
            across, block, spared = self._virtual.across, 4 * (HEAD + 2**space.dim), self._virtual.spared
            self.segmented = Segmented(across, 0, block, block, 0, 0, spared, SHORTEST)
        self.state = self._new("real", own=True)
        self._axes = space.mat(*lattice.frame.axes.T.ravel())
        self._rotated = not lattice.frame.upright
        self._framed: Array = wp.array(self._on_faces, dtype=wp.int32, device=device)
        self._pulls = self._find_pulls(setup)
        varied = bool(self._pulls)
        self.force = BodyForce(gravity_of(scene)[0], body.damping, space, scales, self.density, varied)
        self._inertia = [self.force.among(pull.force) for pull in self._pulls] or [self.force.struct] * 2
        cells, of = lattice.cell_volume / scales.length**space.dim, (self._inertia[0], self._part.virtual, self.domain)
        self.force_work = MiddleWork(self.force, cells, space, device, *of)
        self._middle: State | None = None
        self._faces = faces_struct(space)()
        self._faces.held = wp.array(self._held_components, dtype=wp.int32, device=device)
        self._faces.free = wp.array(self.conditions.free_normals, dtype=wp.int32, device=device)
        self._faces.axes = self._axes
        self._at_targets: list[object] = [self._faces]
        units = {"velocity": scales.velocity, "stress": scales.stress}
        given = self._part.prescribed(self.conditions, lattice.corners)
        self.boundary = BoundaryValues(
            space, given, self.state, lattice.nodes, units, scales.time, device, domain=self.domain
        )
        area = scales.length ** (space.dim - 1)
        axes = space.mat(*lattice.frame.axes.ravel())
        self.work = self._works = ExternalWork(
            space, self.conditions, constitutive.laws, area, axes, self.state.layout, device, self.share, self.domain
        )
        self._carried = CarriedCells(space, self.conditions, lattice, device)
        self._register()
        with blame(constitutive.who):
            self.kernels = self._make_kernels()

    @property
    def told(self) -> int:
        return sum(self.state.widths.values())

    def holding(self, slab: Slab) -> Slab:
        own = slice(slab.nodes.low, slab.nodes.high), slice(slab.cells.low, slab.cells.high)

        def sees(name: str, targets: slice) -> slice:
            return (self._virtual if name == "virtual" else self._real).sees(targets)

        counts = self.lattice.counts
        return slab.over(layers_read(self.lattice, own, sees, self.along), counts.nodes, counts.points)

    @property
    def _on_faces(self) -> np.ndarray:
        """Its own particles on faces, (f,)."""
        on = np.flatnonzero(self.lattice.on_face)
        return on[self.share.owns(on)]

    def _find_pulls(self, setup: Setup) -> list[LoadForces]:
        """Accelerations of the virtual and of the real particles that change from place to place; none where none do."""
        number, lattice = [body.name for body in setup.scene.bodies].index(self.name), setup.lattice
        density, scales, found = setup.constitutive.material.density, self.scales, list[LoadForces]()
        for name, places in (("virtual", lattice.cells), ("real", lattice.nodes)):
            forces = setup.body.body_force
            loads = volume_loads(setup.scene, number, forces, places, lattice.spacing, density, self.domain)
            if loads:
                field = self.arrays.zeros(f"pull.{name}", len(places), self.space.vec)
                unit = density * scales.velocity / scales.time
                found.append(LoadForces(self.space, loads, field, places, unit, scales.time, self.device))
        return found

    def _pull(self, c: float) -> None:
        """Set the accelerations of t + c dt (launches, where they change in time)."""
        for pull in self._pulls:
            pull.impose(self.clock, c)

    def _register(self) -> None:
        """The arrays that the body holds, by name."""
        for name, operator in (("virtual", self._virtual), ("real", self._real)):
            for part, array in operator.arrays().items():
                self.arrays.take(f"{name}.{part}", array)
        self.arrays.part("body").adopt(self)
        self.arrays.part("boundary").adopt(self.boundary)
        self.arrays.part("motions").adopt(self.boundary.motions, self.boundary.motions.kept())
        self.arrays.part("carried").adopt(self._carried)
        for name, works in (("work", self._works), ("force", self.force_work)):
            self.arrays.part(name).adopt(works, works.kept())

    def _layout(self, where: str) -> Layout:
        """Fields of the "real" or the "virtual" particles."""
        return Layout.of(
            (
                velocity_field(self.space),
                *matter_fields(self.constitutive),
                displacement_field(self.space, self._displacement and where == "real"),
            )
        )

    def _make_kernels(self) -> TaylorKernels:
        layouts = self._layout("virtual"), self._layout("real")
        mixed, width = (self._virtual.regular > 0, self._real.regular > 0), width_of(self.device, self.space.precision)
        return kernels(self.space, self.constitutive.laws, *layouts, self.force.parts, self._rotated, mixed, width)

    @property
    def _held_components(self) -> np.ndarray:
        return held_components(self.conditions, self.constitutive, self.count)

    def _spanning(self, name: str, lattice: Lattice, conditions: Conditions, held: np.ndarray) -> np.ndarray:
        """Which of the "real" or "virtual" particles of a lattice have to span all directions, (n,) bool;
        `held` as `held_components` says it.

        Where all components of the velocity and no stress is prescribed the stress is that of the whole gradient; where a
        prescribed velocity varies along a face its slope there would be taken for one across it. Other corners take each
        axis by itself, which holds every mode to rounding up to C = 0.9: a larger support at all of them lets a block with
        symmetric faces grow by 7e-6 a step at nu = 0.499, C = 0.05.
        """
        if name == "virtual":
            return np.zeros(len(lattice.cell_volume), bool)
        spanning = held == (1 << lattice.index.shape[1]) - 1
        for (field, _), values in conditions.entries.items():
            if field == "velocity":
                spanning[[particle for particle, value in values.items() if varies(value)]] = True
        return spanning

    def _operator(self, name: str, weights: tuple[Weights, Weights]) -> Operator:
        """From one set to the "virtual" or the "real" particles. Gradients are brought to lengths and to the coordinate
        axes."""
        none = np.full((weights[0].pairs.targets, 2**self.space.dim), -1, np.int32)
        near = lattice_rows(*weights) if self.by_rows else none
        if name == "real":
            near[(self._held_components != 0) | (self.conditions.free_normals != 0)] = -1
        frame = self.lattice.frame
        along = frame.upright and (np.abs(frame.step / self.scales.length - 1.0) < 1e-6).all()
        turn = None if along else frame.axes * (self.scales.length / frame.step)
        share = self._part.real if name == "real" else self._part.virtual
        return Operator(self.space, weights, turn, near, self.device, share, self.domain)

    def _listed_for(self) -> str:
        """What it has lists for, in words; empty where rows follow from its lattice."""
        if self.regular > 0.0:
            return ""
        if self.lattice.irregular:
            return "its cells differ"
        return (
            "too small for rows to pay"
            if self._virtual.few or self._real.few
            else "its particles see more than the nearest of the other set"
        )

    @property
    def second_moment(self) -> float:
        """Smallest second moment m2 of the interpolation weights over the interior virtual particles, in spacings squared.

        Taylor-SPH in one dimension is stable up to the Courant number 2 sqrt(m2).
        """
        return self._moment

    @property
    def pairs(self) -> int:
        """Directed pairs of both operators."""
        return self._virtual.pairs + self._real.pairs

    @property
    def to_virtual(self) -> tuple[Weights, Weights]:
        return self._virtual.whole()

    @property
    def to_real(self) -> tuple[Weights, Weights]:
        return self._real.whole()

    def new(self, where: str = "real") -> State:
        """A state, zero but for the internals' initial values, at the "real" or at the "virtual" particles."""
        return self._new(where)

    def _new(self, where: str, own: bool = False) -> State:
        share, layout = self._part.real if where == "real" else self._part.virtual, self._layout(where)
        number, n = self._made, share.held
        state = self._make(n, layout, own=own)
        self._states[f"state{number}"] = state, share
        self._stepped[id(state)] = self._part.stepped[where]
        if self.constitutive.laws.source is not None:
            made = self._sources[id(state)] = State(self.space, n, layout, self.device)
            self.arrays.take(f"source{len(self._sources)}", made.buffer)
        return state

    def _stressed(self, state: State) -> slice:
        return self._stepped[id(state)]

    def _source(self, state: State) -> object:
        """The law's rate at L = 0 at every particle of `state` (a launch where the law has one)."""
        source = self._sources.get(id(state))
        if source is None:
            return state.struct
        self.clock.launch(
            self.kernels.source[state.layout], state.n, [self.constitutive.params, state.struct], [source.struct]
        )
        return source.struct

    def half_step(self, source: State, out: State, weight: float) -> None:
        """Virtual `out` = interpolated real `source` + weight dt times the rate there."""
        self._pull(0.0)
        shared = [source.struct, self._source(source), self.clock.time, self.space.scalar(weight)]
        self._step_lists(self._virtual, self.kernels.half_step, [self._inertia[0], self._virtual.rows, *shared], out)
        self._step_rows(False, shared, out)

    def _step_rows(self, real: bool, shared: list[object], out: State) -> None:
        """A half step of the particles whose rows follow from the lattice (a launch, where there are any): `shared` are the
        arguments of both kernels."""
        operator, kernel = (self._virtual, self._real)[real], self.kernels.by_rows[real]
        if kernel is not None:
            inputs = [self.constitutive.params, self._inertia[real], operator.slope, operator.table, *shared]
            self._launch(kernel, operator.threads, inputs, out)

    def _step_lists(self, operator: Operator, kernel: wp.Kernel, inputs: list[object], out: State) -> None:
        """A half step of the particles that have lists (a launch, where there are any)."""
        self._launch(kernel, operator.lists, [self.constitutive.params, *inputs], out)

    def _launch(self, kernel: wp.Kernel, rows: slice, inputs: list[object], out: State) -> None:
        if rows.stop > rows.start:
            self.clock.launch(kernel, rows.stop - rows.start, inputs, [out.struct], rows.start)

    def rate(self, source: State, out: State, *, imposed: State, weight: float) -> None:
        """Real `out` += weight dt times the rate from virtual `source`.

        At the target, f_I is the interpolated `source`, or `imposed` in the components that are prescribed there. Cells
        between prescribed particles move as those do: `source` is set so.
        """
        self._carried.carry(self.clock, imposed, source)
        self._middle = source
        self._pull(0.5)
        shared = [source.struct, self._source(source), self.clock.time, self.space.scalar(weight)]
        inputs = [self._inertia[1], self._real.rows, *self._at_targets, *shared[:2], imposed.struct, *shared[2:]]
        self._step_lists(self._real, self.kernels.rate, inputs, out)
        self._step_rows(True, shared, out)

    def hold(self, state: State, c: float | tuple[float, float]) -> None:
        """Impose prescribed values on the state that the run continues from; stresses in the axes of each face."""
        self._in_frames(state, lambda: self.impose(state, c))
        self._part.bring(state, self.clock)

    def _in_frames(self, state: State, act: Callable[[], None]) -> None:
        """Do what takes stresses on faces in the axes of the faces."""
        if not self._rotated:
            act()
            return
        n = self._framed.shape[0]
        self.clock.launch(self.kernels.turn, n, [self._axes, self._framed], [state.struct])
        act()
        self.clock.launch(self.kernels.turn, n, [wp.transpose(self._axes), self._framed], [state.struct])

    def _settle(self, state: State) -> None:
        """The prescribed values at t + dt, and stresses that the law allows: the normal strains that are not known are those
        that keep the prescribed stresses."""
        self.impose(state, 1.0)
        laws = self.constitutive.laws
        if laws.project is not None:
            inputs = [self.constitutive.params, self._faces.free]
            self._launch(project_faces_kernel(self.space, laws, state.layout), self._stressed(state), inputs, state)
            self.impose(state, 1.0)

    def accept(self, state: State) -> None:
        """Close the step: the prescribed values at t + dt."""
        self._closes(state)
        self._in_frames(state, lambda: self._settle(state))
        if self._displacement:
            drift = drift_kernel(self.space, state.layout)
            self._launch(drift, self._stressed(state), [self.clock.time], state)
        self.boundary.motions.lead(state, self.clock)
        self._part.bring(state, self.clock)

    def pieces(self) -> dict[str, list[Piece]]:
        moved, works = self.boundary.moving(self.share, self.domain), self._works.rows(self.share)
        known = {f"motions.moves.{name}": moved for name in ("velocity", "displacement")}
        known |= {"work._work": works, "work._power": works, "force._work": Rows.of_blocks(self._part.virtual)}
        return self._part.pieces(self.arrays.kept, self._states, known)

    def close(self) -> None:
        self.boundary.motions.close(self.clock)
        self._works.add(self.state, self.clock)
        if self._middle is not None:
            self.force_work.add(self._middle, self.clock)
