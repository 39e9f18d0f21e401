"""Gradients of cells that differ: the mean over each, and at the nodes, averaged over the cells around."""

# pyright: strict

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

MIX = 0.5
"""Part of the gradients that is averaged over the cells; the rest is taken at their corners."""

GAUSS = (0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5)
"""Places of the two Gauss points of an axis, from 0 to 1."""

CELLS = 20_000
"""Cells that are taken at once."""


@dataclass(frozen=True)
class PointRows:
    """The nodes that points see, rows (c + 1,) `offsets` into `indices` (pairs,), and where cells differ `slope` (pairs,
    dim), their volume times the weights of the gradient, sum_j f_j slope_j/V [m^(dim-1)]; None on a regular lattice, where
    those follow from the places. `held` (c,) bool: whether a point needs the residual; None: all do."""

    offsets: np.ndarray
    indices: np.ndarray
    slope: np.ndarray | None
    held: np.ndarray | None = None

    @classmethod
    def of_corners(cls, corners: np.ndarray, slope: np.ndarray | None = None) -> "PointRows":
        """Rows of cells that see their `corners` (c, k) alone."""
        flat = None if slope is None else slope.reshape(-1, slope.shape[2])
        return cls(np.arange(len(corners) + 1) * corners.shape[1], corners.ravel(), flat)

    def taken(self, points: np.ndarray) -> "PointRows":
        """The rows of some points (k,), in their order."""
        many = np.diff(self.offsets)[points]
        ends = np.concatenate([[0], np.cumsum(many)])
        where = np.arange(int(ends[-1])) + np.repeat(self.offsets[points] - ends[:-1], many)
        slope = None if self.slope is None else self.slope[where]
        held = None if self.held is None else self.held[points]
        return PointRows(ends, self.indices[where], slope, held)

    def between(self, points: slice, node: int) -> "PointRows":
        """The rows of the points from one up to another, by nodes that are numbered from `node` on."""
        start, end = (int(self.offsets[k]) for k in (points.start, points.stop))
        slope = None if self.slope is None else self.slope[start:end]
        held = None if self.held is None else self.held[points]
        offsets = self.offsets[points.start : points.stop + 1] - start
        return PointRows(offsets, self.indices[start:end] - node, slope, held)


@dataclass(frozen=True)
class NodalGradients:
    """The mean gradient of a field about every node p, grad f_p = 1/V_p sum_i (f_i - f_p) v_pi, over pairs of nodes that
    share a cell, by their `start` p (e,) and then their `end` i (e,): `slope` (e, dim) = v_pi, `back` (e, dim) = v_ip, and
    the `volume` (n,) of the nodes.

    v_pi = sum over cells of the integral of N_p grad N_i, of which a part is taken at the corners. Since the N_p sum up to
    1, sum_p v_pi is the integral of grad N_i, which the divergence theorem makes that of N_i n over the faces: the faces get
    exactly what they are due, on any cells, and linear fields have their gradients.
    """

    start: np.ndarray
    end: np.ndarray
    slope: np.ndarray
    back: np.ndarray
    volume: np.ndarray


def nodal_gradients(places: np.ndarray, corners: np.ndarray, mix: float = MIX, before: int = 0) -> NodalGradients:
    """The gradients of cells with `corners` (c, 2^dim) at `places` (n, dim). `before`: how many cells of the whole body,
    which is summed up some cells at a time, stand in front of them. Raises ValueError for cells so distorted that a node has
    no volume."""
    n, dim = places.shape
    volume, keys, values = np.zeros(n), list[np.ndarray](), list[np.ndarray]()
    for first in range(-(before % CELLS), len(corners), CELLS):
        of = corners[max(first, 0) : first + CELLS]
        slopes, volumes = _cell_gradients(places[of], mix)
        volume += np.bincount(of.ravel(), volumes.ravel(), n)
        found, where = np.unique((of[:, :, None].astype(np.int64) * n + of[:, None, :]).ravel(), return_inverse=True)
        sums = [np.bincount(where.ravel(), slopes[..., k].ravel()) for k in range(dim)]
        keys.append(found)
        values.append(np.stack(sums, 1))
    if not (volume > 0.0).all():
        raise ValueError(f"the cells about {places[int(volume.argmin())].tolist()} are too distorted to have gradients")
    pairs, where = np.unique(np.concatenate(keys), return_inverse=True)
    parts = np.concatenate(values)
    whole = np.stack([np.bincount(where.ravel(), parts[:, k]) for k in range(dim)], 1)
    start, end = pairs // n, pairs % n
    back = whole[np.searchsorted(pairs, end * n + start)]
    apart = start != end
    return NodalGradients(start[apart], end[apart], whole[apart], back[apart], volume)


def mean_gradients(places: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Volumes times mean gradients of the shape functions, the integrals of grad N_j (c, k, dim), and volumes (c,) of cells
    with `corners` (c, k) at `places` (n, dim): 2^dim of a quadrilateral or a hexahedron, dim + 1 of a simplex.

    The gradient that a cell sees of a field, sum_j f_j g_j, is the mean of the multilinear field's (Flanagan & Belytschko
    1981, eqs 6 to 17, for hexahedra). Linear fields have theirs on any cells, and by the divergence theorem faces get
    exactly what they are due.
    """
    dim = places.shape[1]
    slope, volume = np.zeros((*corners.shape, dim)), np.zeros(len(corners))
    for first in range(0, len(corners), CELLS):
        rows = slice(first, first + CELLS)
        cells = places[corners[rows]]
        slope[rows], volume[rows] = _simplices(cells) if corners.shape[1] == dim + 1 != 2 else _multilinear(cells)
    return slope, volume


def node_shares(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Integrals of the shape functions over cells with `corners` (c, k) at `places` (n, dim): (c, k)."""
    dim = places.shape[1]
    if corners.shape[1] == dim + 1 != 2:
        return np.repeat(_simplices(places[corners])[1][:, None] / (dim + 1), dim + 1, 1)
    shares, cells = np.zeros(corners.shape), places[corners]
    for shape, slopes in _shapes(product(GAUSS, repeat=dim), dim):
        shares += _scaled(cells, slopes)[1][:, None] * shape / corners.shape[1]
    return shares


def corner_volumes(places: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The volumes that quadrilaterals or hexahedra with `corners` (c, 2^dim) at `places` (n, dim) would have if they were
    everywhere as they are at a corner, (c, 2^dim), and in the middle, (c,): negative where the cell is folded over there."""
    dim = places.shape[1]
    spots = [*product((0.0, 1.0), repeat=dim), (0.5,) * dim]
    found = [_scaled(places[corners], slopes)[1] for _, slopes in _shapes(iter(spots), dim)]
    return np.stack(found[:-1], 1), found[-1]


def _simplices(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of simplices (c, dim + 1, dim)."""
    dim = cells.shape[2]
    tangents = cells[:, 1:] - cells[:, :1]
    volume, slope = np.zeros(len(cells)), np.zeros(cells.shape)
    volume += np.linalg.det(tangents)
    slope[:, 1:] = _normals(tangents)
    slope[:, 0] -= slope[:, 1:].sum(1)
    whole = 2.0 if dim == 2 else 6.0
    return slope / whole, volume / whole


def _multilinear(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of cells (c, 2^dim, dim): two Gauss points an axis are exact."""
    many, count, dim = cells.shape
    whole, volume = np.zeros((many, count, dim)), np.zeros(many)
    for _, slopes in _shapes(product(GAUSS, repeat=dim), dim):
        gradient, det = _scaled(cells, slopes)
        whole += gradient / count
        volume += det / count
    return whole, volume


def _shapes(points: Iterator[tuple[float, ...]], dim: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The multilinear shape functions (2^dim,) and their slopes (dim, 2^dim) at points of the unit cell."""
    offsets = np.array(list(product((0.0, 1.0), repeat=dim)))
    for point in points:
        factors = np.where(offsets == 1.0, point, 1.0 - np.array(point))
        slopes = [np.delete(factors, k, 1).prod(1) * (2.0 * offsets[:, k] - 1.0) for k in range(dim)]
        yield factors.prod(1), np.stack(slopes)


def _normals(tangents: np.ndarray) -> np.ndarray:
    """det J times the rows of J^-T, of the rows J (c, dim, dim): finite where a cell has no volume, too."""
    dim = tangents.shape[1]
    if dim == 1:
        return np.ones_like(tangents)
    if dim == 2:
        (a, b), (c, d) = np.moveaxis(tangents, 0, -1)
        return np.moveaxis(np.array([[d, -c], [-b, a]]), -1, 0)
    return np.stack([np.cross(tangents[:, (k + 1) % 3], tangents[:, (k + 2) % 3]) for k in range(3)], 1)


def _scaled(cells: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """det grad N_i (c, 2^dim, dim) and det (c,) of the maps of cells (c, 2^dim, dim), of the shape functions' `slopes`."""
    tangents = np.einsum("ka,eab->ekb", slopes, cells)
    normals = _normals(tangents)
    return np.einsum("ekb,ka->eab", normals, slopes), np.einsum("eb,eb->e", tangents[:, 0], normals[:, 0])


def _cell_gradients(cells: np.ndarray, mix: float) -> tuple[np.ndarray, np.ndarray]:
    """v_pi (c, 2^dim, 2^dim, dim) and volumes (c, 2^dim) of cells (c, 2^dim, dim). Two Gauss points an axis are exact."""
    many, count, dim = cells.shape
    slope, volume = np.zeros((many, count, count, dim)), np.zeros((many, count))
    at_corners, volume_there = np.zeros_like(slope), np.zeros_like(volume)
    whole, whole_volume = np.zeros((many, count, dim)), np.zeros(many)
    for shape, slopes in _shapes(product(GAUSS, repeat=dim), dim):
        gradient, det = _scaled(cells, slopes)
        slope += mix / count * shape[None, :, None, None] * gradient[:, None]
        volume += mix / count * det[:, None] * shape
        whole += gradient / count
        whole_volume += det / count
    for k, (_, slopes) in enumerate(_shapes(product((0.0, 1.0), repeat=dim), dim)):
        gradient, det = _scaled(cells, slopes)
        at_corners[:, k] += gradient / count
        volume_there[:, k] += det / count
    # The corners alone are not exact on distorted hexahedra: what is left is shared by them.
    at_corners += (whole - at_corners.sum(1))[:, None] / count
    volume_there += (whole_volume - volume_there.sum(1))[:, None] / count
    return slope + (1.0 - mix) * at_corners, volume + (1.0 - mix) * volume_there


def face_shares(faces: np.ndarray, inside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of faces with corners (m, 2^(dim-1), dim), in front of the points `inside` (m, dim): the parts of their areas that the
    corners stand for, the integrals of N_j, (m, corners), and those of N_j n, n outward, (m, corners, dim)."""
    many, count, dim = faces.shape
    shares, vectors = np.zeros((many, count)), np.zeros((many, count, dim))
    outward = faces.mean(1) - inside
    if dim == 1:
        return shares + 1.0, vectors + np.sign(outward)[:, None]
    for shape, slopes in _shapes(product(GAUSS, repeat=dim - 1), dim - 1):
        tangents = np.einsum("ka,eab->ekb", slopes, faces)
        first = tangents[:, 0]
        normal = np.stack([first[:, 1], -first[:, 0]], 1) if dim == 2 else np.cross(first, tangents[:, 1])
        shares += np.linalg.norm(normal, axis=1)[:, None] * shape / count
        vectors += normal[:, None] * shape[:, None] / count
    behind = np.einsum("mcd,md->m", vectors, outward) < 0.0
    vectors[behind] *= -1.0
    return shares, vectors
