"""The cells of a body around its surface, which every process has of all of the body: each tells those that it owns.

The boundary, and how it hangs on particles, depend on the cells at it and on what these have around them, in the order of
their numbers. So what is made of the shell is to the bit what would be made of the whole body.
"""

# pyright: strict

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wsph.backend.domain import Domain, Split
from wsph.contact.surfaces.meshing.boundary import Boundary
from wsph.contact.surfaces.meshing.own import OwnCells
from wsph.geometry.geometry import Geometry
from wsph.geometry.lattice import Lattice
from wsph.geometry.shapes.stair_patches import StairPatches
from wsph.geometry.shapes.surfaces.surface import Patch


@dataclass(frozen=True)
class Stairs:
    """The faces of the cells of a shell that stand for a shape: their `nodes` (f, corners) and their `cell` (f,), numbers in
    the shell, the patch that each stands for, `label` (f,), and all `patches`."""

    nodes: np.ndarray
    cell: np.ndarray
    label: np.ndarray
    patches: tuple[Patch, ...]


@dataclass(frozen=True)
class Shell:
    """Live cells around the surface of a body.

    node     # numbers of its nodes in the whole body, ascending, (n,), of `count` (nodes, cells)
    cell     # numbers of its cells, ascending, (c,)
    nodes    # places (n, dim) [m]
    blocks   # corners of the cells, nodes of the shell, by their kind
    wanted   # which nodes may be on the boundary, (n,) bool
    parted   # pairs of its cells that do not hang together where they share a side, (p, 2)
    spacing  # of the body [m]
    """

    node: np.ndarray
    cell: np.ndarray
    count: tuple[int, int]
    nodes: np.ndarray
    blocks: tuple[np.ndarray, ...]
    wanted: np.ndarray
    parted: np.ndarray
    spacing: float
    stairs: Stairs | None

    @cached_property
    def cells(self) -> np.ndarray:
        """Middles of the cells of a lattice (c, dim) [m], as `wsph.geometry.lattice.Lattice` has them."""
        (corners,) = self.blocks
        middles = self.nodes[corners[:, 0]]
        for k in range(1, corners.shape[1]):
            middles += self.nodes[corners[:, k]]
        return middles / corners.shape[1]

    def numbered(self, boundary: Boundary) -> Boundary:
        """A boundary of the shell by the numbers of the whole body."""
        node, cell, cells = self.node[boundary.node], self.cell[boundary.cell], self.cell[boundary.cells]
        return replace(boundary, node=node, cell=cell, cells=cells, joins=self.cell[boundary.joins])

    def own(self, boundary: Boundary) -> Boundary:
        """The reverse."""
        cell, cells, joins = (
            np.searchsorted(self.cell, each) for each in (boundary.cell, boundary.cells, boundary.joins)
        )
        return replace(boundary, node=np.searchsorted(self.node, boundary.node), cell=cell, cells=cells, joins=joins)


def shell_of(geometry: Geometry, own: OwnCells, live: np.ndarray, parted: np.ndarray, *, deep: bool) -> Shell:
    """The shell of a body: of this process's own cells those that are `live` (own,) bool, without the joins of `parted`
    cells (k, 2), numbers in the whole body, which all know. `deep`: what shares a fan of corners with the cells at the
    boundary is in it. All processes that share the body ask together."""
    split, blocks = geometry.split, own.blocks(geometry)
    domain, first = split.domain, split.nodes.first
    wanted = np.zeros(len(geometry.nodes), bool)
    wanted[geometry.faces.nodes[geometry.own_faces].ravel()] = True
    suspect = ~live | own.among(parted.ravel())
    for corners, rows in blocks:
        wanted[corners[suspect[rows]].ravel()] = True
    wanted = touched = _anywhere(wanted, split)
    if deep:
        touched = np.zeros_like(wanted)
        for corners, _ in blocks:
            touched[corners[wanted[corners].any(1)].ravel()] = True
        touched = _anywhere(touched, split)
    chosen = [(corners, rows, touched[corners].any(1) & live[rows]) for corners, rows in blocks]
    mine = np.unique(np.concatenate([corners[there].ravel() for corners, _, there in chosen])).astype(np.int64)
    node, at = np.unique(domain.joined(mine + first), return_index=True)
    places, may = domain.joined(geometry.nodes[mine])[at], domain.joined(wanted[mine])[at]
    cell = np.concatenate([domain.joined(own.numbers[rows][there]) for _, rows, there in chosen])
    numbers = [domain.joined(corners[there].astype(np.int64) + first) for corners, _, there in chosen]
    return Shell(
        node,
        cell,
        (split.nodes.whole, own.whole),
        places,
        tuple(np.searchsorted(node, each) for each in numbers),
        may,
        _within(cell, parted),
        geometry.spacing,
        _stairs(geometry, own, node, cell),
    )


def _anywhere(nodes: np.ndarray, split: Split) -> np.ndarray:
    """Which of the nodes here (n,) bool any process has chosen."""
    if split.domain.size == 1:
        return nodes
    at = split.nodes.stands(split.domain.joined(np.flatnonzero(nodes) + split.nodes.first))
    found = np.zeros_like(nodes)
    found[at[at >= 0]] = True
    return found


def _within(cell: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Those pairs (k, 2) of numbers that are both in a shell's ascending ones, where they stand there."""
    at = np.minimum(np.searchsorted(cell, pairs), max(len(cell) - 1, 0))
    return at[(cell[at] == pairs).all(1)] if len(cell) else at[:0]


def _stairs(geometry: Geometry, own: OwnCells, node: np.ndarray, cell: np.ndarray) -> Stairs | None:
    """The faces of all processes that stand for a shape; None where there are no stairs."""
    faces = geometry.faces
    if not isinstance(geometry, Lattice) or geometry.mapped or not isinstance(faces.patches, StairPatches):
        return None
    domain: Domain = geometry.split.domain
    (rows,), mine = own.rows, geometry.own_faces
    label, patches = faces.patches.stands_for
    nodes = domain.joined(faces.nodes[mine].astype(np.int64) + geometry.split.nodes.first)
    owner, every = domain.joined(own.numbers[faces.cell[mine] - rows.start]), domain.joined(label[mine])
    there = np.isin(owner, cell)
    return Stairs(np.searchsorted(node, nodes[there]), np.searchsorted(cell, owner[there]), every[there], patches)
