"""Cells of any kind with named patches on their surface: what a fitted shape or a mesh file comes to."""

# pyright: strict

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mesh:
    """Cells at `nodes` (n, dim) [m], by their kind: `blocks` of corners (c, k), node ids, cells numbered through all blocks.

    Quadrilaterals and hexahedra have their corners in the order of a lattice's cells (`itertools.product` of 0 and 1 along
    the cell's axes, 2^dim of them), triangles and tetrahedra dim + 1 of them; all have a positive volume. `sides` (m, j) are
    the nodes of the outer faces, a side with fewer nodes repeats its last, `side_cell` (m,) the cells that they belong to,
    `side_patch` (m,) indices into `patches`, the names.
    """

    nodes: np.ndarray
    blocks: tuple[np.ndarray, ...]
    sides: np.ndarray
    side_cell: np.ndarray
    side_patch: np.ndarray
    patches: tuple[str, ...]
