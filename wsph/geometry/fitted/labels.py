"""The patch that every outer side of the cells stands for."""

# pyright: strict

import numpy as np

from wsph.geometry.fitted.outline import Outline

TURN = 3.0
"""Spacings that a side which faces away from a patch counts as farther: 1 - cosine times this."""

ROUNDS = 30
"""Rounds of smoothing, at most."""

FIRST = 1e-3
"""Weight of the distances among patches that are as frequent among a side's neighbours."""


def side_neighbours(sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of sides (m, 2^(dim-1)) that share an edge, in 2D a node, in both directions."""
    many, corners = sides.shape
    # In 2D a side has as many nodes as ends, in 3D as many as edges.
    own = np.asarray(np.arange(many * corners) // corners, int)
    edges = sides.reshape(-1, 1)
    if corners == 4:
        edges = np.sort(sides[:, [[0, 1], [1, 3], [3, 2], [2, 0]]].reshape(-1, 2), axis=1)
    key = edges[:, 0].astype(np.int64) * (int(sides.max(initial=0)) + 1) + edges[:, -1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    a, b = own[order][same], own[order][same + 1]
    return np.concatenate([a, b]), np.concatenate([b, a])


def label_sides(body: Outline, centres: np.ndarray, normals: np.ndarray, sides: np.ndarray, seed: int) -> np.ndarray:
    """The patches of sides with `centres` and unit `normals` (m, dim), (m,) int: the nearest that faces the same way, and
    not that of a side alone among others, or of a row of such sides, whose corners would all fall on one edge."""
    cost = np.stack([_cost(body, patch, centres, normals) for patch in range(len(body.patches))], 1)
    label: np.ndarray = cost.argmin(1)
    side, beside = side_neighbours(sides)
    most, row = (0 if sides.shape[1] == 2 else 1), np.arange(len(label))
    for turn in range(ROUNDS):
        votes = np.zeros(cost.shape)
        np.add.at(votes, (side, label[beside]), 1.0)
        mine, best = votes[row, label], np.where(votes > 0.0, votes - FIRST * cost, -np.inf).argmax(1)
        alone = (mine <= most) & (votes[row, best] > mine) & (votes[row, best] >= sides.shape[1] / 2)
        between = _between(label, sides, len(body.patches))
        best, alone = np.where(alone | (between < 0), best, between), alone | (between >= 0)
        if not alone.any():
            break
        if turn:
            # Two neighbours that take each other's label would do so for ever: half of them wait.
            alone &= np.random.default_rng([seed, turn]).random(len(label)) < 0.5
        label = np.where(alone, best, label)
    return label


def _between(label: np.ndarray, sides: np.ndarray, patches: int) -> np.ndarray:
    """The other patch that all corners of a side lie on, or -1, (m,) int."""
    there = np.zeros((int(sides.max()) + 1, patches), bool)
    there[sides.ravel(), np.repeat(label, sides.shape[1])] = True
    other = np.all(there[sides], axis=1)
    other[np.arange(len(label)), label] = False
    return np.where(other.any(1), other.argmax(1), -1)


def _cost(body: Outline, patch: int, centres: np.ndarray, normals: np.ndarray) -> np.ndarray:
    gradient = body.patches[patch].surface.height(centres)[1]
    facing = (gradient * normals).sum(1) / np.maximum(np.linalg.norm(gradient, axis=1), 1e-12)
    distance = body.distance(patch, centres, 4.0 * body.spacing) / body.spacing
    cost: np.ndarray = np.minimum(distance, 1e3) + TURN * (1.0 - facing)
    return cost.round(6)
