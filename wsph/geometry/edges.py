"""Edges of a lattice's cells."""

# pyright: strict

from dataclasses import dataclass
from itertools import product

import numpy as np

from wsph.geometry.cells import edge_ends


@dataclass(frozen=True)
class Edges:
    """The edges of a body's cells, each once and in both directions, by their `start`: `start` (e,) and `end` (e,) nodes,
    `axis` (e,) of the grid that it runs along, and `cells` (e,), the cells of the body around it, 1 to 2^(dim-1)."""

    start: np.ndarray
    end: np.ndarray
    axis: np.ndarray
    cells: np.ndarray


def cell_edges(corners: np.ndarray, nodes: int) -> Edges:
    """The edges of cells with `corners` (c, 2^dim) among so many nodes. Nodes that a crack has parted have edges of their
    own."""
    dim = int(np.log2(corners.shape[1]))
    offsets = np.array(list(product((0, 1), repeat=dim)))
    parts: list[np.ndarray] = []
    for axis in range(dim):
        low, high = edge_ends(offsets, axis)
        keys, count = np.unique(corners[:, low].astype(np.int64) * nodes + corners[:, high], return_counts=True)
        parts.append(np.stack([keys // nodes, keys % nodes, np.full(len(keys), axis), count]))
    there = np.concatenate(parts, axis=1)
    both = np.concatenate([there, there[[1, 0, 2, 3]]], axis=1)
    start, end, axis, cells = both[:, np.lexsort((both[1], both[0]))]
    return Edges(start, end, axis, cells)
