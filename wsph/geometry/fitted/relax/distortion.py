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

CELLS = 2000
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
    slopes = _slopes(dim, measure.reach)
    total, gradient = 0.0, np.zeros_like(nodes)
    for first in range(0, len(corners), CELLS):
        of = corners[first : first + CELLS]
        tangents = (nodes[of].transpose(0, 2, 1) @ slopes).reshape(len(of), dim, -1, dim).transpose(0, 2, 3, 1)
        energy, slope = _of_tangents(np.ascontiguousarray(tangents.reshape(-1, dim, dim)), measure)
        back = slope.reshape(len(of), -1, dim, dim).transpose(0, 3, 1, 2).reshape(len(of), dim, -1) @ slopes.T
        total += energy
        for k in range(dim):
            gradient[:, k] += np.bincount(of.ravel(), back[:, k].ravel(), len(nodes))
    return total, gradient


def _slopes(dim: int, reach: float) -> np.ndarray:
    """The slopes of the multilinear shape functions at the points of a cell, (2^dim, points x dim)."""
    offsets = np.array(list(product((0.0, 1.0), repeat=dim)))
    found: list[np.ndarray] = []
    for point in product((0.5 - 0.5 * reach, 0.5 + 0.5 * reach), repeat=dim):
        factors = np.where(offsets == 1.0, point, 1.0 - np.array(point))
        found += [np.delete(factors, k, 1).prod(1) * (2.0 * offsets[:, k] - 1.0) for k in range(dim)]
    return np.stack(found, 1)


def _of_tangents(tangents: np.ndarray, measure: Measure) -> tuple[float, np.ndarray]:
    """The distortion of maps with the rows J (m, dim, dim), and its derivative by J (m, dim, dim)."""
    dim = tangents.shape[1]
    squares = (tangents**2).sum((1, 2))
    if dim == 2:
        (a, b), (c, d) = np.moveaxis(tangents, 0, -1)
        cofactors = np.moveaxis(np.array([[d, -c], [-b, a]]), -1, 0)
        by_cofactors = tangents
    else:
        a, b, c = np.moveaxis(tangents, 1, 0)
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)
        by_cofactors = squares[:, None, None] * tangents - (tangents @ tangents.transpose(0, 2, 1)) @ tangents
    det = (tangents[:, 0] * cofactors[:, 0]).sum(1)
    root = np.sqrt(det**2 + 4.0 * measure.least**2)
    held = 0.5 * (det + root)
    areas = (cofactors**2).sum((1, 2))
    each = 0.5 * (squares + areas / held**2) / dim
    outer = measure.power * each ** (measure.power - 1.0) / dim
    by_det = areas / held**2 / root
    slope = tangents + by_cofactors / (held**2)[:, None, None] - by_det[:, None, None] * cofactors
    return float((each**measure.power).sum()), outer[:, None, None] * slope
