"""The rows of a body whose nodes see each other along edges, and the numbers that its loops pass on."""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass

import numpy as np

from wsph.backend.space import Space
from wsph.formulations.lattice.block_rates import PIECE_BYTES, width_of
from wsph.formulations.lattice.edges.blocks import BlockRuns, block_runs
from wsph.formulations.lattice.lanes import ACROSS
from wsph.formulations.lattice.pieces import Takes
from wsph.formulations.lattice.runs import FIRST, HEAD, VECTOR, EdgeRuns, edge_runs
from wsph.formulations.one_set_setup import is_stabilised
from wsph.formulations.system import Segmented
from wsph.geometry.cells import Boxes
from wsph.parts.part import Host


@dataclass(frozen=True)
class Rows:
    """The rows of a body of `boxes`: their `runs`, and those of the `blocks` that share a volume, rows a thread computes,
    threads a block, and where in an array what loops pass on begins, `stride` numbers each: answers at zero, gradients at
    `columns`, numbers by row at `numbers`. What forces take stands over the gradients, unless it is `apart`; `shared`: that
    array is the buffer of the derived fields, which no step needs."""

    boxes: Boxes
    runs: EdgeRuns
    blocks: BlockRuns | None
    width: int
    threads: int
    stride: int
    apart: bool
    columns: int
    numbers: int
    size: int
    shared: bool

    def piece(self, number: int) -> int:
        """Blocks whose numbers, of so many bytes, stay in a core's cache until the next loop takes them; all, where a
        thread has a row."""
        if self.width == 1:
            return len(self.runs.blocks)
        return max(PIECE_BYTES // (number * self.width * self.boxes.axes.size), 1)

    @property
    def around(self) -> list[Takes]:
        """Of which blocks of rows the runs of blocks take, and of which of these the blocks of rows; none without them."""
        first, found = self.runs.blocks[:, FIRST], self.blocks
        if found is None:
            return []
        to_means = (np.searchsorted(first, each, side="right") - 1 for each in (found.first, found.last))
        to_rows = (each.reduceat(found.run, first) for each in (np.minimum, np.maximum))
        return [Takes(*to_means), Takes(*to_rows)]

    def segmented(self, space: Space) -> Segmented:
        """The memory of the blocks, two of the body's of one row."""
        columns = 4 * (HEAD + 2**space.dim)
        spare = 2 * columns + VECTOR * np.dtype(space.numpy).itemsize
        shared = 0 if self.blocks is None else 4 * (1 + 2**space.dim) // 2 ** (space.dim - 1)
        return Segmented(self.width * self.threads, 0, 0, columns + shared, 0, spare)

    @classmethod
    def of(cls, host: Host, boxes: Boxes, device: str) -> "Rows":
        """The rows of a body, for kernels on a device."""
        dim, width, n = host.space.dim, width_of(device, host.space.precision), len(boxes.index)
        across, total = ACROSS if width == 1 else width, host.constitutive.laws.total is not None
        # Caches have few places for what is a power of two apart.
        stride = n + VECTOR * (n % 64 == 0)
        blocks = block_runs(host.lattice.index, across // 2) if host.locks or host.flows else None
        paired = any(part.acts and part.pair_term(host) is not None for part in host.parts.values())
        fades, shared = host.constitutive.flow is not None and is_stabilised(host), total and not host.stressed
        apart = paired or (total and blocks is not None)
        # Gradients are read where the derived fields are written.
        derived = n * (dim**2 + host.constitutive.width) if shared else 0
        columns = max((1 + apart) * dim**2 * stride, derived)
        numbers = columns + dim**2 * stride
        size = numbers + (2 * (blocks is not None) + fades) * stride + VECTOR
        return cls(
            boxes,
            edge_runs(boxes, across),
            blocks,
            width,
            across // width,
            stride,
            apart,
            columns,
            numbers,
            size,
            shared,
        )
