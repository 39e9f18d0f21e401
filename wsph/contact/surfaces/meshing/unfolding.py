"""Faces that are folded over where stairs meet a shape under an odd angle, laid flat again.

The vertices of a folded face go to the mean of those beside them, along the patches that they lie on; those that no patch
lets go stay. What is still folded after some rounds is left to who takes the areas.
"""

# pyright: strict

from collections.abc import Callable

import numpy as np

from wsph.contact.surfaces.meshing.on_shape import OnShape
from wsph.contact.surfaces.meshing.sparse import SparseRows

ROUNDS = 20
"""Rounds of means: a fold is a few faces wide."""


def unfolded(placed: OnShape, faces: np.ndarray, folded: Callable[[OnShape], np.ndarray]) -> OnShape:
    """Vertices on a shape, with `faces` (m, dim) of which those that `folded` says (m,) bool are laid flat."""
    bad = folded(placed)
    if not bad.any():
        return placed
    beside = _beside(placed.on, faces)
    for _ in range(ROUNDS):
        loose = np.zeros(len(placed.X), bool)
        loose[faces[bad].ravel()] = True
        rows = np.flatnonzero(loose & placed.on.any(1) & (np.diff(beside.offsets) > 0))
        X = placed.X.copy()
        X[rows] = beside.only(rows) @ placed.X
        placed = placed.moved(X)
        bad = folded(placed)
        if not bad.any():
            break
    return placed


def _beside(on: np.ndarray, faces: np.ndarray) -> SparseRows:
    """Means over the vertices that share a face with each and lie on all patches that it lies on."""
    dim, n = faces.shape[1], len(on)
    ways = [(a, b) for a in range(dim) for b in range(dim) if a != b]
    first = np.concatenate([faces[:, a] for a, _ in ways])
    second = np.concatenate([faces[:, b] for _, b in ways])
    along = (on[second] | ~on[first]).all(1)
    keys = np.unique(first[along].astype(np.int64) * n + second[along])
    share = 1.0 / np.bincount(keys // n, minlength=n)[keys // n]
    return SparseRows.of((keys // n, keys % n, share), (n, n))
