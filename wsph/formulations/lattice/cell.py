"""What all cells of a lattice have in common, and what they hand to their nodes."""

# pyright: strict

from functools import cache
from typing import Protocol, cast

import numpy as np
import warp as wp

from wsph.backend.space import Space


class Cell(Protocol):
    """A cell of a lattice, nondimensional, as `cell_struct` has it."""

    gradient: object
    force: object
    restoring: object
    volume: float
    hold: float
    share: float


@cache
def cell_struct(space: Space) -> type:
    """Struct of the numbers of a cell.

    gradient  # mat: the sums of differences times it are the gradient
    force     # mat: first Piola stress times it is what the nodes of a cell get, by their sides
    restoring  # mat: the same of the gradient, of the stabilisation, of a share of one
    volume    # of the cell
    hold      # the stabilisation's stiffness beside one node, of a share of one
    share     # volume over the spread of the corners
    """
    real, mat = space.scalar, space.mat
    annotations = {"gradient": mat, "force": mat, "restoring": mat, "volume": real, "hold": real, "share": real}
    return cast(type, wp.struct(type("Cell", (), {"__annotations__": annotations, "__module__": __name__})))


def cell_of(space: Space, steps: np.ndarray, axes: np.ndarray, stabilisation: float) -> Cell:
    """A cell with edges `steps` (dim,) along `axes`, columns (dim, dim).

    With the sums s_k = sum over the 2^(dim-1) edges along axis k of du the gradient is sum_k s_k/(2^(dim-1) h_k) (x) e_k,
    V g_j = V sum_k (-1 or 1) e_k/(2^(dim-1) h_k), and a corner stands at r_j = sum_k (-1 or 1) e_k h_k/2.
    """
    dim, made = space.dim, cast(Cell, cell_struct(space)())
    gradient = np.diag(1.0 / (2.0 ** (dim - 1) * steps)) @ axes.T
    volume, spread = float(np.prod(steps)), 0.25 * float((steps**2).sum())
    hold = stabilisation * 0.5**dim
    made.gradient = space.mat(*gradient.ravel().tolist())
    made.force = space.mat(*(volume * gradient.T).ravel().tolist())
    made.restoring = space.mat(*(hold * axes @ np.diag(0.5 * steps)).ravel().tolist())
    made.volume, made.hold, made.share = (space.scalar(each) for each in (volume, hold, volume / spread))
    return made
