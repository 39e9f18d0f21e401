"""The operators between the two sets of a body: weights of what each particle sees of the other set.

A particle inside of a lattice sees the 2^dim of the other set around it, each with a weight of one over their number, and
its gradients are differences along the axes: its row follows from the lattice, and needs no list. Where weights are others,
as at faces, whose nodes have less volume, along cracks or with a larger support, there are lists, beside such rows too.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import replace

import numpy as np
import warp as wp

from wsph.backend.arrays import host
from wsph.backend.domain import Domain, Share
from wsph.backend.space import Array, Space
from wsph.formulations.lattice.block_rates import width_of
from wsph.formulations.lattice.lanes import ACROSS, capacity_of, corner_signs
from wsph.formulations.lattice.runs import FIRST, HEAD, OWN, gathered_runs
from wsph.formulations.taylor.sums.gather import operator_struct
from wsph.geometry.lattice import Lattice
from wsph.sph.pairs import Pairs
from wsph.sph.weights import Weights

FEWEST = {1: 1000, 2: 200, 3: 150}
"""Rows of an operator that follow from the lattice from which they pay, by the dimension: a step has two launches more, of
half a microsecond each. Microseconds a step, elastic in double precision, with them and by lists alone: in 1D 1.5 and 1.4 of
31 particles, 2.3 and 2.6 of 101; in 2D 6.5 and 5.8 of 169, 12 and 14 of 441; in 3D 34 and 31 of 343, 64 and 67 of 729
(tests/benchmarks/rows.py tells of larger ones). Kernels of rows take two seconds more to compile, once: a short bar, whose
run takes no longer, is better off without."""

SHORTEST = 6.0
"""Mean length of their runs from which they pay: a block of fewer rows does not fill a vector."""

_MOST = np.iinfo(np.int32).max

CORNERS = 0.25
"""Second moment of the mean of the corners of a cell [spacings squared]."""

ROUNDINGS = 64.0
"""Within so many rounding units weights are those of a lattice; what differs does so by a tenth."""


def lattice_rows(interpolation: Weights, gradient: Weights) -> np.ndarray:
    """What targets see whose weights are those of the middle of 2^dim equal sources, to rounding, (targets, 2^dim) int32, in
    the order of the corners of a cell; -1 of all other targets. Gradients are those in coordinates of the grid."""
    offsets, indices = host(interpolation.pairs.offsets), host(interpolation.pairs.indices)
    weight, slope = host(interpolation.values), host(gradient.values)
    dim, corners, within = slope.shape[1], 2 ** slope.shape[1], ROUNDINGS * float(np.finfo(weight.dtype).eps)
    rows = np.flatnonzero(np.diff(offsets) == corners)
    found = np.full((len(rows), corners), -1, np.int32)
    alike = np.ones(len(rows), bool)
    for k in range(corners):
        at = offsets[rows] + k
        g = slope[at]
        alike &= np.abs(corners * weight[at] - 1.0) < within
        alike &= (np.abs(0.5 * corners * np.abs(g) - 1.0) < within).all(1)
        found[np.arange(len(rows)), (g > 0.0) @ 2 ** np.arange(dim)[::-1]] = indices[at]
    # What is behind a row along the last axis is before the next: a line of them is read once.
    alike &= (found >= 0).all(1) & (found[:, 1::2] == found[:, ::2] + 1).all(1)
    near = np.full((interpolation.pairs.targets, corners), -1, np.int32)
    near[rows[alike]] = found[alike]
    return near


class Operator:
    """From one set to the other, nondimensional and along the coordinate axes.

    listed                   # targets that have lists, (k,)
    interpolation, gradient  # their weights
    rows                     # the lists as kernels take them
    regular                  # targets of the whole body whose rows follow from the lattice
    few                      # rows follow from the lattice, but in such a way that they do not pay
    table                    # blocks of the other rows (`wsph.formulations.lattice.runs`), flat; None where there are none
    across                   # rows of a block, but where a run ends
    slope                    # dim x dim: their differences along the axes of the grid, summed, times it are the gradient
    lists, threads           # rows of the lists, and threads over the blocks, of the targets that steps are to reach
    """

    def __init__(
        self,
        space: Space,
        weights: tuple[Weights, Weights],
        turn: np.ndarray | None,
        near: np.ndarray,
        device: str,
        share: Share,
        domain: Domain,
    ):
        """`weights` in coordinates of the grid; `turn` (dim, dim) brings gradients to lengths and to the coordinate axes,
        None where they are that; `near` as `lattice_rows` says it; `share`: the targets that are here."""
        self._space, self.targets, self._share, dim = space, weights[0].pairs.targets, share, space.dim
        self._turn = np.eye(dim) if turn is None else turn
        width = width_of(device, space.precision)
        self._threads = ACROSS if width == 1 else 1
        self.across = ACROSS if width == 1 else capacity_of(width)
        blocks = gathered_runs(near, weights[0].pairs.sources, self.across)
        # Of the whole body: which kernel a row has must not depend on where it is cut.
        mine = np.count_nonzero(near[share.own, 0] >= 0), np.count_nonzero(share.owns(blocks[:, FIRST]))
        many, number = (int(each) for each in domain.sum(np.array(mine)))
        self.few = 0 < many < max(FEWEST[dim], SHORTEST * number)
        self._blocks = blocks[:0] if self.few else blocks
        self.regular = 0 if self.few else many
        self.listed = np.arange(self.targets, dtype=np.int32)
        if self.regular:
            self.listed = np.flatnonzero(near[:, 0] < 0).astype(np.int32)
            pairs, where = weights[0].pairs.only(self.listed)
            weights = _only(weights[0], pairs, self.listed, where), _only(weights[1], pairs, self.listed, where)
        self.interpolation, self.gradient = weights
        if turn is not None:
            self.gradient = self.gradient.mapped(space, turn)
        self.table: Array | None = None
        if self.regular:
            self.table = wp.array(self._blocks.ravel(), dtype=wp.int32, device=device)
        self.slope = space.mat(*(self._turn.T * 0.5 ** (dim - 1)).ravel().tolist())
        self.rows = operator_struct(space)()
        self.rows.offsets, self.rows.indices = self.interpolation.pairs.offsets, self.interpolation.pairs.indices
        self.rows.weight, self.rows.gradient = self.interpolation.values, self.gradient.values
        if self.regular:
            self.rows.targets = wp.array(self.listed, dtype=wp.int32, device=device)
        self.lists, self.threads = slice(0, len(self.listed)), slice(0, len(self._blocks) * self._threads)

    def reach(self, targets: slice) -> None:
        """From now on steps are to reach some of the targets, from one up to another: those, and what shares blocks with
        them."""
        low, high = np.searchsorted(self.listed, [targets.start, targets.stop])
        self.lists = slice(int(low), int(high))
        first, many = self._blocks[:, FIRST], self._blocks[:, OWN]
        low, high = np.searchsorted(first + many, targets.start, side="right"), np.searchsorted(first, targets.stop)
        self.threads = slice(int(low) * self._threads, int(high) * self._threads)

    def sees(self, targets: slice) -> slice:
        """The sources that some targets see, both from one up to another."""
        low, high = np.searchsorted(self.listed, [targets.start, targets.stop])
        ends = host(self.interpolation.pairs.offsets)[[low, high]]
        listed = host(self.interpolation.pairs.indices)[ends[0] : ends[1]]
        first, end = self._blocks[:, FIRST], self._blocks[:, FIRST] + self._blocks[:, OWN]
        here = (end > targets.start) & (first < targets.stop)
        around = self._blocks[here, HEAD : HEAD + 2**self._space.dim]
        begin = around.min(1, initial=_MOST) + np.maximum(targets.start - first[here], 0)
        last = around.max(1, initial=0) + np.minimum(targets.stop, end[here]) - first[here] - 1
        found = np.concatenate([listed, begin, last])
        return slice(int(found.min()), int(found.max()) + 1)

    @property
    def pairs(self) -> int:
        """Directed pairs of a process's own targets, as many as lists of all would have."""
        low, high = np.searchsorted(self.listed, [self._share.own.start, self._share.own.stop])
        ends = host(self.interpolation.pairs.offsets)[[low, high]]
        return int(ends[1] - ends[0]) + 2**self._space.dim * int(self._share.high - self._share.low - (high - low))

    @property
    def spared(self) -> int:
        """Bytes that a row which follows from the lattice does without: a list, its support, and that it is one."""
        number = np.dtype(self._space.numpy).itemsize
        return 2**self._space.dim * (4 + (1 + self._space.dim) * number) + 16

    def arrays(self) -> dict[str, Array]:
        """The arrays on the device, by their names."""
        found = {"interpolation": self.interpolation.values, "gradient": self.gradient.values}
        found |= {part: getattr(self.interpolation.pairs, part) for part in ("offsets", "indices", "reach")}
        return found if self.table is None else found | {"blocks": self.table, "targets": self.rows.targets}

    def whole(self) -> tuple[Weights, Weights]:
        """Weights of all targets, made on the host where rows have none: for what looks at a body now and then."""
        if not self.regular:
            return self.interpolation, self.gradient
        space, dim, corners = self._space, self._space.dim, 2**self._space.dim
        many = np.full(self.targets, corners)
        many[self.listed] = np.diff(host(self.interpolation.pairs.offsets))
        offsets = np.concatenate([[0], np.cumsum(many)])
        own = self._blocks[:, OWN]
        along = np.arange(own.sum()) - np.repeat(np.cumsum(own) - own, own)
        first = np.repeat(self._blocks[:, FIRST], own) + along
        indices, weight = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], space.numpy)
        slope = np.empty((offsets[-1], dim), space.numpy)
        signs = 0.5 ** (dim - 1) * np.array(corner_signs(dim)) @ self._turn.T
        for c in range(corners):
            at = offsets[first] + c
            indices[at], weight[at], slope[at] = np.repeat(self._blocks[:, HEAD + c], own) + along, 0.5**dim, signs[c]
        row = self.interpolation.pairs.rows()
        at = offsets[self.listed][row] + np.arange(len(row)) - host(self.interpolation.pairs.offsets)[row]
        indices[at], weight[at] = host(self.interpolation.pairs.indices), host(self.interpolation.values)
        slope[at] = host(self.gradient.values)
        starts, sources = (wp.array(each, dtype=wp.int32, device="cpu") for each in (offsets, indices))
        reach = wp.zeros(self.targets, dtype=wp.float64, device="cpu")
        pairs = Pairs(starts, sources, self.targets, self.interpolation.pairs.sources, reach)

        def of(part: Weights, values: np.ndarray, dtype: type) -> Weights:
            rank = np.full(self.targets, dim, np.int32)
            rank[self.listed] = part.rank
            return Weights(pairs, wp.array(values, dtype=dtype, device="cpu"), rank)

        return of(self.interpolation, weight, space.scalar), of(self.gradient, slope, space.vec)


def _only(weights: Weights, pairs: Pairs, targets: np.ndarray, where: np.ndarray) -> Weights:
    values = host(weights.values)[where]
    kept = wp.array(values, dtype=weights.values.dtype, device=weights.values.device)
    return replace(weights, pairs=pairs, values=kept, rank=weights.rank[targets])


def smallest_moment(operator: Operator, lattice: Lattice, share: Share, domain: Domain) -> float:
    """Smallest second moment of the interpolation to a virtual particle of the whole body, in spacings squared. `share`: the
    virtual particles that are here."""
    weights, listed, on_face = operator.interpolation, operator.listed, lattice.on_face
    indices, values, row = host(weights.pairs.indices), host(weights.values), weights.pairs.rows()
    nodes, cells = lattice.centred
    r = nodes[indices] - cells[listed][row]
    moment = np.zeros((len(listed), r.shape[1], r.shape[1]))
    np.add.at(moment, row, values[:, None, None] * r[:, :, None] * r[:, None, :])
    # One-sided neighbourhoods at the faces have smaller moments and grow nothing: where there is an interior it decides.
    # In a body of one or two cells across there is none; the moments along the axes leave out the corners' skewness.
    at_face = np.bincount(row, on_face[indices], len(listed)) > 0
    own, inner = share.owns(listed), np.delete(np.arange(operator.targets), listed)
    inner = inner[share.owns(inner)]
    initial = CORNERS if (~on_face[lattice.corners[inner]]).all(1).any() else np.inf
    smallest = np.linalg.eigvalsh(moment[own & ~at_face])[:, 0].min(initial=initial)
    along = np.einsum("nii->ni", moment[own]).min(initial=CORNERS)
    smallest, along = domain.min(np.array([smallest, along])).tolist()
    return along if smallest == np.inf else smallest
