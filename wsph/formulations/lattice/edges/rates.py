"""Right-hand sides of a body of equal cells whose nodes see each other along the edges of these: the equations of
`wsph.formulations.lagrangian.edges`, without pairs (`wsph.formulations.lattice.edges.lanes`)."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from functools import cached_property, partial
from typing import Protocol, cast

import numpy as np
import warp as wp

from wsph.backend.arrays import Arrays
from wsph.backend.space import Array, Space
from wsph.backend.state import State
from wsph.formulations.lagrangian.edges import edge_reference
from wsph.formulations.lagrangian.rates import LagrangianRates
from wsph.formulations.lattice.block_rates import BlockRates, answers_apart
from wsph.formulations.lattice.edges.grid import grid_of, grid_struct
from wsph.formulations.lattice.edges.held import held_kernel, held_of_nodes
from wsph.formulations.lattice.edges.rows import Rows
from wsph.formulations.lattice.edges.stages import Stage, kernels_of
from wsph.formulations.lattice.held import RowFading, fade_kernel
from wsph.formulations.lattice.pieces import Order, Table
from wsph.formulations.lattice.runs import FIRST
from wsph.formulations.one_set import OneSetSystem
from wsph.formulations.one_set_rates import refuse_other
from wsph.formulations.one_set_setup import RateSetup
from wsph.formulations.setup import Setup
from wsph.geometry.cells import Boxes
from wsph.parts.part import Attached, Host, Part
from wsph.plugins.blame import blame
from wsph.ranks.blocks import own_sum, own_total
from wsph.sph.pairs import Pairs


class Fields(Protocol):
    """The fields of a state that these take."""

    displacement: Array
    velocity: Array


def boxes_of(host: Host) -> Boxes | None:
    """The cells of a body that are alike, where its nodes see each other along their edges, and rows of a lattice are all
    that its right-hand sides take (`listed_for`)."""
    return None if listed_for(host) else host.geometry.boxes


def listed_for(host: Host) -> str:
    """What a body has lists of pairs for, in words; empty where it needs none. Cells that differ and parts that change what
    points answer have kernels over lists alone; so have parts of pairs but those that act along the line of two particles,
    one of a kind."""
    acting = {key: part for key, part in host.parts.items() if part.acts}
    terms = [term.sum for part in acting.values() if (term := part.pair_term(host)) is not None]
    apart = [key for key, part in acting.items() if not _along(part, host)]
    reasons = {
        "its pairs are a kernel's": not host.edges,
        "its cells differ": host.geometry.irregular,
        " and ".join(apart): bool(apart),
        "parts act at the same place": len(terms) > len(set(terms)),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")


def _along(part: Part, host: Host) -> bool:
    """Whether a part acts along the line of two particles alone, if at all."""
    term = part.pair_term(host)
    return not answers_apart(part, host) and (term is None or term.along is not None)


class EdgeRates(BlockRates):
    """The right-hand sides of one body of equal cells along whose edges its nodes see each other."""

    def __init__(self, rows: Rows, made: RateSetup, state: State):
        super().__init__(made, rows.threads)
        host, space = made.host, made.host.space
        with blame(host.constitutive.who):
            laws, kinds = host.constitutive.laws, made.force.parts
            self.kernels = kernels_of(space, laws, made.layout, kinds, self.form, rows.width)
        self._allocate(rows, made, state)
        self._ends, along, most = rows.runs.edges, rows.runs.takes, rows.piece(np.dtype(space.numpy).itemsize)
        own, means = self._tables[0], self._tables[-1]
        around = list(zip([means, own], rows.around, strict=True)) if self.form.blocks else []
        forces = [(own, along), *around, *(around if self.form.total else []), (own, along), (own, along)]
        self._forces, self._flows = (
            Order(own, after, most, self._cores, self._arrays, name)
            for after, name in ((forces, "left of forces"), ([(own, along), *around], "left of flow"))
        )

    def _allocate(self, rows: Rows, made: RateSetup, state: State) -> None:
        """The rows, and what loops pass on.

        _tables   # rows and runs of blocks (`wsph.formulations.lattice.runs`, `.edges.blocks`)
        grid      # what rows have in common (`wsph.formulations.lattice.edges.grid`)
        _columns, _nominal, _passed  # gradients, answers, and what forces take, dim dim numbers a row
        _weights, _means  # of blocks, a number a row
        _averaged         # gradients once more averaged, where means are found of them: they stand where nothing else is yet
        holding           # forces per mass that hold spurious modes
        """
        host, space, arrays = made.host, made.host.space, self._arrays
        self._tables = [Table.of(rows.runs.blocks, arrays, "blocks")]
        if rows.blocks is not None:
            self._tables.append(Table.of(rows.blocks.runs, arrays, "means"))
        if self.form.total and state.derived is not None:
            # No step reads the derived fields, and what loops pass on may stand in their place.
            state.derived.tell = self.refresh
        if not rows.shared:
            buffer = arrays.zeros("passed on", rows.size, space.scalar)
        elif state.derived is None:
            raise TypeError("the stress of a total law is a derived field")
        else:
            buffer = state.derived.buffer
        long, stride, at = space.dim**2 * rows.stride, rows.stride, rows.numbers
        starts = 0, long if rows.apart else rows.columns, rows.columns
        self._nominal, self._passed, self._columns = (_view(buffer, space, start, long) for start in starts)
        self._averaged = self._passed if self.form.total else self._columns
        blocks = 2 * self.form.blocks
        self._weights, self._means = (
            _view(buffer, space, at + k * stride, stride) if blocks else self._columns for k in range(2)
        )
        left = _view(buffer, space, at + blocks * stride, stride) if self.form.fades >= 0 else self._columns
        own = arrays.of("volume", self._placement.volume, space.scalar), left
        steps = rows.boxes.steps(host.scales.length)
        self.grid = grid_of(space, steps, rows.boxes.axes, made.stabilisation, stride, own)
        self.holding: Array = arrays.zeros("holding", made.placement.count if self.form.holds else 1, space.vec)

    def own_parts(self, state: State, arrays: Arrays) -> dict[str, Attached]:
        """What the stabilisation has of its own on the device."""
        flow = self._constitutive.flow
        if flow is None or self.form.fades < 0:
            return {}
        space, count = self._space, (self._tables[0].count, self._placement.count)
        fade = fade_kernel(space, self._layout, flow[0], grid_struct(space), held_of_nodes(space))
        part, rows = arrays.part("fading"), self._tables[0].rows
        whole = partial(own_sum, share=self._placement.share, domain=self._domain)
        return {"fading": RowFading(fade, flow, self.grid, rows, count, state, self._clock, part, whole)}

    @property
    def pairs(self) -> int:
        """Directed pairs of its own particles, as many as a list would have."""
        share = self._placement.share
        return self._ends if share.complete else self.neighbours.within(share.own)

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
            if not self.form.total:
                refuse_other(state)
                self._run(self._flow(state, out, ahead), self._flows)

    def refresh(self, state: State) -> None:
        """Deformation and, of a total law, stress of a state from its displacement (launches)."""
        stages = self._answers(state)
        if self.form.total:
            means = [self._means, self._weights] if self.form.blocks else []
            inputs = [self._constitutive.params, self.grid], [self._columns, *means]
            stages[-1] = Stage(self.kernels.tell, *inputs, [state.struct])
        for stage in stages:
            table = self._tables[stage.means]
            self._start(stage, table.rows, table.count)
        if state.derived is not None:
            state.derived.of = state

    def _run(self, stages: list[Stage], order: Order) -> None:
        """Launch stages, piece by piece."""
        order.run([partial(self._start, stage) for stage in stages], self._clock)

    def _start(self, stage: Stage, rows: Array, blocks: int) -> None:
        """Launch a stage over the rows of some blocks."""
        self._launch(stage.kernel, blocks, [*stage.before, rows, *stage.after], stage.outputs)

    def _gradient(self, field: Array, out: Array) -> Stage:
        """Columns of the gradient of a field."""
        return Stage(self.kernels.gradient, [self.grid], [field], [out])

    def _answers(self, state: State) -> list[Stage]:
        """From the displacements of a state to what its nodes answer, by columns."""
        grid, made, law, fields = self.grid, self.kernels, self._constitutive.params, state.struct
        columns, weights, means, nominal = self._columns, self._weights, self._means, self._nominal
        gradient = self._gradient(cast(Fields, fields).displacement, columns)
        if self.form.total and self.form.blocks:
            # Pulls stand where weights do in a law of rates: here these are the nodes' own volumes.
            averaged, pulls = self._averaged, weights
            return [
                gradient,
                Stage(made.volume, [grid], [columns], [averaged, means]),
                Stage(made.mean, [], [grid.volume], [means], True),
                Stage(made.pull, [law, grid], [averaged, means, fields], [nominal, pulls]),
                Stage(made.mean, [], [grid.volume], [pulls], True),
                Stage(made.close, [grid], [averaged, means, pulls], [nominal]),
            ]
        if self.form.total:
            return [gradient, Stage(made.answer, [law, grid], [columns, fields], [nominal])]
        strain = Stage(made.strain, [self._coefficients, grid], [columns, means], [fields, nominal, self.grid.left])
        if not self.form.blocks:
            return [gradient, strain]
        current = Stage(made.current, [grid], [columns], [fields, weights, means])
        return [gradient, current, Stage(made.mean, [], [weights], [means], True), strain]

    def _flow(self, state: State, out: State, ahead: float) -> list[Stage]:
        """From the velocities of a state to the rates of stress and internals. Answers are not needed by then, and gradients
        stand in their place."""
        fields, time, grid, made = state.struct, [self._clock.time, self._space.scalar(ahead)], self.grid, self.kernels
        weights, means, gradients, columns = self._weights, self._means, self._nominal, self._nominal
        stages = [self._gradient(cast(Fields, fields).velocity, gradients)]
        if self.form.blocks:
            columns = self._averaged
            outputs = [columns, weights, means]
            stages.append(Stage(made.dilation, [*time, grid], [gradients, fields], outputs))
            stages.append(Stage(made.mean, [], [weights], [means], True))
        law = self._constitutive.params
        return [*stages, Stage(made.flow, [*time, law, grid], [columns, means, fields], [out.struct])]

    def _sum_forces(self, body: object, loads: list[Array], state: State, out: State) -> None:
        if state.derived is not None:
            state.derived.of = None if self.form.total else state
        grid, columns, passed = self.grid, self._columns, self._passed
        spread = Stage(self.kernels.spread, [grid], [columns, self._nominal], [passed])
        before, after = [body, self._coefficients, grid], [columns, passed, *loads, state.struct]
        force = Stage(self.kernels.force, before, after, [self.holding, out.struct])
        self._run([*self._answers(state), spread, force], self._forces)

    def held_energy(self, state: State) -> float:
        """Energy of the residual of a state, nondimensional (a launch and a copy)."""
        if not self.form.stabilised:
            return 0.0
        sums: Array = wp.zeros(self._tables[0].count, dtype=wp.float64, device=self._clock.device)
        made = held_kernel(self._space, self._layout, self.form.fades >= 0)
        inputs = [self.grid, self._tables[0].rows, state.struct]
        wp.launch(made, len(sums), inputs=inputs, outputs=[sums], device=self._clock.device)
        first = self._tables[0].blocks[:, FIRST]
        return own_total(sums, first, self._placement.share, self._domain)


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
    system = OneSetSystem(setup, partial(EdgeRates, rows), rows.size if rows.shared else 0)
    system.regular, system.segmented = 1.0, rows.segmented(setup.space)
    return system
