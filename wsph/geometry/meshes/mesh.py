"""Cells of any kind with named patches on their surface: what a fitted shape or a mesh file comes to."""

# pyright: strict

from dataclasses import dataclass, field

import numpy as np

from wsph.geometry.cells import Boxes


@dataclass(frozen=True)
class Mesh:
    """Cells at `nodes` (n, dim) [m], by their kind: `blocks` of corners (c, k), node ids, cells numbered through all blocks.

    Quadrilaterals and hexahedra have their corners in the order of a lattice's cells (`itertools.product` of 0 and 1 along
    the cell's axes, 2^dim of them), triangles and tetrahedra dim + 1 of them; all have a positive volume. `sides` (m, j) are
    the nodes of the outer faces, a side with fewer nodes repeats its last; of a fitted body in the order of a lattice's
    faces, the outward normal to the right of a side in 2D, and along (c - a) x (b - a) for the nodes a, b, c, ... of one in
    3D. `side_cell` (m,) are the cells that they belong to, `side_patch` (m,) indices into `patches`, the names; `groups` of
    sides by name, rows, which may overlap. `boxes`: the cells of the first block that are those of a grid.
    """

    nodes: np.ndarray
    blocks: tuple[np.ndarray, ...]
    sides: np.ndarray
    side_cell: np.ndarray
    side_patch: np.ndarray
    patches: tuple[str, ...]
    groups: dict[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    boxes: Boxes | None = None

    def within(self, nodes: slice, boxes: Boxes | None) -> tuple["Mesh", tuple[np.ndarray, ...], np.ndarray]:
        """The part of it with the cells whose corners are among the `nodes` from one up to another, with its own `boxes`;
        the rows of the cells of every block (k,) and of the sides (m,) that it has."""
        held = [((corners >= nodes.start) & (corners < nodes.stop)).all(1) for corners in self.blocks]
        every = np.concatenate(held)
        number, sides = np.cumsum(every) - 1, np.flatnonzero(every[self.side_cell])
        place = np.full(len(self.sides), -1)
        place[sides] = np.arange(len(sides))
        groups = {name: place[rows][place[rows] >= 0] for name, rows in self.groups.items()}
        made = Mesh(
            self.nodes[nodes],
            tuple(corners[there] - nodes.start for corners, there in zip(self.blocks, held, strict=True)),
            self.sides[sides] - nodes.start,
            number[self.side_cell[sides]],
            self.side_patch[sides],
            self.patches,
            groups,
            boxes,
        )
        return made, tuple(np.flatnonzero(there) for there in held), sides

    @property
    def named(self) -> dict[str, np.ndarray]:
        """Rows of the sides of every patch and group, by name."""
        of = np.array(self.patches)[self.side_patch] if self.patches else self.side_patch
        own = {name: np.flatnonzero(of == name) for name in self.patches}
        return {**own, **self.groups}
