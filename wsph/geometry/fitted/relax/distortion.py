"""How far cells are from being cubes, as a smooth function of their nodes.

With the derivative J of a cell's map from the unit cube, in spacings, it is the mean of |J|^2 and |J^-1|^2, 1 for a cube of
the right size and infinite for a cell that is flat (the symmetric Dirichlet energy; Smith & Schaefer, ACM Trans. Graph. 34
(2015) 70). Its second part is 1/s^2 of the local length s that bounds the time step. Where cells are inside out, det J is
replaced by the positive (det J + sqrt(det J^2 + 4 d^2)) / 2 (Escobar et al., Comput. Methods Appl. Mech. Eng. 192 (2003)
2775), so that descent turns them back.
"""

# pyright: strict

from dataclasses import dataclass
from itertools import product

import numpy as np

CELLS = 800
"""Cells that are taken at once: so many stay in a cache."""


@dataclass(frozen=True)
class Measure:
    """Where and how distortion is measured: at points whose distance from the cell's middle is `reach` of that of its
    corners, summed up in the power `power`, with determinants held above about `least`."""

    reach: float
    power: float
    least: float


def distortion(nodes: np.ndarray, corners: np.ndarray, measure: Measure) -> tuple[float, np.ndarray]:
    """The distortion of cells with `corners` (c, 2^dim) at `nodes` (n, dim) in spacings, and its gradient (n, dim)."""
    dim = nodes.shape[1]
    slopes, columns, ids = _slopes(dim, measure.reach), np.ascontiguousarray(nodes.T), corners.T
    total, back = 0.0, np.empty((dim, *ids.shape))
    for first in range(0, len(corners), CELLS):
        of = ids[:, first : first + CELLS]
        # Cells come last: all that follows runs along them.
        energy, slope = _of_tangents((slopes.T @ columns[:, of]).reshape(dim, -1, dim, of.shape[1]), measure)
        back[:, :, first : first + CELLS] = slopes @ slope.reshape(dim, -1, of.shape[1])
        total += energy
    flat = np.ascontiguousarray(ids).ravel()
    return total, np.stack([np.bincount(flat, part.ravel(), len(nodes)) for part in back], 1)


def _slopes(dim: int, reach: float) -> np.ndarray:
    """The slopes of the multilinear shape functions at the points of a cell, (2^dim, points x dim)."""
    offsets = np.array(list(product((0.0, 1.0), repeat=dim)))
    found: list[np.ndarray] = []
    for point in product((0.5 - 0.5 * reach, 0.5 + 0.5 * reach), repeat=dim):
        factors = np.where(offsets == 1.0, point, 1.0 - np.array(point))
        found += [np.delete(factors, k, 1).prod(1) * (2.0 * offsets[:, k] - 1.0) for k in range(dim)]
    return np.stack(found, 1)


def _of_tangents(tangents: np.ndarray, measure: Measure) -> tuple[float, np.ndarray]:
    """The distortion of maps with the derivatives of components by axes J (dim, points, dim, cells), and its derivative by
    J."""
    dim = len(tangents)
    rows = [[tangents[k, :, a] for k in range(dim)] for a in range(dim)]
    products = [[sum(x * y for x, y in zip(p, q, strict=True)) for q in rows] for p in rows]
    squares = sum(products[a][a] for a in range(dim))
    if dim == 2:
        (a, b), (c, d) = rows
        cofactors, by_cofactors = [[d, -c], [-b, a]], rows
    else:
        cofactors = [_cross(rows[(a + 1) % 3], rows[(a + 2) % 3]) for a in range(3)]
        by_cofactors = [
            [squares * rows[a][k] - sum(products[a][b] * rows[b][k] for b in range(3)) for k in range(3)]
            for a in range(3)
        ]
    det = sum(x * y for x, y in zip(rows[0], cofactors[0], strict=True))
    root = np.sqrt(det**2 + 4.0 * measure.least**2)
    held = (0.5 * (det + root)) ** 2
    areas = sum(x**2 for row in cofactors for x in row)
    each = 0.5 * (squares + areas / held) / dim
    outer = measure.power * each ** (measure.power - 1.0) / dim
    by_det, by_areas = outer * areas / (held * root), outer / held
    slope = np.empty_like(tangents)
    for a in range(dim):
        for k in range(dim):
            slope[k, :, a] = outer * rows[a][k] + by_areas * by_cofactors[a][k] - by_det * cofactors[a][k]
    return float((each**measure.power).sum()), slope


def _cross(a: list[np.ndarray], b: list[np.ndarray]) -> list[np.ndarray]:
    return [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]
