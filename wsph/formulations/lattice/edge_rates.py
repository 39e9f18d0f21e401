"""Right-hand sides of a body of equal cells whose nodes see each other along the edges of these: the equations of
`wsph.formulations.lagrangian.edges`, without pairs (`wsph.formulations.lattice.edge_lanes`)."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Protocol, cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.reduce import total
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.edges import edge_reference
from wsph.formulations.lagrangian.flow import drift_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.rates import LagrangianRates
from wsph.formulations.lattice.block_rates import PIECE_BYTES, BlockRates, answers_apart, width_of
from wsph.formulations.lattice.edge_kernels import (
    answer_kernel,
    force_kernel,
    gradient_kernel,
    grid_struct,
    held_kernel,
    spread_kernel,
    telling_kernel,
)
from wsph.formulations.lattice.lanes import ACROSS
from wsph.formulations.lattice.runs import HEAD, VECTOR, EdgeRuns, edge_runs
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Setup
from wsph.formulations.system import Segmented
from wsph.geometry.cells import Boxes
from wsph.parts.body_force import BodyForceKinds
from wsph.parts.part import Attached, Host, Part
from wsph.plugins.blame import blame
from wsph.sph.pairs import Pairs


class Fields(Protocol):
    """The fields of a state that these take."""

    displacement: Array


class Grid(Protocol):
    """What nodes have in common, as `wsph.formulations.lattice.edge_kernels.grid_struct` has it."""

    axes: object
    back: object
    step: object
    inverse: object
    hold: float
    stride: int
    volume: Array


class EdgeKernels:
    """The kernels of a composition, as `wsph.formulations.lagrangian.rates.LagrangianKernels` has them."""

    def __init__(
        self, space: Space, laws: Laws, own: Laws, layout: Layout, parts: BodyForceKinds, form: Form, width: int
    ):
        self.gradient = gradient_kernel(space, width)
        self.answer = answer_kernel(space, laws, own, width)
        self.spread = spread_kernel(space, width, form.stabilised)
        self.force = force_kernel(space, layout, parts, form, width)
        self.tell = telling_kernel(space, laws, layout, width)
        self.drift = drift_kernel(space, layout)


_kernels = cache(EdgeKernels)


def boxes_of(host: Host) -> Boxes | None:
    """The cells of a body that are alike, where its nodes see each other along their edges, and rows of a lattice are all
    that its right-hand sides take (`listed_for`)."""
    return None if listed_for(host) else host.geometry.boxes


def listed_for(host: Host) -> str:
    """What a body has lists of pairs for, in words; empty where it needs none. Laws of rates, volumes of blocks and an
    initial stress have kernels over lists alone; so have parts but those that act along the line of two particles, one of a
    kind."""
    acting = {key: part for key, part in host.parts.items() if part.acts}
    terms = [term.sum for part in acting.values() if (term := part.pair_term(host)) is not None]
    apart = [key for key, part in acting.items() if not _along(part, host)]
    reasons = {
        "its pairs are a kernel's": not host.edges,
        "its cells differ": host.geometry.irregular,
        "volumes are those of blocks of particles": host.locks or host.flows,
        "its law gives rates": host.constitutive.laws.total is None,
        "it begins with a stress": host.stressed,
        " and ".join(apart): bool(apart),
        "parts act at the same place": len(terms) > len(set(terms)),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _along(part: Part, host: Host) -> bool:
    """Whether a part acts along the line of two particles alone, if at all."""
    term = part.pair_term(host)
    return not answers_apart(part, host) and (term is None or term.along is not None)


@dataclass(frozen=True)
class Rows:
    """The rows of a body of `boxes`: their `runs`, rows a thread computes, threads a block, the `stride` of flat arrays, and
    where `columns`, the gradients, begin: behind the derived fields, or what else is passed on. What forces take stands
    over them, unless terms between two take gradients too, `paired`."""

    boxes: Boxes
    runs: EdgeRuns
    width: int
    threads: int
    stride: int
    columns: int
    paired: bool

    @property
    def size(self) -> int:
        """Numbers that the loops pass on."""
        return self.columns + self.boxes.axes.size * self.stride + VECTOR

    def piece(self, number: int) -> int:
        """Blocks whose numbers, of so many bytes, stay in a core's cache until the next loop takes them; all, where a
        thread has a row."""
        if self.width == 1:
            return len(self.runs.blocks)
        return max(PIECE_BYTES // (number * self.width * self.boxes.axes.size), 1)

    def segmented(self, space: Space) -> Segmented:
        """The memory of the blocks, two of the body's of one row."""
        columns = 4 * (HEAD + 2**space.dim)
        spare = 2 * columns + VECTOR * np.dtype(space.numpy).itemsize
        return Segmented(self.width * self.threads, 0, 0, columns, 0, spare)

    @classmethod
    def of(cls, host: Host, boxes: Boxes, device: str) -> "Rows":
        """The rows of a body, for kernels on a device."""
        dim, width = host.space.dim, width_of(device, host.space.precision)
        across = ACROSS if width == 1 else width
        # Caches have few places for what is a power of two apart.
        stride = len(boxes.index) + VECTOR * (len(boxes.index) % 64 == 0)
        paired = any(part.acts and part.pair_term(host) is not None for part in host.parts.values())
        derived = len(boxes.index) * (dim**2 + host.constitutive.width)
        columns = max((1 + paired) * dim**2 * stride, derived)
        return cls(boxes, edge_runs(boxes, across), width, across // width, stride, columns, paired)


class EdgeRates(BlockRates):
    """The right-hand sides of one body of equal cells along whose edges its nodes see each other."""

    def __init__(self, rows: Rows, made: RateSetup, state: State):
        super().__init__(made, rows.threads)
        host, space, dim = made.host, made.host.space, made.host.space.dim
        with blame(host.constitutive.who):
            laws, kinds = host.constitutive.laws, made.force.parts
            own = laws if rows.width == 1 else host.constitutive.beside
            self.kernels = _kernels(space, laws, own, made.layout, kinds, self.form, rows.width)
        step, arrays = rows.boxes.steps(host.scales.length), self._arrays
        self._table = arrays.of("blocks", rows.runs.blocks.ravel(), wp.int32)
        self._count, self._ends = len(rows.runs.blocks), rows.runs.edges
        self._pieces = rows.runs.pieces(self._cores * rows.piece(np.dtype(space.numpy).itemsize), 4)
        self._grid: Grid = grid_struct(space)()
        self._grid.axes, self._grid.back = (
            space.mat(*each.ravel().tolist()) for each in (rows.boxes.axes, rows.boxes.axes.T)
        )
        self._grid.step, self._grid.inverse = space.vec(*step.tolist()), space.vec(*(1.0 / step).tolist())
        self._grid.hold, self._grid.stride = space.scalar(made.stabilisation / (2.0 * dim)), rows.stride
        self._grid.volume = arrays.of("volume", self._placement.volume, space.scalar)
        if state.derived is None:
            raise TypeError("the stress of a total law is a derived field")
        # No step reads the derived fields, and what loops pass on stands in their place.
        state.derived.tell = self.refresh
        long, starts = dim**2 * rows.stride, (0, dim**2 * rows.stride if rows.paired else rows.columns, rows.columns)
        self._nominal, self._passed, self._columns = (
            _view(state.derived.buffer, space, start, long) for start in starts
        )
        self.holding: Array = arrays.zeros("holding", made.placement.count if self.form.holds else 1, space.vec)

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """The stabilisation of a total law has nothing of its own."""
        return {}

    @property
    def pairs(self) -> int:
        """Directed pairs, as many as a list would have."""
        return self._ends

    @property
    def neighbours(self) -> Pairs:
        """The particles along the edges."""
        return self._joined

    @cached_property
    def _joined(self) -> Pairs:
        return edge_reference(self._host, None, self._clock.device).pairs

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`."""
        if part != "rest":
            self._find_forces(state, out)
        if part != "velocity":
            self._clock.launch(self.kernels.drift, self._placement.count, [state.struct], [out.struct])

    def refresh(self, state: State) -> None:
        """Deformation and stress of a state from its displacement (launches)."""
        blocks = 0, self._count
        self._find_columns(state, blocks)
        inputs = [self._constitutive.params, self._grid, self._table, self._columns]
        self._launch(self.kernels.tell, blocks, inputs, [state.struct])
        if state.derived is not None:
            state.derived.of = state

    def _find_columns(self, state: State, blocks: tuple[int, int]) -> None:
        """The gradients of some blocks (launches)."""
        inputs = [self._grid, self._part(self._table, blocks), cast(Fields, state.struct).displacement]
        self._launch(self.kernels.gradient, blocks, inputs, [self._columns])

    def _sum_forces(self, body: object, loads: list[Array], state: State, out: State) -> None:
        if state.derived is not None:
            state.derived.of = None
        law, grid = self._constitutive.params, self._grid
        for gradients, answers, spreads, forces in self._pieces:
            self._find_columns(state, gradients)
            inputs = [law, grid, self._part(self._table, answers), self._columns]
            self._launch(self.kernels.answer, answers, inputs, [self._nominal])
            inputs = [grid, self._part(self._table, spreads), self._columns, self._nominal]
            self._launch(self.kernels.spread, spreads, inputs, [self._passed])
            inputs = [body, self._coefficients, grid, self._part(self._table, forces), self._columns, self._passed]
            self._launch(self.kernels.force, forces, [*inputs, *loads, state.struct], [self.holding, out.struct])

    def held_energy(self, state: State) -> float:
        """Energy of the residual of a state, nondimensional (a launch and a copy)."""
        if not self.form.stabilised:
            return 0.0
        sums: Array = wp.zeros(self._count, dtype=wp.float64, device=self._clock.device)
        made = held_kernel(self._space, self._layout)
        inputs = [self._grid, self._table, state.struct]
        wp.launch(made, len(sums), inputs=inputs, outputs=[sums], device=self._clock.device)
        return total(sums)


def _view(buffer: Array, space: Space, start: int, size: int) -> Array:
    """So many numbers of a buffer, as an array of its own."""
    address = (buffer.ptr or 0) + start * np.dtype(space.numpy).itemsize
    return wp.array(ptr=address, dtype=space.scalar, shape=size, device=buffer.device, copy=False)


def build(setup: Setup) -> OneSetSystem:
    """A body whose particles are their own points: by its lattice where that has edges, and all cells are alike; else by
    its pairs."""
    boxes = boxes_of(setup.host)
    if boxes is None:
        listed = OneSetSystem(setup, LagrangianRates)
        listed.listed = listed_for(setup.host)
        return listed
    rows = Rows.of(setup.host, boxes, setup.device)
    system = OneSetSystem(setup, partial(EdgeRates, rows), rows.size)
    system.regular, system.segmented = 1.0, rows.segmented(setup.space)
    return system
