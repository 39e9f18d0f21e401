"""Interpolation on the host that is exact on quadratic fields, to read a body between its particles.

A linear one errs by h^2 times what goes with where a point lies between the particles: with cells that fit a surface, where
that is another place on every lattice, the errors of a ladder scatter by as much as themselves. By moving least squares of
second order (Lancaster & Salkauskas, Math. Comput. 37 (1981) 141) what is left is of third order. Where the places around
are too few, or weights would be large, a point is read linearly (`wsph.sph.averages.spanning_weights`).
"""

# pyright: strict

from itertools import combinations_with_replacement

import numpy as np

from wsph.backend.arrays import host
from wsph.geometry.geometry import Geometry
from wsph.sph.averages import Averages, spanning_weights, visible
from wsph.sph.pairs import Pairs, find_pairs_once

REACH, WIDER, FARTHEST = 2.2, 1.2, 3.3
"""How far a point looks [cells of about it]: three places a direction, at faces too; its growth where that is too little,
and what it stays below [longest edges]."""

LINEAR = 1.6
"""The reach of a linear reading [longest edges]."""

LEAST = 1e-2
"""Smallest over largest singular value of moments that tell a quadratic field: on a lattice .1, at a face .03."""

MOST = 2.6
"""Sum of the sizes of weights beyond the dimensions that is large: from middles of cells out to a face, in 1D, it is 3.5."""

HERE = 1e-6
"""Distance within which a point is a place [cells]."""

CHUNK = 1 << 22
"""Numbers of a batch of points."""


def between(geometry: Geometry, points: np.ndarray, at_nodes: bool) -> Averages:
    """How to read a field that stands at nodes, or at the points inside cells, at `points` (m, dim) [m]: a place itself
    where one is, otherwise from those around, through no crack. Raises ValueError for a point on a crack."""
    grid, sources = geometry.comparable(points, geometry.nodes if at_nodes else geometry.cells)
    # Nodes on a crack are of one side each.
    parted = grid, geometry.off_cracks[0 if at_nodes else 1] if geometry.cracks else sources
    for crack in geometry.cracks:
        if (on := crack.holds(grid)).any():
            raise ValueError(f"{points[on][0].tolist()} is on a crack, with a value on either side")
    reach = REACH * _size(geometry, points)
    found, todo = Averages.nothing(len(points)), np.arange(len(points))
    while len(todo):
        seen = visible(find_pairs_once(grid[todo], sources, reach[todo]), geometry, parted[0][todo], parted[1])
        weights, well = _quadratic(seen, grid[todo], sources)
        made = Averages(host(seen.offsets), host(seen.indices), weights)
        found = found.but(todo[well], made.only(np.flatnonzero(well)))
        todo = todo[~well & (WIDER * reach[todo] < FARTHEST)]
        reach[todo] *= WIDER
    left = np.flatnonzero(np.diff(found.offsets) == 0)
    if len(left):
        theirs = (grid[left], sources), (parted[0][left], parted[1])
        found = found.but(left, Averages.of(spanning_weights(geometry, LINEAR, *theirs, np.ones(len(sources)))))
    on = np.flatnonzero(np.linalg.norm(sources[found.places] - grid[found.rows], axis=1) < HERE)
    targets, first = np.unique(found.rows[on], return_index=True)
    return found.but(targets, Averages.themselves(found.places[on[first]]))


def _size(geometry: Geometry, points: np.ndarray) -> np.ndarray:
    """The mean size of the cells about points (m, dim) [m], (m,), in units of `Geometry.comparable`."""
    if not geometry.mapped:
        return np.ones(len(points))
    dim = points.shape[1]
    near = find_pairs_once(*geometry.comparable(points, geometry.cells), 1.0)
    sizes = geometry.cell_volume ** (1.0 / dim) / geometry.edges[1]
    number = np.diff(host(near.offsets))
    total = np.bincount(near.rows(), sizes[host(near.indices)], len(points))
    return np.where(number > 0, total / np.maximum(number, 1), 1.0)


def _quadratic(pairs: Pairs, targets: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights of pairs, (pairs,), and for which targets they are good, (n,) bool."""
    offsets, indices, reach = host(pairs.offsets), host(pairs.indices), host(pairs.reach)
    count, dim = np.diff(offsets), targets.shape[1]
    weights, well = np.zeros(pairs.count), np.zeros(len(targets), bool)
    terms = 1 + dim + dim * (dim + 1) // 2
    enough = np.flatnonzero(count >= terms)
    at_once = max(CHUNK // (terms * int(count.max(initial=1))), 1)
    for begin in range(0, len(enough), at_once):
        some = enough[begin : begin + at_once]
        place = np.arange(int(count[some].max()))
        there: np.ndarray = place[None, :] < count[some, None]
        pair = np.where(there, offsets[some, None] + place[None, :], 0)
        apart = (sources[indices[pair]] - targets[some, None]) / reach[some, None, None]
        root = np.where(there, 1.0 - (apart**2).sum(2), 0.0)
        u, s, vt = np.linalg.svd(root[:, :, None] * _monomials(apart), full_matrices=False)
        told = s[:, -1] > LEAST * s[:, 0]
        # The value at the target is the first coefficient: the first row of the pseudo-inverse.
        first = vt[:, :, 0] / np.where(told[:, None], s, 1.0)
        each = root * np.einsum("nkc,nc->nk", u, first)
        weights[pair[there]] = each[there]
        well[some] = told & (np.abs(each).sum(1) <= dim + MOST)
    return weights, well


def _monomials(x: np.ndarray) -> np.ndarray:
    """1, the coordinates, and their products, (n, k, terms) of x (n, k, dim)."""
    products = [x[..., a] * x[..., b] for a, b in combinations_with_replacement(range(x.shape[2]), 2)]
    return np.stack([np.ones(x.shape[:2]), *np.moveaxis(x, 2, 0), *products], 2)
