"""Meshes of boxes whose cells are no grid's: inner nodes of a grid moved at random, then triangles of its cells,
quadrilaterals, three a triangle, or tetrahedra."""

# pyright: strict
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from collections.abc import Sequence
from itertools import permutations
from pathlib import Path

import meshio
import numpy as np


def moved_grid(
    sides: Sequence[float], counts: Sequence[int], jitter: float, seed: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, dim) and corners (c, 2^dim), in the order of a lattice's cells, of a box from the origin with as many cells
    along its sides; nodes inside are moved by up to `jitter` of a cell along every axis."""
    dim = len(sides)
    index = np.stack(np.meshgrid(*[np.arange(n + 1) for n in counts], indexing="ij"), -1).reshape(-1, dim)
    number = np.arange(len(index)).reshape([n + 1 for n in counts])
    inside = ((index > 0) & (index < np.array(counts))).all(axis=1, keepdims=True)
    shift: np.ndarray = np.random.default_rng(seed).uniform(-jitter, jitter, index.shape) * inside
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), -1).reshape(-1, dim)
    offsets = np.stack(np.meshgrid(*[[0, 1]] * dim, indexing="ij"), -1).reshape(-1, dim)
    corners = np.stack([number[tuple((cells + offset).T)] for offset in offsets], 1)
    return (index + shift) * np.array(sides) / np.array(counts), corners


def around(corners: np.ndarray) -> np.ndarray:
    """Corners (c, 2^dim) in the order of a lattice's cells as files have them: round a face, in 3D one, then the other."""
    return corners[:, [0, 2, 3, 1] if corners.shape[1] == 4 else [0, 4, 6, 2, 1, 5, 7, 3]]


def triangles(corners: np.ndarray, seed: int = 1) -> np.ndarray:
    """Two triangles of each quadrilateral (c, 4), cut one way or the other at random, (2 c, 3)."""
    which = np.random.default_rng(seed).random(len(corners)) < 0.5
    one, other = corners[which], corners[~which]
    parts = [one[:, [0, 2, 3]], one[:, [0, 3, 1]], other[:, [0, 2, 1]], other[:, [2, 3, 1]]]
    return np.concatenate(parts)


def tetrahedra(corners: np.ndarray) -> np.ndarray:
    """Six tetrahedra of each hexahedron (c, 8), about its diagonal, (6 c, 4)."""
    paths = [(0, 1 << a, (1 << a) + (1 << b), 7) for a, b, _ in permutations(range(3))]
    return np.concatenate([corners[:, list(path)] for path in paths])


def thirds(nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and quadrilaterals, corners going round, that triangles (c, 3) fall into by their middles."""
    sides = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    ends, where = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(nodes) + where.reshape(-1, 3)
    centre = len(nodes) + len(ends) + np.arange(len(cells))
    quads = [np.stack([cells[:, k], middle[:, k], centre, middle[:, k - 1]], 1) for k in range(3)]
    return np.concatenate([nodes, nodes[ends].mean(1), nodes[cells].mean(1)]), np.concatenate(quads)


def write(path: Path, nodes: np.ndarray, **cells: np.ndarray) -> None:
    """A mesh file, of the kind that its name says; `cells` by meshio's names of kinds."""
    padded = np.zeros((len(nodes), 3))
    padded[:, : nodes.shape[1]] = nodes
    meshio.Mesh(padded, list(cells.items())).write(path)
