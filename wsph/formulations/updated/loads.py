"""Loads on the faces of a body whose particles are its cells.

A uniform stress acts on a particle with sigma b_i, b_i = sum w (V_i M_i + V_j M_j) r, which is zero inside and, near a face,
not that face's area on the first layer and nothing on the next: three layers and more have a share, of either sign. A load
that equilibrium is to answer with one stress acts on the layers in the same shares, -n . b_i, as found at the start. As the
body stretches by e the shares change: the stress beside a loaded face is then one value to e/2.
"""

from collections import Counter
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
from wsph.boundary.walls import Wall
from wsph.formulations.updated.images import find_images, kinds_of, shifts_of
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


def face_sums(host: Host, walls: list[Wall], device: str) -> np.ndarray:
    """b_i of every cell at the start, images included, (cells, dim), in spacings^(dim - 1)."""
    lattice, space = host.lattice, Space(host.space.dim)
    unit, origin, h = lattice.spacing, lattice.cells.mean(0), host.support / SUPPORT
    place, volume = (lattice.cells - origin) / unit, lattice.cell_volume / unit**space.dim
    kinds, sources, parent, turns = (
        kinds_of(walls),
        place,
        np.arange(len(place)),
        np.tile(np.eye(space.dim), (len(place), 1, 1)),
    )
    pairs = find_pairs(place, place, host.support, device, same=True)
    if kinds:
        shifts = shifts_of(kinds, walls, origin) / unit
        beyond, of, number = find_images(kinds, shifts, place, host.support, device)
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
    faces, columns = host.lattice.faces, _Columns(host, walls, face_sums(host, walls, device))
    spread: list[FaceLoad] = []
    for load in conditions.loads:
        side = np.stack([faces.axis[load.face], faces.sign[load.face]], 1)
        # Each of two opposite faces by itself: both together have no resultant.
        for each in np.unique(side, axis=0):
            spread.append(_spread(load.where((side == each).all(1)), columns))
    conditions.loads[:] = spread


def _spread(load: FaceLoad, columns: "_Columns") -> FaceLoad:
    """A load on faces that lie one way, on the cells behind them too."""
    shares = [columns.shares(int(face), load.value) for face in load.face]
    many = np.array([len(cells) for cells, _ in shares])
    row = np.repeat(np.arange(len(shares)), many)
    cell, share = (np.concatenate(parts) for parts in zip(*shares, strict=True))
    size, deep = np.linalg.norm(load.push, axis=1), many[row] > 1
    if deep.any():
        across = columns.lever(load.push[0] / size[0], int(load.face[0]))
        faces, rows = many > 1, row[deep]
        places = columns.cells[cell[deep]] @ across, columns.centres[load.face[faces]] @ across
        share[deep] = _kept_moments(share[deep], *places, size[rows], size[faces])
    return FaceLoad(load.value, cell, share[:, None] * load.push[row], load.face[row], load.owner)


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
    """The cells behind each face, inward, and the sums b_i of the cells."""

    def __init__(self, host: Host, walls: list[Wall], sums: np.ndarray):
        lattice = host.lattice
        self._frame, self._sums, self._depth = lattice.frame, sums, ceil(2.0 * host.support)
        self._index = np.floor(lattice.index[lattice.corners].mean(1)).astype(int)
        self._at = {tuple(row): n for n, row in enumerate(self._index.tolist())}
        self._faces, self.cells = lattice.faces, lattice.cells
        self.centres = lattice.nodes[lattice.faces.nodes].mean(1)
        self._sides = Counter(zip(lattice.faces.cell.tolist(), lattice.faces.axis.tolist(), strict=True))
        near = {
            (wall.axis, int(cell)): wall
            for wall in walls
            for cell in np.flatnonzero(wall.columns)
            if (wall.point - lattice.cells[cell]) @ wall.normal < lattice.spacing
        }
        self._walled = set(near)
        dim = len(lattice.frame.step)
        self._beside = [[wall.normal for wall in walls if wall.axis != axis] for axis in range(dim)]

    def lever(self, direction: np.ndarray, face: int) -> np.ndarray:
        """The projection of places (dim, dim) on what makes moments of a push along `direction` (dim,) of a face: across it,
        and along walls beside the face, behind which the face goes on and which answer for moments."""
        rest = np.eye(len(direction)) - np.outer(direction, direction)
        for normal in self._beside[self._faces.axis[face]]:
            rest = rest @ (np.eye(len(direction)) - np.outer(normal, normal))
        return rest

    def shares(self, face: int, value: Prescribed) -> tuple[list[int], np.ndarray]:
        """The cells that share a load on a face, and their shares."""
        cell, axis, sign = (int(each[face]) for each in (self._faces.cell, self._faces.axis, self._faces.sign))
        inward = AXES if not self._frame.upright else AXES[axis]
        if self._sides[cell, axis] > 1 or varies(value, inward) or (axis, cell) in self._walled:
            return [cell], np.ones(1)
        normal = sign * self._frame.axes[:, axis]
        step, column = -sign * np.eye(len(normal), dtype=int)[axis], [cell]
        while (behind := self._at.get(tuple((self._index[column[-1]] + step).tolist()))) is not None:
            column.append(behind)
            if len(column) == 2 * self._depth:
                break
        column = column[: min(self._depth, -(-len(column) // 2))]
        return column, -self._sums[column] @ normal
