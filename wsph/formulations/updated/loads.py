"""Loads on the faces of a body whose particles are its cells.

A uniform stress acts on a particle with sigma b_i, b_i = sum w (V_i M_i + V_j M_j) r, which is zero inside and, near a face,
not that face's area on the first layer and nothing on the next: three layers and more have a share, of either sign. A load
that equilibrium is to answer with one stress acts on the layers in the same shares, -n . b_i, as found at the start. As the
body stretches by e the shares change: the stress beside a loaded face is then one value to e/2.
"""

from dataclasses import replace
from functools import cache
from math import ceil

import numpy as np
import warp as wp

from wsph.backend.kernels import kernel
from wsph.backend.space import Space
from wsph.boundary.conditions import Conditions, Prescribed, varies
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
    loads = conditions.loads
    if loads is None or not loads.entries:
        return
    dim = host.space.dim
    columns = _Columns(host, walls, face_sums(host, walls, device))
    for key, values in loads.entries.items():
        scales, axis, spread, areas = loads.scales[key], key[1] // dim, dict[int, Prescribed](), dict[int, float]()
        found = {particle: columns.shares(particle, axis, value) for particle, value in values.items()}
        for sign in (-1, 1):
            # Each of two opposite faces by itself: both together have no resultant.
            face = [particle for particle in values if columns.sign(particle, axis) == sign]
            shared = [particle for particle in face if len(found[particle]) > 1]
            resultant = sum(scales[particle] * share for particle in shared for _, share in found[particle])
            # What corners leave: the resultant is the face's to the last digit.
            factor = sum(scales[particle] for particle in shared) / resultant if shared else 1.0
            for particle in face:
                whole = 1.0 if len(found[particle]) == 1 else factor
                for cell, share in found[particle]:
                    spread[cell] = values[particle]
                    areas[cell] = whole * scales[particle] * share
        loads.entries[key], loads.scales[key] = spread, areas


class _Columns:
    """The cells behind each face, inward, and the sums b_i of the cells."""

    def __init__(self, host: Host, walls: list[Wall], sums: np.ndarray):
        lattice = host.lattice
        self._frame, self._sums, self._depth = lattice.frame, sums, ceil(2.0 * host.support)
        self._index = np.floor(lattice.index[lattice.corners].mean(1)).astype(int)
        self._at = {tuple(row): n for n, row in enumerate(self._index.tolist())}
        self._signs: dict[tuple[int, int], list[int]] = {}
        for cell, axis, sign in zip(lattice.faces.cell, lattice.faces.axis, lattice.faces.sign, strict=True):
            self._signs.setdefault((int(cell), int(axis)), []).append(int(sign))
        near = {
            (wall.axis, int(cell)): wall
            for wall in walls
            for cell in np.flatnonzero(wall.columns)
            if (wall.point - lattice.cells[cell]) @ wall.normal < lattice.spacing
        }
        self._walled = set(near)

    def sign(self, particle: int, axis: int) -> int:
        """Of the outward normal of a cell's face across an axis; where it has two, of the first."""
        return self._signs[particle, axis][0]

    def shares(self, particle: int, axis: int, value: Prescribed) -> list[tuple[int, float]]:
        """The cells that share a load on a face of a cell, and their shares."""
        signs = self._signs[particle, axis]
        inward = AXES if not self._frame.upright else AXES[axis]
        if len(signs) > 1 or varies(value, inward) or (axis, particle) in self._walled:
            return [(particle, 1.0)]
        normal = signs[0] * self._frame.axes[:, axis]
        step, column = -signs[0] * np.eye(len(normal), dtype=int)[axis], [particle]
        while (cell := self._at.get(tuple((self._index[column[-1]] + step).tolist()))) is not None:
            column.append(cell)
            if len(column) == 2 * self._depth:
                break
        return [(cell, -float(self._sums[cell] @ normal)) for cell in column[: min(self._depth, -(-len(column) // 2))]]
