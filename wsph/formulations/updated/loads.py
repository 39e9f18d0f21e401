"""Loads on the faces of a body whose particles are its cells.

A uniform stress acts on a particle with sigma b_i, b_i = sum w (V_i M_i + V_j M_j) r, which is zero inside and, near a face,
not that face's area on the first layer and nothing on the next: three layers and more have a share, of either sign. A load
that equilibrium is to answer with one stress acts on the layers in the same shares, -n . b_i, as found at the start. As the
body stretches by e the shares change: the stress beside a loaded face is then one value to e/2.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from math import ceil

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.boundary.conditions import Conditions
from wsph.boundary.loads.rows import FaceLoad
from wsph.boundary.programs.prescribed import Prescribed, varies
from wsph.boundary.walls import Wall, cell_index
from wsph.formulations.updated.images import Kind, find_images, kinds_of, shifts_of
from wsph.geometry.lattice import Lattice
from wsph.output.fields import AXES
from wsph.parts.part import Host
from wsph.sph.pairs import find_pairs
from wsph.sph.rows import rows_of, rows_struct
from wsph.sph.smoothing import SMOOTHING, SUPPORT


@cache
def _sums_kernels(dim: int, smoothing: str) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels of the second moments of pairs, and of the sums b_i from V M of the targets and of the sources."""
    space = Space(dim)
    real, vec, mat, Rows, slope = space.scalar, space.vec, space.mat, rows_struct(space), SMOOTHING[smoothing](space)[1]
    module = space.module(f"face_sums.{smoothing}")

    @kernel(module=module)
    def second(
        h: real, rows: Rows, place: wp.array(dtype=vec), sources: wp.array(dtype=vec), moment_out: wp.array(dtype=mat)
    ):
        i = wp.tid()
        moment = mat()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            r = sources[rows.indices[k]] - place[i]
            moment += -slope(wp.length(r) / h) * wp.outer(r, r)
        moment_out[i] = moment

    @kernel(module=module)
    def share(
        h: real,
        rows: Rows,
        place: wp.array(dtype=vec),
        sources: wp.array(dtype=vec),
        own: wp.array(dtype=mat),
        other: wp.array(dtype=mat),
        sum_out: wp.array(dtype=vec),
    ):
        i = wp.tid()
        total = vec()
        for k in range(rows.offsets[i], rows.offsets[i + 1]):
            j = rows.indices[k]
            r = sources[j] - place[i]
            total += -slope(wp.length(r) / h) * ((own[i] + other[j]) * r)
        sum_out[i] = total

    return second, share


def face_sums(
    host: Host,
    lattice: Lattice,
    some: np.ndarray,
    images: tuple[Sequence[Kind], np.ndarray],
    middle: np.ndarray,
    device: str,
) -> np.ndarray:
    """b_i of `some` cells of a lattice (k,) as they see each other at the start, and images of some kinds, which stand at
    (kinds, dim) about a `middle` (dim,) [m], (k, dim), in spacings^(dim - 1)."""
    kinds, shifts = images
    space = Space(host.space.dim)
    unit, h = lattice.spacing, host.support / SUPPORT
    place = (lattice.cells[some] - middle) / unit
    volume = lattice.cell_volume[some] / unit**space.dim
    sources, parent, turns = place, np.arange(len(place)), np.tile(np.eye(space.dim), (len(place), 1, 1))
    pairs = find_pairs(place, place, host.support, device, same=True)
    if kinds:
        shifts = shifts / unit
        there_are = [replace(kind, columns=kind.columns[some]) for kind in kinds]
        beyond, of, number = find_images(there_are, shifts, place, host.support, device)
        turn = np.stack([kind.turn for kind in kinds])[number]
        there = np.einsum("nab,nb->na", turn, place[of]) + shifts[number]
        sources, parent, turns = (
            np.concatenate([place, there]),
            np.concatenate([parent, of]),
            np.concatenate([turns, turn]),
        )
        rows = np.concatenate([pairs.rows(), beyond.rows()])
        indices = np.concatenate([pairs.indices.numpy(), beyond.indices.numpy() + len(place)])
        order = np.argsort(rows, kind="stable")
        offsets = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=len(place)))])
        pairs = replace(
            pairs,
            offsets=wp.array(offsets, dtype=wp.int32, device=device),
            indices=wp.array(indices[order], dtype=wp.int32, device=device),
            sources=len(sources),
        )
    second, share = _sums_kernels(space.dim, host.smoothing)
    moment, total = (wp.zeros(len(place), dtype=dtype, device=device) for dtype in (space.mat, space.vec))
    places = [wp.array(points, dtype=space.vec, device=device) for points in (place, sources)]
    inputs = [h, rows_of(space, pairs), *places]
    wp.launch(second, len(place), inputs=inputs, outputs=[moment], device=device)
    own = volume[:, None, None] * np.linalg.pinv(moment.numpy(), hermitian=True)
    other = turns @ own[parent] @ turns
    weights = [wp.array(values, dtype=space.mat, device=device) for values in (own, other)]
    wp.launch(share, len(place), inputs=[*inputs, *weights], outputs=[total], device=device)
    return total.numpy()


def spread_loads(conditions: Conditions, host: Host, walls: list[Wall], device: str) -> None:
    """Let prescribed loads act on the layers beside their faces, each with its share; those on walls stay on the first."""
    if not conditions.loads:
        return
    lattice, deep = host.lattice, ceil(2.0 * host.support)
    low, high = lattice.split.layers
    # Behind its own faces it looks as deep as columns are, and there as far as moments are of.
    wide = lattice.wider((low - 2 * deep - 1, high + 2 * deep + 1))
    faces, spread = lattice.faces, list[FaceLoad]()
    loads = [load.where(lattice.own_faces[load.face]) for load in conditions.loads]
    loaded = np.unique(np.concatenate([load.face for load in loads]))
    planes = np.stack([faces.axis[loaded], cell_index(lattice)[faces.cell[loaded], faces.axis[loaded]]], 1)
    columns = _Columns(host, wide, [wall.of(wide) for wall in walls], np.unique(planes, axis=0), deep, device)
    for load in loads:
        side = np.stack([faces.axis[load.face], faces.sign[load.face]], 1)
        # Each of two opposite faces by itself: both together have no resultant.
        for each in np.unique(lattice.split.domain.joined(side), axis=0):
            rows = (side == each).all(1)
            spread.append(_spread(load.where(rows), (int(each[0]), int(each[1])), columns, lattice))
    conditions.loads[:] = spread


def _spread(load: FaceLoad, side: tuple[int, int], columns: "_Columns", lattice: Lattice) -> FaceLoad:
    """A load on a part's own faces that lie one way, on the cells of the part that are behind faces of any."""
    domain, held = lattice.split.domain, lattice.split.points
    cells = lattice.faces.cell[load.face] + held.first
    shares = [columns.shares(cell, side, load.value) for cell in cells.tolist()]
    many = np.array([len(behind) for behind, _ in shares], int)
    centre = lattice.nodes[lattice.faces.nodes[load.face]].mean(1)
    # What keeps moments is of all faces together, in the order of their cells.
    numbers, many, centre, push = (domain.joined(each) for each in (cells, many, centre, load.push))
    cell = domain.joined(np.array([each for behind, _ in shares for each in behind], np.int64))
    parts = [share for _, share in shares]
    share = domain.joined(np.concatenate(parts) if parts else np.zeros(0))
    place = domain.joined(columns.places(shares))
    row, order = np.repeat(np.arange(len(many)), many), np.argsort(numbers, kind="stable")
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    rows = np.argsort(rank[row], kind="stable")
    many, centre, push, row = many[order], centre[order], push[order], rank[row][rows]
    cell, share, place = cell[rows], share[rows], place[rows]
    size, deep = np.linalg.norm(push, axis=1), many[row] > 1
    if deep.any():
        across, faces = columns.lever(push[0] / size[0], side[0]), many > 1
        places = place[deep] @ across, centre[faces] @ across
        share[deep] = _kept_moments(share[deep], *places, size[row[deep]], size[faces])
    there = held.stands(cell)
    here = there >= 0
    return FaceLoad(load.value, there[here], (share[:, None] * push[row])[here], np.full(here.sum(), -1), load.owner)


def _kept_moments(
    share: np.ndarray, place: np.ndarray, centre: np.ndarray, size: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """Shares (r,) at `place` (r, dim) of loads of `size` (r,), changed as little as makes up for what corners leave: the
    resultant and the moments are those of faces of `area` (f,) at `centre` (f, dim), to the last digit."""
    middle, length = centre.mean(0), max(float(np.ptp(place, axis=0).max()), 1e-300)
    linear = [np.column_stack([np.ones(len(x)), (x - middle) / length]) for x in (place, centre)]
    missing = linear[1].T @ area - linear[0].T @ (size * share)
    weighted = (size * np.abs(share))[:, None] * linear[0]
    return share + np.abs(share) * (linear[0] @ (np.linalg.pinv(linear[0].T @ weighted, hermitian=True) @ missing))


class _Columns:
    """The cells of a lattice behind each of some faces, inward, so many `deep` at most, and the sums b_i of the cells."""

    def __init__(self, host: Host, lattice: Lattice, walls: list[Wall], planes: np.ndarray, deep: int, device: str):
        """`planes` (p, 2): the axes that the faces are across, and the layers along these of the cells that they are of."""
        self._frame, self._depth, first = lattice.frame, deep, lattice.split.points.first
        index, dim, cell = cell_index(lattice), len(lattice.frame.step), lattice.faces.cell
        near = np.zeros(len(index), bool)
        for axis, layer in planes.tolist():
            near |= np.abs(index[:, axis] - layer) <= 2 * deep + 1
        some = np.flatnonzero(near)
        self._number, self._index, self._cells = first + some, index[some], lattice.cells[some]
        self._low, self._sides = (
            index.min(0) - 1,
            Counter(zip((first + cell).tolist(), lattice.faces.axis.tolist(), strict=True)),
        )
        self._extent = tuple((index.max(0) - self._low + 2).tolist())
        self._keys = self._key(self._index)
        kinds, middle = kinds_of(walls, lattice.split.domain), lattice.middle  # of all processes
        images = kinds, shifts_of(kinds, walls, middle)
        self._sums = face_sums(host, lattice, some, images, middle, device) if len(some) else np.zeros((0, dim))
        walled = set[tuple[int, int]]()
        for wall in walls:
            over = np.flatnonzero(wall.columns)
            over = over[(wall.point - lattice.cells[over]) @ wall.normal < lattice.spacing]
            walled |= {(wall.axis, number) for number in (first + over).tolist()}
        self._walled = walled
        self._beside = [[wall.normal for wall in walls if wall.axis != axis] for axis in range(dim)]

    def _key(self, index: np.ndarray) -> np.ndarray:
        """Numbers of places in the grid (..., dim), which ascend with those of the cells."""
        return np.ravel_multi_index(tuple(np.moveaxis(index - self._low, -1, 0)), self._extent)

    def _at(self, index: np.ndarray) -> int | None:
        """The cell at a place in the grid (dim,), None where there is none."""
        key = self._key(index)
        row = int(np.searchsorted(self._keys, key))
        return row if row < len(self._keys) and self._keys[row] == key else None

    def lever(self, direction: np.ndarray, axis: int) -> np.ndarray:
        """The projection of places (dim, dim) on what makes moments of a push along `direction` (dim,) of faces across an
        axis: across it, and along walls beside the faces, behind which these go on and which answer for moments."""
        rest = np.eye(len(direction)) - np.outer(direction, direction)
        for normal in self._beside[axis]:
            rest = rest @ (np.eye(len(direction)) - np.outer(normal, normal))
        return rest

    def places(self, shares: Sequence[tuple[list[int], np.ndarray]]) -> np.ndarray:
        """Where cells are that share loads, as `shares` has them, (r, dim) [m]."""
        numbers = np.array([cell for cells, _ in shares for cell in cells], np.int64)
        return self._cells[np.searchsorted(self._number, numbers)]

    def shares(self, number: int, side: tuple[int, int], value: Prescribed) -> tuple[list[int], np.ndarray]:
        """The cells that share a load on a face of a cell, across an axis and with a sign of its normal, by their numbers in
        the whole body, and their shares."""
        axis, sign = side
        inward = AXES if not self._frame.upright else AXES[axis]
        if self._sides[number, axis] > 1 or varies(value, inward) or (axis, number) in self._walled:
            return [number], np.ones(1)
        normal = sign * self._frame.axes[:, axis]
        step = -sign * np.eye(len(normal), dtype=int)[axis]
        column = [int(np.searchsorted(self._number, number))]
        while (behind := self._at(self._index[column[-1]] + step)) is not None:
            column.append(behind)
            if len(column) == 2 * self._depth:
                break
        column = column[: min(self._depth, -(-len(column) // 2))]
        return self._number[column].tolist(), -self._sums[column] @ normal
