"""Right-hand sides of a body cut into equal cells, whose points see the corners of their own: the equations of
`wsph.formulations.lagrangian.rates`, without pairs.

With the corners of a box at (-1 or 1) h_k/2 along its axes e_k, and weights of one over their number, all sums over them are
sums and differences: the gradient is that of the differences over the edges along each axis, the force on a corner the sum
over the axes of a column of one tensor with the sign of its side, and the misfit of a linear field keeps nothing of a
gradient. No row has indices, weights or places of its own (`wsph.formulations.lattice.runs`).
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array, Space
from wsph.backend.state import Layout, State
from wsph.constitutive.laws import Laws
from wsph.formulations.lagrangian.corners import corner_reference
from wsph.formulations.lagrangian.flow import drift_kernel
from wsph.formulations.lagrangian.form import Form
from wsph.formulations.lagrangian.rates import LagrangianRates, joined
from wsph.formulations.lattice.block_rates import PIECE_BYTES, BlockRates, answers_apart, width_of
from wsph.formulations.lattice.cell import cell_of, cell_struct
from wsph.formulations.lattice.flow import flow_kernel
from wsph.formulations.lattice.forces import force_kernel
from wsph.formulations.lattice.held import RowFading, fade_kernel, held_kernel, held_of_cells
from wsph.formulations.lattice.lanes import ACROSS, quantities
from wsph.formulations.lattice.pieces import Order, Table
from wsph.formulations.lattice.rest import Rest
from wsph.formulations.lattice.runs import FIRST, HEAD, VECTOR, Runs, runs_of
from wsph.formulations.lattice.strain import drag_kernel, strain_kernel
from wsph.formulations.lattice.total import answer_kernel, telling_kernel
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_rates import refuse_other
from wsph.formulations.one_set_setup import RateSetup, is_stabilised
from wsph.formulations.setup import Setup
from wsph.formulations.system import Segmented
from wsph.geometry.cells import Boxes
from wsph.parts.body_force import BodyForceKinds
from wsph.parts.part import Attached, Host
from wsph.plugins.blame import blame
from wsph.ranks.blocks import own_sum, own_total
from wsph.sph.pairs import Pairs


class LatticeKernels:
    """The kernels of a composition, as `wsph.formulations.lagrangian.rates.LagrangianKernels` has them."""

    def __init__(
        self,
        space: Space,
        laws: Laws,
        layout: Layout,
        parts: BodyForceKinds,
        form: Form,
        width: int,
        *,
        mixed: bool,
    ):
        self.force = force_kernel(space, layout, parts, form, width, mixed=mixed)
        self.drift = drift_kernel(space, layout)
        if form.rate_term is not None:
            self.drag = drag_kernel(space, layout, form, width)
        if form.total:
            self.answer = answer_kernel(space, laws, layout, width, stabilised=form.stabilised)
            self.tell = telling_kernel(space, laws, layout, width)
        else:
            self.strain = strain_kernel(space, laws, layout, form, width)
            self.flow = flow_kernel(space, laws, layout, width)


_kernels = cache(LatticeKernels)


def boxes_of(host: Host) -> Boxes | None:
    """The cells of a body that are alike, where their points see their corners and none has an answer of its own
    (`listed_for`)."""
    return None if listed_for(host) else host.geometry.boxes


def listed_for(host: Host) -> str:
    """What a body has lists of pairs for, in words; empty where it needs none, but for a layer of cells that differ."""
    apart = [key for key, part in host.parts.items() if part.acts and answers_apart(part, host)]
    boxes = host.geometry.boxes
    reasons = {
        "its points see more than their own corners": not host.corners or host.correction == "paper",
        "its cells differ": boxes is None or not boxes.pay(len(host.geometry.cell_volume)),
        " and ".join(apart): bool(apart),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


@dataclass(frozen=True)
class Rows:
    """The rows of the `boxes` of a body, and whether it has other points, `mixed`: their `runs`, rows a thread computes,
    threads a block, `numbers` that a cell hands on, and how many of the chunks' share the buffer of the derived fields."""

    boxes: Boxes
    mixed: bool
    runs: Runs
    width: int
    threads: int
    numbers: int
    shared: int

    def piece(self, number: int) -> int:
        """Blocks of cells whose chunks, of numbers of so many bytes, stay in a core's cache until their nodes take them;
        all, where a thread has a row."""
        if self.width == 1:
            return len(self.runs.cells)
        return max(PIECE_BYTES // (number * self.runs.places * self.numbers), 1)

    @property
    def size(self) -> int:
        """Numbers of all chunks, and those beyond that whole vectors may read."""
        return self.runs.chunks * self.runs.places * self.numbers + VECTOR

    def segmented(self, host: Host, *, drags: bool) -> Segmented:
        """The memory of the rows; `drags`: there are chunks of a viscous stress too."""
        dim, number = host.space.dim, np.dtype(host.space.numpy).itemsize
        chunk, columns = self.runs.places * self.numbers * number, 4 * (HEAD + 2**dim)
        fields = (dim**2 + host.constitutive.width) * number if self.shared else 0
        spare = VECTOR * number + drags * (chunk + VECTOR * number)
        return Segmented(self.runs.places - 2, chunk, columns + drags * chunk, columns, fields, spare)

    @classmethod
    def of(cls, host: Host, boxes: Boxes, device: str) -> "Rows":
        """The rows of a body, for kernels on a device."""
        body, dim, width = host.geometry, host.space.dim, width_of(device, host.space.precision)
        across, mixed = ACROSS if width == 1 else width, boxes.share(len(body.cell_volume)) < 1.0
        numbers = quantities(dim, is_stabilised(host))
        # Other points write their derived fields in every evaluation, and an initial stress is one of them.
        shares = host.constitutive.laws.total is not None and not mixed and not host.stressed
        points = len(body.cell_volume)
        derived = points * (dim**2 + host.constitutive.width) if shares else 0
        runs = runs_of(boxes, (len(body.nodes), points), across, numbers, derived)
        made = cls(boxes, mixed, runs, width, across // width, numbers, 0)
        return replace(made, shared=made.size) if shares else made


class LatticeRates(BlockRates):
    """The right-hand sides of one body of equal cells, but for a rest; `rate` and `refresh` are launches."""

    def __init__(self, rows: Rows, made: RateSetup, state: State):
        super().__init__(made, rows.threads)
        host, self._width, self._mixed = made.host, rows.width, rows.mixed
        with blame(host.constitutive.who):
            laws, kinds = host.constitutive.laws, made.force.parts
            self.kernels = _kernels(self._space, laws, made.layout, kinds, self.form, rows.width, mixed=rows.mixed)
            self._rest: Rest | None = None
            if rows.mixed:
                others = rows.boxes.others(len(self._placement.point_volume))
                self._rest = Rest(made, others, self.form, made.stabilisation) if len(others) else None
        self._allocate(rows, made.stabilisation, state)

    def _allocate(self, rows: Rows, stabilisation: float, state: State) -> None:
        """The blocks of cells and nodes and what cells hand to nodes.

        _cells, _order   # blocks of cells (`wsph.formulations.lattice.runs.Runs`), and the order of these and of nodes
        _chunks, _drags  # chunks of what nodes take: of the stress and the residual, and of the viscous stress
        _volume          # of the particles, (n,) scalar
        holding          # forces per mass that hold spurious modes: there are none beside the residual's
        """
        space, arrays, real, runs, boxes = self._space, self._arrays, self._space.scalar, rows.runs, rows.boxes
        self._cells, nodes = Table.of(runs.cells, arrays, "cells"), Table.of(runs.nodes, arrays, "nodes")
        takes, most = runs.taking(boxes, self._placement.count), rows.piece(np.dtype(space.numpy).itemsize)
        self._order = Order(self._cells, [(nodes, takes)], most, self._cores, arrays, "left")
        self._cell = cell_of(space, boxes.steps(self._host.scales.length), boxes.axes, stabilisation)
        if self.form.total and state.derived is not None:
            # Where the stress follows from the displacements, no step reads the derived fields.
            state.derived.tell = self.refresh
        shared = state.derived.buffer if rows.shared and state.derived is not None else None
        self._chunks = arrays.zeros("chunks", rows.size, real) if shared is None else shared
        self._drags = self._chunks
        if self.form.rate_term is not None:
            self._drags = arrays.zeros("drags", rows.size, real)
        self._volume = arrays.of("volume", self._placement.volume, real)
        self.holding: Array = arrays.zeros("holding", 1, space.vec)
        self._pushed = self.holding if self._rest is None else self._rest.pushed
        if rows.mixed and self._rest is None:  # the others are in the parts of other processes
            self._pushed = arrays.zeros("pushed", (1 + self.form.damps) * self._placement.count, space.vec)

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """What the stabilisation has of its own on the device."""
        flow, count = self._constitutive.flow, (self._cells.count, len(self._placement.point_volume))
        if flow is None or self.form.fades < 0:
            return {}
        part = arrays.part("fading")
        whole = partial(own_sum, share=self._placement.point_share, domain=self._domain)
        kernel = fade_kernel(self._space, self._layout, flow[0], cell_struct(self._space), held_of_cells(self._space))
        own = RowFading(kernel, flow, self._cell, self._cells.rows, count, state, self._clock, part, whole)
        found: dict[str, Attached] = {"fading": own}
        if self._rest is not None:
            found["fading of the rest"] = self._rest.fading(flow, state, arrays.part("fading of the rest"), own.kept)
        return found

    @property
    def pairs(self) -> int:
        """Directed pairs, from the cells of its own to their corners and back, as many as lists would have."""
        return 2 * int(np.diff(self._host.geometry.rows.offsets)[self._placement.point_share.own].sum())

    @property
    def neighbours(self) -> Pairs:
        """The particles that a cell joins to each."""
        return self._joined

    @cached_property
    def _joined(self) -> Pairs:
        pairs = corner_reference(self._host, self._clock.device).pairs
        return joined(pairs, pairs.transposed()[0])

    def rate(self, state: State, out: State, part: str = "all", ahead: float = 0.0) -> None:
        """`OneSetSystem.rate`; the rest takes the deformation."""
        if part != "rest":
            self._find_forces(state, out)
        if part != "velocity":
            self._clock.launch(self.kernels.drift, self._placement.count, [state.struct], [out.struct])
            if not self.form.total:
                self._flow(state, out, ahead)

    def _flow(self, state: State, out: State, ahead: float) -> None:
        refuse_other(state)
        inputs = [self._clock.time, self._space.scalar(ahead), self._constitutive.params, self._cell, self._cells.rows]
        self._launch(self.kernels.flow, self._cells.count, [*inputs, state.struct], [out.struct])
        if self._rest is not None:
            self._rest.flow(state, out, ahead)

    def refresh(self, state: State) -> None:
        """Deformation and, of a total law, stress of a state from its displacement (launches)."""
        if not self.form.total:
            self._strain(state, self._cells.rows, self._cells.count)
        else:
            inputs = [self._constitutive.params, self._cell, self._cells.rows, state.struct]
            self._launch(self.kernels.tell, self._cells.count, inputs, [state.struct])
        if state.derived is not None:
            state.derived.of = state
        if self._rest is not None:
            self._rest.strain(state)

    def _strain(self, state: State, cells: Array, blocks: int) -> None:
        """What the nodes of a state take of some blocks of cells (launches)."""
        if state.derived is not None:
            state.derived.of = None if self.form.total else state
        outputs = [self._chunks]
        if self.form.total:
            inputs = [self._constitutive.params, self._cell, cells, state.struct]
            self._launch(self.kernels.answer, blocks, inputs, outputs)
        else:
            inputs = [self._coefficients, self._cell, cells, state.struct]
            self._launch(self.kernels.strain, blocks, inputs, [state.struct, *outputs])

    def _sum_forces(self, body: object, loads: list[Array], state: State, out: State) -> None:
        """Accelerations from what cells hand to nodes, under loads (launches)."""
        if self._rest is not None:
            self._rest.strain(state)
            self._rest.push(state)

        def strain(cells: Array, blocks: int) -> None:
            self._strain(state, cells, blocks)
            if self.form.rate_term is not None:
                inputs = [self._coefficients, self._density, self._cell, cells, state.struct]
                self._launch(self.kernels.drag, blocks, inputs, [self._drags])

        def force(nodes: Array, blocks: int) -> None:
            inputs = [body, nodes, self._chunks, self._drags, *loads, self._volume, self._pushed, state.struct]
            self._launch(self.kernels.force, blocks, inputs, [out.struct])

        self._order.run([strain, force], self._clock)

    def held_energy(self, state: State) -> float:
        """Energy of the residual, of a state that is up to date, nondimensional (a launch and a copy)."""
        if not self.form.stabilised:
            return 0.0
        sums: Array = wp.zeros(self._cells.count, dtype=wp.float64, device=self._clock.device)
        inputs = [self._cell, self._cells.rows, self._chunks, state.struct]
        made = held_kernel(self._space, self._layout, self._width, self.form.fades >= 0)
        wp.launch(made, len(sums), inputs=inputs, outputs=[sums], device=self._clock.device)
        first = self._cells.blocks[:, FIRST]
        share = self._placement.point_share
        total = own_total(sums, first, share, self._domain)
        if not self._mixed:
            return total
        others = np.zeros(share.held) if self._rest is None else self._rest.held_energies(state)
        return total + own_sum(others, share, self._domain)


def build(setup: Setup) -> OneSetSystem:
    """A body whose points have places of their own: by its lattice where all of its cells are alike, else by its pairs."""
    boxes = boxes_of(setup.host)
    if boxes is None:
        listed = OneSetSystem(setup, LagrangianRates)
        listed.listed = listed_for(setup.host)
        return listed
    rows = Rows.of(setup.host, boxes, setup.device)
    system = OneSetSystem(setup, partial(LatticeRates, rows), rows.shared)
    system.regular = boxes.share(len(setup.geometry.cell_volume))
    system.segmented = rows.segmented(setup.host, drags=system.form.rate_term is not None)
    return system
