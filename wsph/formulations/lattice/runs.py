"""Runs: rows of a lattice whose neighbours follow from those of the row before, by one.

Nodes and cells stand in the order of a grid, its last axis fastest: along a line of it the corners of a cell are those of
the cell before plus one. Lines are cut into segments of `width` nodes, at the same places in the whole body, and what the
cells of a line hand to the nodes of a segment stands in one chunk: the quantities one after the other, `width` + 2
numbers each. Place 0 is for the cell that ends where the segment begins, the last for one beyond it, of which a node at
the end of a line has none; places without a cell hold zeros, so that a node at a face sees as many places as one inside.

A block is a run of cells or of nodes within a segment, and what kernels take: one number for each corner says where the
neighbours of all its rows are. Runs end at holes, notches and cracks; a node beside a crack has a block of its own.
"""

# pyright: strict
# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false, reportUnknownVariableType=false

from dataclasses import dataclass
from itertools import product

import numpy as np

from wsph.formulations.lattice.pieces import Takes
from wsph.geometry.cells import Boxes, edge_ends

FIRST, OWN, COMPUTED, PLACE, COPY, BEFORE, BEHIND, HEAD = range(8)
"""Columns of a block: its first row; how many rows are its own, and over how many it may be computed: whole vectors are
faster than what is left of one, and rows that are not its own are read, never written. Of cells the place of the first,
in the chunks' numbers of the first quantity; the place where the last stands once more, -1 for none; how many places
before the first and behind the last it keeps zero. From HEAD on where the neighbours of the first row are: of cells
nodes, of nodes places."""

SHARES, OPENS, CLOSES = PLACE, BEFORE, BEHIND
"""Columns of a block of nodes that see each other along edges (`edge_runs`): what shares of their cells lie on which side,
four bits a number; whether the first has no edge before it in its line, and whether the last has none behind it."""

VECTOR = 8
"""Rows that are computed together."""


@dataclass(frozen=True)
class Runs:
    """Blocks of the cells and of the nodes of a lattice, int32, a row each, columns as above, and `chunks` that hold
    `places` numbers of every quantity. Those of cells are written whole in every evaluation, before the others: they
    begin behind what is reserved, and the very last is zero throughout."""

    cells: np.ndarray
    nodes: np.ndarray
    chunks: int
    places: int

    def taking(self, boxes: Boxes, nodes: int) -> Takes:
        """Of which blocks of `boxes` those of so many nodes take. Nodes beyond the grid take of none."""
        corners = boxes.corners
        order = (np.arange(len(corners)) if boxes.rows is None else boxes.rows).astype(np.int32)
        low, high = np.full(nodes, order[-1]), np.full(nodes, order[0])
        for k in range(corners.shape[1]):
            at = corners[:, k]
            low[at], high[at] = np.minimum(low[at], order), np.maximum(high[at], order)
        return Takes.of_rows(low, high, self.nodes[:, FIRST], self.cells[:, FIRST])


def runs_of(boxes: Boxes, counts: tuple[int, int], width: int, quantities: int, reserved: int = 0) -> Runs:
    """The runs of boxes, and of all nodes of their body, of which there are, with points, so many `counts`. Places are in
    numbers of an array of chunks, each `quantities` times as long as it has places; the first `reserved` numbers may be used
    for something else between two evaluations."""
    corners, sides, places, nodes = boxes.corners, boxes.corners.shape[1], width + 2, counts[0]
    # Numbers a column at a time, in 32 bits as kernels have them: of a large body a set-up takes little more than the body.
    low, lines, along = boxes.index.min(0), np.rint(np.ptp(boxes.index, axis=0)).astype(int) + 1, _last(boxes)
    line_of = np.zeros(len(along), np.int32)
    for k, count in enumerate(lines[:-1]):
        line_of = line_of * np.int32(count) + np.rint(boxes.index[:, k] - low[k]).astype(np.int32)
    along, line_of = (_of_nodes(boxes, nodes, each) for each in (along, line_of))
    # A node at the end of a line belongs to the segment before, where one begins with it.
    ends = np.ones(len(along), bool)
    for k in range(0, sides, 2):
        ends[corners[:, k]] = False
    segment, segments = (along - ends) // np.int32(width), int(along.max()) // width + 1
    first_line, cell_along = line_of[corners[:, 0]] * np.int32(segments), along[corners[:, 0]]
    own = first_line + cell_along // np.int32(width)
    keys, long = np.unique(own), quantities * places
    written = len(keys)
    others = np.unique(np.concatenate([np.unique(first_line + segment[corners[:, k]]) for k in range(sides)]))
    keys = np.concatenate([keys, np.setdiff1d(others, keys)])
    beyond = max(-(-reserved // long) - written, 0)
    chunks = len(keys) + beyond + 1
    # Where the chunk of a line's segment begins; -1 of one that there is not.
    start = np.full(int(keys.max()) + 2, -1, np.int32)
    number = np.arange(len(keys), dtype=np.int32)
    start[keys] = (number + beyond * (number >= written)) * long

    place = start[own] + cell_along % np.int32(width) + np.int32(1)
    onward = ((cell_along + 1) % width == 0) & np.isin(own + 1, keys)
    copy = np.full(len(corners), -1, np.int32)
    copy[onward] = start[own[onward] + 1]
    cells = _cell_blocks(boxes, place, copy, own, (width, long, written), counts)
    occupied = np.zeros(chunks * long, bool)
    occupied[place], occupied[copy[onward]] = True, True
    near = np.full((nodes, sides), -1, np.int32)
    # Nodes beyond the grid see none of the boxes.
    joined, off = (np.diff(segment) == 0) & (np.diff(line_of) == 0) & (np.diff(along) == 1), line_of < 0
    if off.any():
        joined |= off[1:] & off[:-1] & ((boxes.before + np.arange(1, nodes)) % width > 0)
    for k in range(sides):
        at, column = corners[:, k], near[:, k]
        column[at] = start[first_line + segment[at]] + cell_along - segment[at] * np.int32(width) + np.int32(1)
        # Where a node sees no cell it may see the place of one, of the line that it would be on, if that is empty.
        none = np.flatnonzero((column < 0) & ~off)
        line = line_of[none] - (line_of[corners[0, k]] - line_of[corners[0, 0]])
        key = np.clip(line * segments + segment[none], -1, len(start) - 1)
        there = (start[key] >= 0) & (line >= 0) & (key >= 0)
        none, key = none[there], key[there]
        at = start[key] + along[none] - segment[none] * width + 1 - k % 2
        column[none] = np.where(occupied[at], -1, at)
        joined &= (np.diff(column) == 1) | ((column[1:] < 0) & (column[:-1] < 0))
        column[column < 0] = (chunks - 1) * long
    return Runs(cells, _blocks(near, joined, nodes - np.arange(nodes, dtype=np.int32)), chunks, places)


def gathered_runs(near: np.ndarray, sources: int, width: int) -> np.ndarray:
    """Blocks of rows that gather of `near` (n, k) int32 of so many sources and hand nothing on, as those of cells but for
    places and copies; rows whose `near` is -1 are in none. A run goes on where all that its rows gather of does, and is cut
    after every `width` rows."""
    there = near[:, 0] >= 0
    follows = there[1:] & there[:-1]
    for k in range(near.shape[1]):
        follows &= np.diff(near[:, k]) == 1
    first = np.concatenate([[0], 1 + np.flatnonzero(~follows)])
    within = np.arange(len(near)) - np.repeat(first, np.diff(np.append(first, len(near))))
    follows &= within[1:] % width > 0
    blocks = _blocks(near, follows, sources - near.max(1))
    return blocks[there[blocks[:, FIRST]]]


def _last(boxes: Boxes) -> np.ndarray:
    """Where nodes are along the last axis of the grid, from the first on, (n,) int32."""
    last = boxes.index[:, -1]
    return np.rint(last - (last.min() if boxes.first is None else boxes.first)).astype(np.int32)


def _of_nodes(boxes: Boxes, nodes: int, values: np.ndarray) -> np.ndarray:
    """Numbers (k,) of the nodes in the grid as those of all nodes, (n,): -1 of the others."""
    if len(values) == nodes:
        return values
    found = np.full(nodes, -1, values.dtype)
    found[slice(len(values)) if boxes.nodes is None else boxes.nodes] = values
    return found


@dataclass(frozen=True)
class EdgeRuns:
    """`blocks` of the nodes of a lattice that see each other along the edges of its cells, int32, a row each, how many
    ends of `edges` they see, and of which blocks each takes."""

    blocks: np.ndarray
    edges: int
    takes: Takes


def edge_runs(boxes: Boxes, width: int) -> EdgeRuns:
    """The runs of nodes whose cells are `boxes`, all of the body, for pairs along the edges of these.

    At every node each of its cells has one edge along each axis, so that the shares of the cells before and behind it add
    up to one on every axis, and what a node takes of its neighbours are these shares alone. Along a line they are the same
    while those of the other axes are; at its ends one is all and the other none, of rows that stand beside in memory.
    From HEAD on: where the neighbours before and behind are, axis by axis; a row itself where there is none."""
    corners, n, dim = boxes.corners, len(boxes.index), boxes.index.shape[1]
    offsets, own = np.array(list(product((0, 1), repeat=dim))), np.arange(n)
    near, cells = np.repeat(own[:, None], 2**dim, 1), np.zeros((n, 2 * dim), np.int64)
    for axis in range(dim):
        for low, high in zip(*edge_ends(offsets, axis), strict=True):
            near[corners[:, low], 2 * axis + 1], near[corners[:, high], 2 * axis] = corners[:, high], corners[:, low]
            cells[:, 2 * axis + 1] += np.bincount(corners[:, low], minlength=n)
            cells[:, 2 * axis] += np.bincount(corners[:, high], minlength=n)
    last = 2 * dim - 2
    near[1:, last], near[:-1, last + 1] = own[:-1], own[1:]
    behind, whole = cells[:, 1::2], cells[:, 0] + cells[:, 1]
    share = behind / whole[:, None]
    inner = (share[:, -1] > 0.0) & (share[:, -1] < 1.0)
    alike = (np.diff(share[:, :-1], axis=0) == 0.0).all(1) & (np.diff(near, axis=0) == 1).all(1)
    alike &= ~(inner[1:] & inner[:-1]) | (np.diff(share[:, -1]) == 0.0)
    segment = (_last(boxes) - (share[:, -1] == 0.0)) // width
    # What is before the first and behind the last row of all is not theirs to read.
    alike &= (share[:-1, -1] > 0.0) & (np.diff(segment) == 0) & (own[:-1] > 0) & (own[1:] < n - 1)
    blocks = _blocks(near, alike, n - near.max(1))
    first, many = blocks[:, FIRST], blocks[:, OWN]
    middle = first + ((share[first, -1] == 1.0) & (many > 1))
    numbers = [whole[first], *behind[first, :-1].T]
    packed = sum(number << 4 * k for k, number in enumerate(numbers))
    blocks[:, SHARES] = packed | (whole[middle] << 16) | (behind[middle, -1] << 20)
    blocks[:, OPENS], blocks[:, CLOSES] = share[first, -1] == 1.0, share[first + many - 1, -1] == 0.0
    return EdgeRuns(blocks, int(np.count_nonzero(cells)), Takes.of_rows(near.min(1), near.max(1), first, first))


def _cell_blocks(
    boxes: Boxes,
    place: np.ndarray,
    copy: np.ndarray,
    own: np.ndarray,
    sizes: tuple[int, int, int],
    counts: tuple[int, int],
) -> np.ndarray:
    """Blocks of cells. `place` (c,) and `copy` (c,) as the columns say, `own` (c,) the chunk of each; `sizes`: nodes of a
    segment, numbers of a chunk, and chunks that are written whole; `counts` of nodes and points."""
    (width, long, written), corners = sizes, boxes.corners
    follows, ahead = (np.diff(own) == 0) & (np.diff(place) == 1), counts[0] - corners.max(1)
    if boxes.rows is not None:
        follows &= np.diff(boxes.rows) == 1
        ahead = np.minimum(ahead, counts[1] - boxes.rows)
    for k in range(corners.shape[1]):
        follows &= np.diff(corners[:, k]) == 1
    blocks = _blocks(corners, follows, ahead)
    first, last = blocks[:, FIRST], blocks[:, FIRST] + blocks[:, OWN] - 1
    blocks[:, PLACE], blocks[:, COPY] = place[first], copy[last]
    # Blocks of a chunk in the order of their places: each keeps zero what is behind it, up to the next; the first what is
    # before it, but for a place that a cell of another chunk is copied to.
    low = blocks[:, PLACE] % long
    chunk, high = blocks[:, PLACE] // long, low + blocks[:, OWN]
    order = np.lexsort((low, chunk))
    opens = np.concatenate([[True], np.diff(chunk[order]) > 0])
    closes = np.concatenate([opens[1:], [True]])
    ahead = np.where(closes, width + 2, np.concatenate([low[order][1:], [0]]))
    blocks[order, BEHIND] = ahead - high[order]
    copied = np.zeros(written + 1, int)
    targets = copy[copy >= 0] // long
    copied[targets[targets < written]] = 1
    blocks[order, BEFORE] = np.where(opens, low[order] - copied[chunk[order]], 0)
    if boxes.rows is not None:
        blocks[:, FIRST] = boxes.rows[first]
    return blocks


def _blocks(near: np.ndarray, follows: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Blocks of rows with neighbours `near` (n, k), of which row i + 1 follows row i where `follows` (n - 1,) says so.
    `ahead` (n,): how many rows may be computed from one on before what they take ends."""
    first = np.concatenate([[0], 1 + np.flatnonzero(~follows)])
    own = np.diff(np.concatenate([first, [len(near)]]))
    whole = -(-own // VECTOR) * VECTOR
    made = np.zeros((len(first), HEAD + near.shape[1]), np.int32)
    made[:, FIRST], made[:, OWN], made[:, COMPUTED] = first, own, np.where(whole <= ahead[first], whole, own)
    made[:, COPY], made[:, HEAD:] = -1, near[first]
    return made
